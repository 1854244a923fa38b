/* @MADE_BY@
 *
 * @TITLE@
@ABOUT@
 *
 * Simulates the drive in steps of a fixed length. C99, no allocation, no globals that change; needs
 * <math.h> only. Compile without -ffast-math and with -ffp-contract=off (CMakeLists.txt does): then
 * results have the same bits as ab_sim's (drive_check.c tries it).
 *
 *     struct drive d;
 *     drive_init(&d);                 // at rest as the scene says, holds its start speed
 *     drive_command(&d, 150.0);       // rad/s, at the scene's largest acceleration
 *     drive_step(&d, 1000);           // of DRIVE_STEP each
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
    DRIVE_AXES = @AXES@, /* along which the deck moves */
    DRIVE_SEGMENTS = @SEGMENTS@ /* of a speed profile, at most */
};
@SENSOR_NAMES@
enum drive_status {
    DRIVE_OK,
    DRIVE_REFUSED, /* a command beyond the limits; nothing has changed */
    DRIVE_DIVERGED /* the state went beyond all bounds; it is the last good one */
};

/* Constants; drive_init sets those of the scene. Call drive_update after changing some. What follows
 * from several of the scene's (M of the balls' masses, M0 e of M0 and e, where the deck hangs) does
 * not follow from one that is changed here. */
struct drive_parameters {
@PARAMETERS@};

/* What is seen of the drive after the last step. */
struct drive_outputs {
@OUTPUTS@};

/* A piece of the speed profile. */
struct drive_segment {
    int kind;
    double start, end; /* s */
    double start_angle; /* rad, of the spindle at its start */
    double phase; /* the same without whole turns */
@SEGMENT_FIELDS@};
@if columns

/* What follows from the balls' masses and radii, see BallConstants in ab_sim/model/equations/race.py. */
struct drive_balls {
@COLUMNS@};
@end

struct drive {
    struct drive_parameters p;
    struct drive_outputs out;

    /* Private: */
    int64_t steps; /* taken so far */
    double y[DRIVE_STATES]; /* @STATE_NAMES@ */
    double slope[DRIVE_STATES]; /* dy/dt */
    double slope_time; /* when that is [s], since its segment began */
    int slope_segment; /* -1: it is not known */
    int derived_segment; /* for which the following are; -1: for none */
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
    int64_t turns[DRIVE_BALLS]; /* whole turns taken out of the balls' angles */
@end
    int commanded;
    double command, acceleration; /* in force */
    int segments;
    struct drive_segment segment[DRIVE_SEGMENTS];
@if sensors
    struct {
        double mode[DRIVE_AXES][2]; /* of the low-pass */
        double force[DRIVE_AXES]; /* m/s^2, its last input */
    } sensor[DRIVE_SENSORS];
@end
};

/* t = 0, the scene's start and parameters; the spindle holds its start speed until commanded. */
void drive_init(struct drive *d);

/* The same, but parameters stay as they are. */
void drive_reset(struct drive *d);

/* Follow the scene's own speed profile from t = 0: directly after drive_init or drive_reset. A
 * command takes over from it. */
void drive_follow_profile(struct drive *d);

/* Go to a speed [rad/s] at a constant acceleration [rad/s^2] from now on, then hold it; the one in
 * force changes nothing. drive_command takes DRIVE_MAX_ACCELERATION. */
enum drive_status drive_command(struct drive *d, double speed);
enum drive_status drive_command_ramp(struct drive *d, double speed, double acceleration);

/* Take steps; outputs are those at the end of the last one. */
enum drive_status drive_step(struct drive *d, long steps);

/* Parameters have changed: outputs are those of the present state with them. */
void drive_update(struct drive *d);

double drive_time(const struct drive *d); /* s */
double drive_whirl(const struct drive *d); /* m, sqrt(x^2 + y^2) */
@if quaternion
/* The deck's turn: alpha, beta, gamma [rad] of Rz(gamma) Rx(alpha) Ry(beta), each within +-pi. By
 * the C library's asin and atan2, so to rounding only. */
void drive_tilt(const struct drive *d, double angle[3]);
@end

#ifdef __cplusplus
}
#endif

#endif
