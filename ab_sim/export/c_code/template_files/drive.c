/* @MADE_BY@
 *
 * @TITLE@ See drive.h.
 *
 * Every fused multiply-add is written as fma(); no other product may be fused with a sum
 * (-ffp-contract=off). Cosines and sines of the motion are polynomials, written out. Of <math.h> it
 * takes fma, fabs, sqrt, ceil, rint, copysign, nextafter, which IEEE 754 and C99 fix to the bit, and
 * to take whole turns out of angles beyond pi, at the start and at a command, sin, cos, atan2.
 */
#include "drive.h"

#include <float.h>
#include <math.h>
#include <string.h>

#if defined(__FAST_MATH__)
#error "drive.c: compile it without -ffast-math"
#elif FLT_EVAL_METHOD != 0 && FLT_EVAL_METHOD != 16 /* 16: of _Float16 only, on newer x86 */
#error "drive.c: doubles are computed with more digits; for 32-bit x86 use -msse2 -mfpmath=sse"
#endif
#if defined(_MSC_VER)
#pragma fp_contract(off)
#elif defined(__clang__) || !defined(__GNUC__)
#pragma STDC FP_CONTRACT OFF
#else
#pragma GCC optimize("fp-contract=off") /* it does not know the standard's pragma */
#endif

enum { BALLS = DRIVE_BALLS, STATES = DRIVE_STATES, AXES = DRIVE_AXES };
enum { RAMP, RAISED_COSINE };
#define STEP DRIVE_STEP
#define PI 3.141592653589793

static const struct drive_parameters scene_parameters = {
@PARAMETER_VALUES@};

static const double start_state[STATES] = {
@START@};

/* Magnitudes that no sound run reaches. */
static const double bounds[STATES] = {
@BOUNDS@};

/* The scene's speed profile. */
static const struct drive_segment profile[] = {
@PROFILE@};
@if balls

@SUMS@
@end

/* ---- The equations of motion, as docs/equations.md of ab_sim has them, and @SOURCES@,
 * with the effects
@EFFECTS@
 *
 * Traced, and written out: t1, t2 ... are what is used more than once. Cosine and sine of an angle
 * are reduced by quarter turns, 0x1.45f306dc9c883p-1 being 2/pi; polynomials as in fdlibm. */

@EQUATIONS@
/* A step of @STEPPER@.
 * @STEPPER_SOURCE@ */
@RUNGE_KUTTA@
/* ---- Where on the speed profile steps go. */

/* How far apart two times may be and still be the same instant [s]. */
static double same_instant(double time)
{
    const double rounding = 4.0 * (nextafter(time, INFINITY) - time);
    return rounding > 1e-9 * STEP ? rounding : 1e-9 * STEP;
}

static int segment_at(const struct drive *d, double time)
{
    int found = 0;
    while (found + 1 < d->segments && d->segment[found + 1].start <= time)
        found++;
    return found;
}

/* That in force just after a time. */
static int segment_after(const struct drive *d, double time)
{
    return segment_at(d, time + same_instant(time));
}

/* How long a step may be along a segment [s]. */
static double longest_step(const struct drive_segment *s)
{
@if cosine
    /* A curve shorter than the cycle of the fastest motion is passed in as many steps as that. */
    const double share = (s->end - s->start) / @CYCLE@;
    if (s->kind == RAISED_COSINE && share < 1.0)
        return STEP * share;
@end
    (void)s;
    return STEP;
}

/* An angle without its whole turns, within -pi .. pi. */
static double without_turns(double angle)
{
    return fabs(angle) <= PI ? angle : atan2(sin(angle), cos(angle));
}

/* ---- Steps. */
@if sensors

struct sensor {
    double cosine, sine; /* of its first axis from the deck's x */
    double range, resolution; /* m/s^2; resolution 0: none */
    int every; /* steps from sample to sample */
    double decay, decay_i, gain, gain_i; /* its low-pass, see ab_sim/drive/sensing/pickup.py */
    double start[AXES]; /* m/s^2, what it feels at the start */
};

static const struct sensor sensors[DRIVE_SENSORS] = {
@SENSORS@};

static void turn_to_axes(const struct sensor *own, double *force)
{
    const double x = force[0], y = force[1];
    force[0] = own->cosine * x + own->sine * y;
    force[1] = own->cosine * y - own->sine * x;
}

static double converted(const struct sensor *own, double force)
{
    const double limit = own->range;
    const double clipped = force < -limit ? -limit : force > limit ? limit : force;
    return own->resolution > 0.0 ? own->resolution * rint(clipped / own->resolution) : clipped;
}

/* A step of all low-passes, and a sample where it is due; without noise. */
static void sense(struct drive *d)
{
    double felt[DRIVE_SENSORS][AXES];
    feel(d, &d->out, felt);
    for (int k = 0; k < DRIVE_SENSORS; k++) {
        const struct sensor *own = &sensors[k];
        turn_to_axes(own, felt[k]);
        for (int axis = 0; axis < AXES; axis++) {
            double *mode = d->sensor[k].mode[axis], *last = &d->sensor[k].force[axis];
            const double change = felt[k][axis] - *last, re = mode[0], im = mode[1];
            mode[0] = (own->decay * re - own->decay_i * im) + own->gain * change;
            mode[1] = (own->decay * im + own->decay_i * re) + own->gain_i * change;
            *last = felt[k][axis];
            if (d->steps % own->every == 0)
                d->out.readings[k][axis] = converted(own, *last - (mode[0] + mode[1]));
        }
    }
}
@end

/* Slope and outputs of the state at a time since a segment began [s]. */
static void look(struct drive *d, int segment, double time, double profile_time)
{
    const struct drive_segment *s = &d->segment[segment];
    if (d->derived_segment != segment) {
        derive(d, s);
        d->derived_segment = segment;
    }
    finish(d, s, time, d->y, d->slope, profile_time, &d->out);
    d->slope_time = time;
    d->slope_segment = segment;
@if balls
    for (int i = 0; i < BALLS; i++)
        d->out.ball_angle[i] += 2.0 * PI * (double)d->turns[i];
@end
    if (d->commanded)
        d->out.command = d->command;
}

/* Take whole turns out of angles, so that they keep their digits. */
static void unwind(struct drive *d)
{
@if balls
    for (int i = 0; i < BALLS; i++) {
        double *angle = &d->y[@ANGLES@ + i];
        if (fabs(*angle) > 2.0 * PI) {
            const int64_t turns = (int64_t)(*angle / (2.0 * PI));
            *angle = (*angle - (double)turns * (2.0 * PI)) - (double)turns * 2.4492935982947064e-16;
            d->turns[i] += turns;
        }
    }
@end
@if quaternion
    /* Nothing depends on the quaternion's length but its digits. */
    double square = 0.0;
    for (int j = @QUATERNION@; j < @QUATERNION@ + 4; j++)
        square += d->y[j] * d->y[j];
    if (!(fabs(square - 1.0) <= 1e-12)) {
        const double scale = 1.0 / sqrt(square);
        for (int j = @QUATERNION@; j < @QUATERNION@ + 4; j++)
            d->y[j] *= scale;
    }
@end
    (void)d;
}

/* A step, or a part of one that begins so far into it [s], along one segment. */
static int take_part(struct drive *d, int segment, double offset, double length)
{
    const struct drive_segment *s = &d->segment[segment];
    const double begin = ((double)d->steps * STEP - s->start) + offset;
    const double whole = (double)(d->steps + 1) * STEP - s->start;
    double trial[STATES];
    if (d->slope_segment != segment || d->slope_time != begin)
        look(d, segment, begin, begin);
    runge_kutta(d, s, begin, length, d->y, d->slope, trial);
    for (int j = 0; j < STATES; j++)
        if (!(fabs(trial[j]) < bounds[j]))
            return 0;
    memcpy(d->y, trial, sizeof trial);
    unwind(d);
    look(d, segment, length != STEP ? begin + length : whole + offset, whole);
    return 1;
}

static int take_step(struct drive *d)
{
    const double begin = (double)d->steps * STEP, end = (double)(d->steps + 1) * STEP;
    int segment = segment_after(d, begin);
    const struct drive_segment *s = &d->segment[segment];
    if (longest_step(s) == STEP && (isinf(s->end) || end <= s->end + same_instant(s->end)))
        return take_part(d, segment, 0.0, STEP);
    for (double now = begin;;) {
        segment = segment_after(d, now);
        s = &d->segment[segment];
        const double until = s->end < end - same_instant(end) ? s->end : end;
        const double longest = longest_step(s);
        const double count = fmax(1.0, ceil((until - now) / longest - 1e-9));
        const double length = (until - now) / count;
        for (double k = 0.0; k < count; k += 1.0)
            if (!take_part(d, segment, (now - begin) + k * length, length))
                return 0;
        if (until == end)
            return 1;
        now = until;
    }
}

enum drive_status drive_step(struct drive *d, long steps)
{
    for (long k = 0; k < steps; k++) {
        if (!take_step(d)) {
            d->slope_segment = -1;
            return DRIVE_DIVERGED;
        }
        d->steps++;
@if sensors
        sense(d);
@end
    }
    return DRIVE_OK;
}

/* ---- Start, commands, outputs. */

void drive_init(struct drive *d)
{
    memset(d, 0, sizeof *d);
    d->p = scene_parameters;
    drive_reset(d);
}

void drive_reset(struct drive *d)
{
    d->steps = 0;
    memcpy(d->y, start_state, sizeof start_state);
@if balls
    for (int i = 0; i < BALLS; i++) {
        const double angle = d->p.start_ball_angle[i], within = without_turns(angle);
        d->y[@ANGLES@ + i] = within;
        d->turns[i] = (int64_t)rint((angle - within) / (2.0 * PI));
    }
@end
    d->commanded = 0;
    d->segments = 1;
    d->segment[0] = (struct drive_segment){
        .kind = RAMP, .end = INFINITY, .start_angle = @START_ANGLE@, .start_speed = @START_SPEED@};
    d->segment[0].phase = without_turns(d->segment[0].start_angle);
@if sensors
    for (int k = 0; k < DRIVE_SENSORS; k++)
        for (int axis = 0; axis < AXES; axis++) {
            const double force = sensors[k].start[axis];
            d->sensor[k].mode[axis][0] = d->sensor[k].mode[axis][1] = 0.0;
            d->sensor[k].force[axis] = force;
            d->out.readings[k][axis] = converted(&sensors[k], force);
        }
@end
    drive_update(d);
}

void drive_update(struct drive *d)
{
    const double now = drive_time(d);
    const int segment = segment_after(d, now);
    const double time = now - d->segment[segment].start;
    d->derived_segment = -1;
    look(d, segment, time, time);
}

void drive_follow_profile(struct drive *d)
{
    d->commanded = 0;
    d->segments = (int)(sizeof profile / sizeof profile[0]);
    memcpy(d->segment, profile, sizeof profile);
    drive_update(d);
}

enum drive_status drive_command(struct drive *d, double speed)
{
    return drive_command_ramp(d, speed, DRIVE_MAX_ACCELERATION);
}

enum drive_status drive_command_ramp(struct drive *d, double speed, double acceleration)
{
    const double now = drive_time(d);
    const struct drive_segment *s = &d->segment[segment_at(d, now)];
    if (!(fabs(speed) <= DRIVE_MAX_SPEED))
        return DRIVE_REFUSED;
    if (!(acceleration > 0.0 && acceleration <= DRIVE_MAX_ACCELERATION))
        return DRIVE_REFUSED;
    if (d->commanded && speed == d->command && acceleration == d->acceleration)
        return DRIVE_OK;

    const double present = speed_of(s, now - s->start);
    const double slope = copysign(acceleration, speed - present);
    const double duration = (speed - present) / slope;
    struct drive_segment ramp = {
        .kind = RAMP, .start = now, .end = now + duration, .start_speed = present, .slope = slope};
    struct drive_segment hold = {.kind = RAMP, .start = now, .end = INFINITY, .start_speed = speed};
    ramp.start_angle = s->start_angle + angle_of(s, now - s->start);
    ramp.phase = without_turns(ramp.start_angle);
    hold.start_angle = ramp.start_angle;
    d->segments = 0;
    if (duration > 0.0) {
        hold.start += duration;
        hold.start_angle += angle_of(&ramp, duration);
        d->segment[d->segments++] = ramp;
    }
    hold.phase = without_turns(hold.start_angle);
    d->segment[d->segments++] = hold;
    d->commanded = 1;
    d->command = speed;
    d->acceleration = acceleration;
    drive_update(d);
    return DRIVE_OK;
}

double drive_time(const struct drive *d)
{
    return (double)d->steps * STEP;
}

double drive_whirl(const struct drive *d)
{
    return sqrt(d->out.x * d->out.x + d->out.y * d->out.y);
}
@if quaternion

void drive_tilt(const struct drive *d, double angle[3])
{
    const double w = d->out.qw, x = d->out.qx, y = d->out.qy, z = d->out.qz;
    const double sine = 2.0 * (y * z + w * x);
    angle[0] = asin(fmax(-1.0, fmin(1.0, sine)));
    angle[1] = atan2(-2.0 * (x * z - w * y), 1.0 - 2.0 * (x * x + y * y));
    angle[2] = atan2(-2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z));
}
@end
