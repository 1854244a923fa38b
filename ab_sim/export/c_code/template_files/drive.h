/* @MADE_BY@
 *
 * @TITLE@
@ABOUT@
 *
 * Simulates the drive in steps of a fixed length. C99, no allocation, no mutable globals; needs
 * <math.h> only. Compile without -ffast-math and with -ffp-contract=off (CMakeLists.txt does): then
 * results have the same bits as those of ab_sim (drive_check.c checks it).
 *
 *     struct drive d;
 *     drive_init(&d);                 // start state of the scene; holds its start speed
 *     drive_command(&d, 150.0);       // rad/s, at the scene's largest acceleration
 *     drive_step(&d, 1000);           // 1000 steps of DRIVE_STEP
 *     printf("%g m\n", drive_whirl(&d));
 *
 * Symbols, signs and axes are those of ab_sim's docs/conventions.md and docs/equations.md.
 */
#ifndef DRIVE_H
#define DRIVE_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define DRIVE_STEP @STEP@ /* s */
#define DRIVE_MAX_SPEED @MAX_SPEED@ /* rad/s: spindle.max_speed */
#define DRIVE_MAX_ACCELERATION @MAX_ACCELERATION@ /* rad/s^2: spindle.max_acceleration */
enum {
    DRIVE_BALLS = @BALLS@,
    DRIVE_STATES = @STATES@,
    DRIVE_AXES = @AXES@, /* number of axes along which the deck moves */
    DRIVE_SEGMENTS = @SEGMENTS@ /* largest number of segments of a speed profile */
};
@SENSOR_NAMES@
enum drive_status {
    DRIVE_OK,
    DRIVE_REFUSED, /* a command or an offset beyond the limits; nothing has changed */
    DRIVE_DIVERGED /* the state went beyond all bounds; the last valid state is kept */
};

/* Constants; drive_init sets those of the scene. Call drive_update after changing some. Quantities
 * that combine several keys of the scene (M with the balls' masses, M0 e, the rest position under
 * gravity) are separate constants here: they do not change with the others. */
struct drive_parameters {
@PARAMETERS@};

/* Outputs after the last step. */
struct drive_outputs {
@OUTPUTS@};

/* Segment of the speed profile. */
struct drive_segment {
    int kind;
    double start, end; /* s */
    double start_angle; /* rad, spindle angle at the start */
    double phase; /* rad, start_angle without whole turns */
@SEGMENT_FIELDS@};
@if columns

/* Derived from the balls' masses and radii, see BallConstants in ab_sim/model/equations/race.py. */
struct drive_balls {
@COLUMNS@};
@end

struct drive {
    struct drive_parameters p;
    struct drive_outputs out;

    /* Private: */
    int64_t steps; /* number of whole steps taken */
    double offset; /* time since the last whole step [s] */
    double y[DRIVE_STATES]; /* @STATE_NAMES@ */
    double slope[DRIVE_STATES]; /* dy/dt */
    double slope_time; /* time of the slope since its segment began [s] */
    int slope_segment; /* segment of the slope; -1: unknown */
    int derived_segment; /* segment of the following derived constants; -1: none */
@if derived
    double derived[@DERIVED@];
@end
@if ball_derived
    double ball_derived[@BALL_DERIVED@][DRIVE_BALLS];
@end
@if columns
    struct drive_balls balls;
@end
@if balls
    int64_t turns[DRIVE_BALLS]; /* whole turns removed from the balls' angles */
@end
    int commanded;
    double command, acceleration; /* present command [rad/s], [rad/s^2] */
    int segments;
    struct drive_segment segment[DRIVE_SEGMENTS];
@if sensors
    struct {
        double mode[DRIVE_AXES][2]; /* state of the low-pass */
        double force[DRIVE_AXES]; /* m/s^2, last input of the low-pass */
    } sensor[DRIVE_SENSORS];
@end
};

/* Set t = 0 and the scene's start state and parameters; the spindle holds its start speed until
 * commanded. */
void drive_init(struct drive *d);

/* Like drive_init, but keep the parameters. */
void drive_reset(struct drive *d);

/* Follow the scene's speed profile from t = 0. Call it directly after drive_init or drive_reset. A
 * command replaces the profile. */
void drive_follow_profile(struct drive *d);

/* Approach a speed [rad/s] at a constant acceleration [rad/s^2] from now on, then hold it. A
 * command equal to the present one changes nothing. drive_command uses DRIVE_MAX_ACCELERATION. */
enum drive_status drive_command(struct drive *d, double speed);
enum drive_status drive_command_ramp(struct drive *d, double speed, double acceleration);

/* Take steps and set the outputs at the end of the last one. The first completes a step that
 * drive_step_part began. */
enum drive_status drive_step(struct drive *d, long steps);

/* Begin the next step or continue it, up to an offset from its beginning [s], above the present one
 * and below DRIVE_STEP. Needed only for times between two steps: results differ from those of whole
 * steps by less than the error of a step. Accelerometers read at whole steps. */
enum drive_status drive_step_part(struct drive *d, double offset);

/* Set the outputs of the present state after a change of parameters. */
void drive_update(struct drive *d);

double drive_time(const struct drive *d); /* s */
double drive_whirl(const struct drive *d); /* m, sqrt(x^2 + y^2) */
@if quaternion
/* Get the deck's angles alpha, beta, gamma [rad] of Rz(gamma) Rx(alpha) Ry(beta), each within +-pi.
 * They depend on the C library's asin and atan2, so they agree with ab_sim only to rounding. */
void drive_tilt(const struct drive *d, double angle[3]);
@end

#ifdef __cplusplus
}
#endif

#endif
