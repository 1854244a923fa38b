/* An adaptive start-up for a spindle with balls that balance it: it finds the critical speed and
   follows the net unbalance by itself. One file, C99, no allocation, no clock, no text but what
   adaptive_reason_text returns. ab_sim/control is the same in Python, operation by operation; build
   with -ffp-contract=off for the same bits. docs/adaptive.md says how it decides. */
#ifndef ADAPTIVE_H
#define ADAPTIVE_H

#include <stdbool.h>

#ifndef ADAPTIVE_REAL
#define ADAPTIVE_REAL double /* or float: with -DADAPTIVE_REAL=float */
#endif
typedef ADAPTIVE_REAL adaptive_real;

enum adaptive_quantity { ADAPTIVE_DISPLACEMENT, ADAPTIVE_ACCELERATION };

struct adaptive_settings {
    adaptive_real final_speed;  /* rad/s, above the critical speed */
    adaptive_real acceleration; /* rad/s^2, the largest rate of change of the command */
    adaptive_real period;       /* s between two calls of adaptive_command */
    enum adaptive_quantity quantity;
    int axes;                 /* readings per sample: 1, or 2 on axes 90 degrees apart */
    adaptive_real axis_angle; /* rad, of the first from where angle 0 of the spindle points */
    adaptive_real noise;      /* standard deviation of a reading; 0: not known */
    int most_retries;
    adaptive_real patience; /* s after the start, after which no retry begins */
    adaptive_real silence;  /* s without a good sample, after which it aborts */
    adaptive_real limit;    /* largest magnitude of a reading; a larger one aborts */
};

enum adaptive_state {
    ADAPTIVE_WAITING,
    ADAPTIVE_RUN_UP,
    ADAPTIVE_DWELL,
    ADAPTIVE_TO_FINAL,
    ADAPTIVE_JUDGING,
    ADAPTIVE_RETRY,
    ADAPTIVE_DONE,
    ADAPTIVE_GAVE_UP,
    ADAPTIVE_ABORTING,
    ADAPTIVE_ABORTED
};

enum adaptive_reason {
    ADAPTIVE_NONE,
    ADAPTIVE_ASKED,
    ADAPTIVE_SILENT,
    ADAPTIVE_TIME_BACK,
    ADAPTIVE_LIMIT,
    ADAPTIVE_REPEATING,
    ADAPTIVE_DRIFTING,
    ADAPTIVE_AXES,
    ADAPTIVE_ANGLE,
    ADAPTIVE_NOT_FOLLOWING
};

enum { ADAPTIVE_SIZE = 7, ADAPTIVE_NUMBERS = 52, ADAPTIVE_AXIS_NUMBERS = 67 };

/* One axis: x, x', Re q, Im q, K, D, offset; their covariance. */
struct adaptive_axis {
    adaptive_real state[ADAPTIVE_SIZE];
    adaptive_real covariance[ADAPTIVE_SIZE][ADAPTIVE_SIZE];
    bool known;
    adaptive_real variance, size;
    adaptive_real first, sum, squares, rough, last, before, count, wild;
};

struct adaptive {
    struct adaptive_settings settings;
    adaptive_real unit; /* s */
    /* What it does. */
    enum adaptive_state state;
    enum adaptive_reason reason;
    int decisions;
    adaptive_real command;
    double clock;
    adaptive_real elapsed, in_state;
    bool called;
    adaptive_real heard, standing, stood_at, nudge, stagnant, before;
    int dwells, retries;
    /* What it has seen. */
    long samples;
    double time;
    adaptive_real angle, speed, slope;
    adaptive_real p, r; /* force per mass of a net unbalance of 1 and of i, along the first axis */
    adaptive_real re, im, deviation; /* net unbalance [m] */
    adaptive_real fast, slow, average_re, average_im, scale;
    adaptive_real critical, critical_deviation, damping;
    bool known;
    /* What the sensor is watched by. */
    adaptive_real last[2], peak[2], mean[2], origin[2], swing[2], stuck[2], agreement, slip, doubt;
    long run[2];
    struct adaptive_axis axis[2];
};

/* Settings with the usual limits; the rest is still to be set. */
struct adaptive_settings adaptive_defaults(void);

void adaptive_init(struct adaptive *a, const struct adaptive_settings *settings);

/* One reading: when [s], the spindle's angle [rad] and speed [rad/s] then, the reading along each
   axis; the second counts with two axes only. With float, wrap the angle. */
void adaptive_sample(struct adaptive *a, double time, adaptive_real angle, adaptive_real speed,
                     adaptive_real first, adaptive_real second);

/* Once a period: the speed to command now [rad/s]. */
adaptive_real adaptive_command(struct adaptive *a, double time);

/* Run down to standstill. */
void adaptive_abort(struct adaptive *a, double time);

/* Whether balls go round: the net unbalance turns against the rotor. */
bool adaptive_circulating(const struct adaptive *a);

const char *adaptive_state_text(enum adaptive_state state);
const char *adaptive_reason_text(enum adaptive_reason reason);

/* The whole state, ADAPTIVE_NUMBERS + axes * ADAPTIVE_AXIS_NUMBERS numbers, and back; as
   StartUp.state_numbers in Python. Returns how many. */
int adaptive_numbers(const struct adaptive *a, double *numbers);
void adaptive_restore(struct adaptive *a, const double *numbers);

#endif
