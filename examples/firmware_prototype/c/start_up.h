/* When to leave the variable-speed period: see ../start_up.py, which this is, line by line.
   No middleware, no clock, no allocation: fit for a microcontroller. */
#ifndef START_UP_H
#define START_UP_H

#include <stdbool.h>

/* What the drive's designer says. */
struct settings {
    double ramp;         /* rad/s^2, up and down; less than the drive's spindle.max_acceleration */
    double hold_speed;   /* rad/s, a little above the critical speed */
    double final_speed;  /* rad/s */
    double turns;        /* over which the vibration that turns with the spindle is measured */
    double quiet;        /* the hold is over when that is down to this share of its largest ... */
    double permissible;  /* ... or to this [m/s^2], however quiet it was before */
    double longest_hold; /* s */
    double settle;       /* s at the final speed before the vibration is judged */
    double limit;        /* m/s^2; a larger vibration ends the run */
    double silence;      /* s without a good sample of either kind after which the run ends */
    double catching_up;  /* s that the spindle may need for reaching what is commanded */
};

/* For the scene balanced-start-up. */
extern const struct settings default_settings;

enum state { WAITING, RUN_UP, HOLD, TO_FINAL, AT_SPEED, RUN_DOWN, OFF };

struct start_up {
    struct settings settings;
    void (*say)(const char *line); /* told each decision */
    enum state state;
    bool failed;
    double command;   /* rad/s */
    double amplitude; /* of the vibration that turns with the spindle, last window [m/s^2] */
    double in_state, largest;
    bool judged;
    double angle, speed, angle_time, vibration_time;
    double spindle_silent, vibration_silent;
    double sum_x, sum_y, begin;
    int count;
};

void start_up_init(struct start_up *s, const struct settings *settings, void (*say)(const char *));

/* A sample of the spindle: when [s], angle [rad], speed [rad/s]. */
void start_up_spindle(struct start_up *s, double time, double angle, double speed);

/* A sample of the deck's acceleration [m/s^2] along two axes across the shaft. */
void start_up_vibration(struct start_up *s, double time, double x, double y);

/* To be called at a fixed rate, `passed` seconds apart: the speed to command now [rad/s]. */
double start_up_tick(struct start_up *s, double passed);

/* Run down; nothing new if that is under way. */
void start_up_stop(struct start_up *s);

#endif
