/* Adaptive start-up of a spindle with a ball balancer: it estimates the critical speed and the net
   unbalance. One file of C99, without allocation and clock. ab_sim/control is the same in Python,
   operation by operation; with -ffp-contract=off both give the same bits. docs/adaptive.md describes
   the decisions. */
#ifndef ADAPTIVE_H
#define ADAPTIVE_H

#include <stdbool.h>

#ifndef ADAPTIVE_REAL
#define ADAPTIVE_REAL double /* or float: with -DADAPTIVE_REAL=float */
#endif
typedef ADAPTIVE_REAL adaptive_real;

enum adaptive_quantity { ADAPTIVE_DISPLACEMENT, ADAPTIVE_ACCELERATION };

struct adaptive_settings {
    adaptive_real final_speed;  /* running speed, above the critical speed [rad/s] */
    adaptive_real acceleration; /* largest rate of change of the command [rad/s^2] */
    adaptive_real period;       /* time between two calls of adaptive_command [s] */
    enum adaptive_quantity quantity;
    int axes;                 /* readings per sample: 1, or 2 on axes 90 degrees apart */
    adaptive_real axis_angle; /* angle of the first axis from that of spindle angle 0 [rad] */
    adaptive_real noise;      /* standard deviation of a reading [m or m/s^2]; 0: unknown */
    int most_retries;       /* largest number of retries */
    adaptive_real patience; /* time after the start beyond which no retry begins [s] */
    adaptive_real silence;  /* time without a valid sample after which it aborts [s] */
    adaptive_real limit;    /* largest magnitude of a reading [m or m/s^2]; a larger one aborts */
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
    ADAPTIVE_REQUESTED,
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

/* Filter of one axis, as in ab_sim/control/axis_filter.py: x, x', Re q, Im q, K, D, offset. */
struct adaptive_axis {
    adaptive_real state[ADAPTIVE_SIZE];
    adaptive_real covariance[ADAPTIVE_SIZE][ADAPTIVE_SIZE];
    bool known;
    adaptive_real variance, size;
    adaptive_real first, sum, squares, rough, last, before, count, wild;
};

struct adaptive {
    struct adaptive_settings settings;
    adaptive_real unit; /* unit of time of the constants [s] */
    /* Decisions. */
    enum adaptive_state state;
    enum adaptive_reason reason;
    int decisions;
    adaptive_real command;
    double clock;
    adaptive_real elapsed, in_state;
    bool called;
    adaptive_real since_sample, standing, stood_at, nudge, stagnant, before;
    int dwells, retries;
    /* Estimates. */
    long samples;
    double time;
    adaptive_real angle, speed, slope;
    adaptive_real p, r; /* force per mass for a net unbalance of 1 m and of i m [m/s^2] */
    adaptive_real re, im, deviation; /* net unbalance [m] */
    adaptive_real fast, slow, average_re, average_im, scale;
    adaptive_real critical, critical_deviation, damping;
    bool known;
    /* Monitor of the sensor. */
    adaptive_real last[2], peak[2], mean[2], origin[2], swing[2], stuck[2], agreement, slip, doubt;
    long run[2];
    struct adaptive_axis axis[2];
};

/* Return settings with default limits; speeds, period and sensor must still be set. */
struct adaptive_settings adaptive_defaults(void);

void adaptive_init(struct adaptive *a, const struct adaptive_settings *settings);

/* Process a reading: its time [s], the spindle's angle [rad] and speed [rad/s] at that time, and the
   reading along each axis [m or m/s^2]. The second is used with two axes only. With float, wrap the
   angle. */
void adaptive_sample(struct adaptive *a, double time, adaptive_real angle, adaptive_real speed,
                     adaptive_real first, adaptive_real second);

/* Return the speed to command now [rad/s]; call this once per period. time: caller's clock [s]. */
adaptive_real adaptive_command(struct adaptive *a, double time);

/* Ramp down to standstill. */
void adaptive_abort(struct adaptive *a, double time);

/* Whether balls circulate: the net unbalance turns relative to the rotor. */
bool adaptive_circulating(const struct adaptive *a);

const char *adaptive_state_text(enum adaptive_state state);
const char *adaptive_reason_text(enum adaptive_reason reason);

/* Save the complete state as ADAPTIVE_NUMBERS + axes * ADAPTIVE_AXIS_NUMBERS numbers, those of
   StartUp.state_numbers in Python, and return their count; restore the state. */
int adaptive_numbers(const struct adaptive *a, double *numbers);
void adaptive_restore(struct adaptive *a, const double *numbers);

#endif
