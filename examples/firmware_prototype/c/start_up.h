/* Decisions of a start-up firmware: when to leave the variable-speed period. This is ../start_up.py
   in C, without middleware, clock and allocation, so that it runs on a microcontroller. */
#ifndef START_UP_H
#define START_UP_H

#include <stdbool.h>

/* Settings for one drive. */
struct settings {
    double ramp;         /* acceleration [rad/s^2], less than the drive's spindle.max_acceleration */
    double hold_speed;   /* speed of the hold [rad/s], a little above the critical speed */
    double final_speed;  /* running speed [rad/s] */
    double turns;        /* turns over which the vibration that turns with the spindle is averaged */
    double quiet;        /* the hold ends if this vibration falls to this share of its largest ... */
    double permissible;  /* ... or to this value [m/s^2] */
    double longest_hold; /* longest duration of the hold [s] */
    double settle;       /* time at the final speed before the vibration is judged [s] */
    double limit;        /* largest allowed vibration [m/s^2]; a larger one ends the run */
    double silence;      /* time without valid samples after which the run ends [s] */
    double catching_up;  /* longest time for the spindle to reach the commanded speed [s] */
};

/* Settings for the scene balanced-start-up. */
extern const struct settings default_settings;

enum state { WAITING, RUN_UP, HOLD, TO_FINAL, AT_SPEED, RUN_DOWN, OFF };

struct start_up {
    struct settings settings;
    void (*say)(const char *line); /* called with each decision */
    enum state state;
    bool failed;
    double command;   /* commanded speed [rad/s] */
    double amplitude; /* vibration that turns with the spindle, over the last window [m/s^2] */
    double in_state, largest;
    bool judged;
    double angle, speed, angle_time, vibration_time;
    double spindle_silent, vibration_silent;
    double sum_x, sum_y, begin;
    int count;
};

void start_up_init(struct start_up *s, const struct settings *settings, void (*say)(const char *));

/* Process a sample of the spindle: time [s], angle [rad], speed [rad/s]. */
void start_up_spindle(struct start_up *s, double time, double angle, double speed);

/* Process a sample of the deck's acceleration along two axes across the shaft [m/s^2]. */
void start_up_vibration(struct start_up *s, double time, double x, double y);

/* Return the speed to command now [rad/s]; call this at a fixed rate, every `passed` seconds. */
double start_up_tick(struct start_up *s, double passed);

/* Run down to standstill; if that is in progress, do nothing. */
void start_up_stop(struct start_up *s);

#endif
