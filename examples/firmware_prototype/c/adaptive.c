#include "adaptive.h"

#include <math.h>
#include <string.h>

typedef adaptive_real real;

/* Functions of math.h for `real`: newlib has no tgmath.h. Compilers remove the other branch. */
#define OF_REAL(function, x)                                                                       \
    (sizeof(real) == sizeof(float) ? (real)function##f((float)(x)) : (real)function((double)(x)))
#define cos(x) OF_REAL(cos, x)
#define fabs(x) OF_REAL(fabs, x)
#define floor(x) OF_REAL(floor, x)
#define log(x) OF_REAL(log, x)
#define sin(x) OF_REAL(sin, x)
#define sqrt(x) OF_REAL(sqrt, x)

#define R(x) ((real)(x))

/* The same constants as in ab_sim/control/chosen.py, which explains them. */
static const real UNIT = R(200.0);
static const real FIRST_RATIO = R(0.5), FIRST_STIFFNESS_DEVIATION = R(0.6), FIRST_DAMPING = R(0.03);
static const real NET_WALK = R(0.5), STIFFNESS_WALK = R(0.001), DAMPING_WALK = R(0.02);
static const real OFFSET_WALK = R(10.0), SCALE_ERROR = R(0.002), NOISE_GAIN = R(0.002);
static const real WILD = R(9.0), LONGEST_GAP = R(0.25), STEP_ANGLE = R(0.3);
static const real FAST = R(0.075), SLOW = R(0.38), CERTAIN = R(0.25), KNOWN_CRITICAL = R(0.025);
static const real FIRST_WHIRL = R(16.0), LATER_WHIRL = R(20.0), LARGEST_LAG = R(1.0);
static const real LAG_STEP = R(0.25), LEAST_DISTANCE = R(0.06), MOST_DISTANCE = R(0.3);
static const real RISING = R(0.09), UP = R(0.55), DOWN = R(0.1), AWAY = R(0.3), FALLING = R(0.5);
static const real STAGNANT = R(0.25), STAGNANT_PER_NET = R(5.5), NEARER = R(0.7);
static const real LONGEST_DWELL = R(10.0);
static const real SMALL = R(0.125), LATE = R(1.5), LEAVING = R(0.9), SETTLE = R(0.35);
static const real BALANCED = R(0.15), ACCEPTED = R(0.25), GAIN = R(0.85), WAIT = R(8.0);
static const real UNSURE = R(0.5), CIRCULATING = R(0.7), REPEATED = R(0.3), CONTRADICTING = R(0.5);
static const real MEAN = R(0.25), DRIFTED = R(2.0), AGREEING = R(0.3), AXES_AVERAGE = R(0.3);
static const real DOUBT = R(2.0), DOUBTED_STIFFNESS_DEVIATION = R(0.1);
static const real LEAD = R(0.15), NOT_FOLLOWING = R(3.0), LOST = R(20.0), FIRST_SAMPLES = R(5.0);
static const double BACK = 0.1, FAR = 1e9;
static const long REPEATS = 5;
static const real LAGS[4] = {R(0.0), R(1.0), R(-1.0), R(2.0)};
static const real TURN = R(6.283185307179586), LARGEST = R(1e9);

/* NaN is treated as by Python's max and min, so that both versions give the same bits. */
static real larger(real a, real b) { return b > a ? b : a; }
static real smaller(real a, real b) { return b < a ? b : a; }

/* --- Filter of one axis: see ab_sim/control/axis_filter.py. ----------------------------------- */

static void axis_init(struct adaptive_axis *x, const struct adaptive_settings *settings)
{
    real ratio = FIRST_RATIO * settings->final_speed, stiffness = ratio * ratio;
    real damping = FIRST_DAMPING * sqrt(stiffness), off = FIRST_STIFFNESS_DEVIATION * stiffness;
    memset(x, 0, sizeof *x);
    x->state[4] = stiffness;
    x->state[5] = damping;
    x->covariance[4][4] = off * off;
    x->covariance[5][5] = damping * damping;
}

static void axis_restart(struct adaptive_axis *x)
{
    if (x->known) {
        x->known = false;
        x->count = x->wild = 0;
    }
}

/* Estimate the motion again, from an uncertain estimate of the suspension. */
static void axis_restart_with(struct adaptive_axis *x, real critical, real damping)
{
    real stiffness = critical * critical, off = DOUBTED_STIFFNESS_DEVIATION * stiffness;
    axis_restart(x);
    x->state[4] = stiffness;
    x->state[5] = damping;
    x->covariance[4][4] = off * off;
    x->covariance[5][5] = damping * damping;
}

static void axis_begin(struct adaptive_axis *x, const struct adaptive_settings *settings,
                       real speed)
{
    real mean = x->sum / x->count;
    real spread = sqrt(larger(x->squares / x->count - mean * mean, R(0.0)));
    real noise = settings->noise, observed;
    real stiffness = x->state[4], damping = x->state[5], motion, net, least, rate, offset;
    real off4 = x->covariance[4][4], off5 = x->covariance[5][5];
    /* The given noise may be too small, and the observed one contains spikes. */
    observed = sqrt(x->rough / (R(6.0) * (x->count - R(2.0))));
    if (noise > R(0.0))
        observed = smaller(observed, R(10.0) * noise);
    noise = larger(noise, observed);
    noise = larger(noise, R(1e-3) * spread);
    if (!(noise > R(0.0)))
        return;
    motion = spread;
    net = spread * stiffness / (speed * speed);
    least = noise;
    if (settings->quantity == ADAPTIVE_ACCELERATION) {
        motion = net;
        net = net / (speed * speed);
        least = noise / stiffness;
    }
    motion += noise;
    net = larger(R(100.0) * least, R(4.0) * net);
    rate = motion * (speed + R(0.1) * settings->final_speed);
    offset = R(3.0) * noise + spread;
    memset(x->covariance, 0, sizeof x->covariance);
    memset(x->state, 0, sizeof x->state);
    x->covariance[0][0] = motion * motion;
    x->covariance[1][1] = rate * rate;
    x->covariance[2][2] = x->covariance[3][3] = net * net;
    x->covariance[4][4] = off4;
    x->covariance[5][5] = off5;
    x->covariance[6][6] = offset * offset;
    x->state[4] = stiffness;
    x->state[5] = damping;
    x->state[6] = x->first + mean;
    x->variance = noise * noise;
    x->size = spread * spread;
    x->known = true;
}

static void axis_collect(struct adaptive_axis *x, const struct adaptive_settings *settings,
                         real reading, real speed)
{
    real change;
    if (x->count == R(0.0) || x->count > R(400.0)) {
        x->first = reading;
        x->sum = x->squares = x->rough = x->count = 0;
    }
    change = reading - x->first;
    x->sum += change;
    x->squares += change * change;
    if (x->count >= R(2.0)) {
        real bend = reading - R(2.0) * x->last + x->before;
        x->rough += bend * bend;
    }
    x->before = x->last;
    x->last = reading;
    x->count += R(1.0);
    if (x->count >= R(20.0) && speed >= R(0.1) * settings->final_speed)
        axis_begin(x, settings, speed);
}

/* Predict the state h seconds ahead. p and r: force per mass for a net unbalance of 1 m and of i m
   at the beginning (0) and the end (1) of the step [m/s^2]. */
static void axis_predict(struct adaptive_axis *axis, const struct adaptive_settings *settings,
                         real h, real p0, real r0, real p1, real r1)
{
    real *s = axis->state;
    real(*P)[ADAPTIVE_SIZE] = axis->covariance;
    const real x = s[0], v = s[1], a = s[2], b = s[3], K = s[4], D = s[5];
    real u0 = a * p0 + b * r0, u1 = a * p1 + b * r1, k0 = 0, k1 = 0;
    real half = R(0.5) * h, square = R(0.5) * h * h, hd = h * D;
    real start, end, x1, v1, j4, f[6], g[6], X[ADAPTIVE_SIZE], V[ADAPTIVE_SIZE];
    real xx, xv, vv, walk, walk_K, walk_D;
    int i;
    if (settings->quantity == ADAPTIVE_ACCELERATION) {
        k0 = u0;
        k1 = u1;
        u0 *= K;
        u1 *= K;
        p0 *= K;
        r0 *= K;
        p1 *= K;
        r1 *= K;
    }
    start = u0 - K * x - D * v;
    x1 = x + h * v + square * start;
    v1 = v + h * start;
    end = u1 - K * x1 - D * v1;
    /* Derivatives of x and v at the end by the state before: f, g. */
    j4 = k0 - x;
    f[0] = R(1.0) - square * K;
    f[1] = h - square * D;
    f[2] = square * p0;
    f[3] = square * r0;
    f[4] = square * j4;
    f[5] = -(square * v);
    g[0] = half * (hd * K - K * f[0] - K);
    g[1] = R(1.0) + half * (hd * D - K * f[1] - D - D);
    g[2] = half * (p0 + p1 - K * f[2] - hd * p0);
    g[3] = half * (r0 + r1 - K * f[3] - hd * r0);
    g[4] = half * (j4 + k1 - x1 - K * f[4] - hd * j4);
    g[5] = half * (hd * v - v1 - K * f[5] - v);
    for (i = 0; i < ADAPTIVE_SIZE; i++) {
        X[i] = f[0] * P[0][i] + f[1] * P[1][i] + f[2] * P[2][i] + f[3] * P[3][i] + f[4] * P[4][i] +
               f[5] * P[5][i];
        V[i] = g[0] * P[0][i] + g[1] * P[1][i] + g[2] * P[2][i] + g[3] * P[3][i] + g[4] * P[4][i] +
               g[5] * P[5][i];
    }
    xx = f[0] * X[0] + f[1] * X[1] + f[2] * X[2] + f[3] * X[3] + f[4] * X[4] + f[5] * X[5];
    xv = g[0] * X[0] + g[1] * X[1] + g[2] * X[2] + g[3] * X[3] + g[4] * X[4] + g[5] * X[5];
    vv = g[0] * V[0] + g[1] * V[1] + g[2] * V[2] + g[3] * V[3] + g[4] * V[4] + g[5] * V[5];
    P[0][0] = xx;
    P[0][1] = P[1][0] = xv;
    P[1][1] = vv;
    for (i = 2; i < ADAPTIVE_SIZE; i++) {
        P[0][i] = P[i][0] = X[i];
        P[1][i] = P[i][1] = V[i];
    }
    walk = NET_WALK * NET_WALK * h * (a * a + b * b);
    walk_K = STIFFNESS_WALK * K;
    walk_D = DAMPING_WALK * D;
    P[2][2] += walk;
    P[3][3] += walk;
    P[4][4] += walk_K * walk_K * h;
    P[5][5] += walk_D * walk_D * h;
    P[6][6] += OFFSET_WALK * OFFSET_WALK * axis->variance * h;
    s[0] = x1;
    s[1] = v + half * (start + end);
}

static void axis_update(struct adaptive_axis *axis, const struct adaptive_settings *settings,
                        real reading, real p, real r)
{
    real *s = axis->state;
    real(*P)[ADAPTIVE_SIZE] = axis->covariance;
    real noise = axis->variance + SCALE_ERROR * SCALE_ERROR * axis->size;
    real g[ADAPTIVE_SIZE], S, innovation, root, surprise, square, change, total;
    const real final = settings->final_speed;
    int i, j;
    if (settings->quantity == ADAPTIVE_ACCELERATION) {
        real d = s[5] / s[4], h4 = d / s[4] * s[1], h5 = -(s[1] / s[4]);
        for (i = 0; i < ADAPTIVE_SIZE; i++)
            g[i] = p * P[i][2] + r * P[i][3] + h4 * P[i][4] + h5 * P[i][5] + P[i][6] - P[i][0] -
                   d * P[i][1];
        S = p * g[2] + r * g[3] + h4 * g[4] + h5 * g[5] + g[6] - g[0] - d * g[1] + noise;
        innovation = reading - (s[2] * p + s[3] * r + s[6] - s[0] - d * s[1]);
    } else {
        for (i = 0; i < ADAPTIVE_SIZE; i++)
            g[i] = P[i][0] + P[i][6];
        S = g[0] + g[6] + noise;
        innovation = reading - (s[0] + s[6]);
    }
    if (!(S > R(0.0))) {
        axis_restart(axis);
        return;
    }
    root = sqrt(S);
    surprise = innovation / root;
    square = surprise * surprise;
    axis->wild = square > WILD ? axis->wild + R(1.0) : R(0.0);
    if (axis->wild >= LOST) {
        axis_restart(axis);
        return;
    }
    if (square > WILD) {
        surprise *= sqrt(WILD / square);
        square = WILD;
    }
    for (i = 0; i < ADAPTIVE_SIZE; i++) {
        g[i] = g[i] / root;
        s[i] = s[i] + g[i] * surprise;
    }
    for (i = 0; i < ADAPTIVE_SIZE; i++) {
        real before = P[i][i];
        for (j = 0; j < ADAPTIVE_SIZE; j++)
            P[i][j] = P[i][j] - g[i] * g[j];
        /* Rounding must not make a variance negative. */
        P[i][i] = larger(P[i][i], R(1e-6) * before);
    }
    axis->variance *= R(1.0) + NOISE_GAIN * (square - R(1.0));
    change = reading - s[6];
    axis->size += R(0.01) * (change * change - axis->size);
    s[4] = smaller(larger(s[4], R(0.01) * final * final), R(0.9) * final * final);
    s[5] = smaller(larger(s[5], R(0.002) * final), R(0.3) * final);
    total = s[0] + s[1] + s[2] + s[3] + s[6] + P[0][0] + P[1][1];
    if (!(fabs(total) < R(1e30)))
        axis_init(axis, settings);
}

/* --- Monitor of the sensor. -------------------------------------------------------------------- */

static enum adaptive_reason watch_readings(struct adaptive *a, const real *readings, real dt,
                                           bool turning)
{
    int i;
    for (i = 0; i < a->settings.axes; i++) {
        real size = fabs(readings[i]);
        if (size > a->settings.limit)
            return ADAPTIVE_LIMIT;
        a->peak[i] = larger(a->peak[i], size);
        a->run[i] = readings[i] == a->last[i] ? a->run[i] + 1 : 0;
        a->last[i] = readings[i];
        if (a->run[i] >= REPEATS && turning && size >= R(0.5) * a->peak[i])
            a->stuck[i] += dt;
        else
            a->stuck[i] = larger(a->stuck[i] - R(0.1) * dt, R(0.0));
        if (a->stuck[i] > REPEATED * a->unit)
            return ADAPTIVE_REPEATING;
        if (a->samples == 1)
            a->mean[i] = a->origin[i] = readings[i];
        a->mean[i] += (readings[i] - a->mean[i]) * (dt / (dt + MEAN * a->unit));
        a->swing[i] = larger(a->swing[i], fabs(readings[i] - a->mean[i]));
        if (turning && fabs(a->mean[i] - a->origin[i]) > DRIFTED * a->swing[i])
            return ADAPTIVE_DRIFTING;
    }
    return ADAPTIVE_NONE;
}

static enum adaptive_reason watch_angle(struct adaptive *a, real change, real expected)
{
    real off = change - expected;
    if (fabs(expected) > R(1.0))
        return ADAPTIVE_NONE;
    off -= TURN * floor(off / TURN + R(0.5));
    off = fabs(off) > CONTRADICTING * larger(fabs(expected), R(0.1)) ? R(1.0) : R(0.0);
    a->slip += (off - a->slip) * R(0.02);
    return a->slip > R(0.5) ? ADAPTIVE_ANGLE : ADAPTIVE_NONE;
}

/* Compare the net unbalance of two axes. At the first contradiction both filters restart, because one
   may have failed to follow a net unbalance that turned fast. A second one is a sensor fault. */
static enum adaptive_reason watch_axes(struct adaptive *a, real dt)
{
    const real *s = a->axis[0].state, *t = a->axis[1].state;
    real(*P)[ADAPTIVE_SIZE] = a->axis[0].covariance, (*Q)[ADAPTIVE_SIZE] = a->axis[1].covariance;
    real one = s[2] * s[2] + s[3] * s[3], other = t[2] * t[2] + t[3] * t[3];
    real limit = CERTAIN * CERTAIN, likeness;
    int i;
    if (!(P[2][2] + P[3][3] + Q[2][2] + Q[3][3] < limit * (one + other)))
        return ADAPTIVE_NONE;
    likeness = R(2.0) * (s[2] * t[2] + s[3] * t[3]) / (one + other);
    a->agreement += (likeness - a->agreement) * (dt / (dt + AXES_AVERAGE * a->unit));
    a->doubt = larger(a->doubt - dt, R(0.0));
    if (a->agreement >= AGREEING)
        return ADAPTIVE_NONE;
    if (a->doubt > R(0.0))
        return ADAPTIVE_AXES;
    a->agreement = R(1.0);
    a->doubt = DOUBT * a->unit;
    for (i = 0; i < 2; i++)
        axis_restart_with(&a->axis[i], a->critical, a->damping);
    return ADAPTIVE_NONE;
}

/* --- Estimates. -------------------------------------------------------------------------------- */

static void take_over(struct adaptive *a, double time, real angle, real speed, real p, real r)
{
    a->samples++;
    a->time = time;
    a->angle = angle;
    a->speed = speed;
    a->p = p;
    a->r = r;
}

static void filter(struct adaptive *a, real dt, real angle, real speed, real p, real r,
                   const real *readings)
{
    const struct adaptive_settings *settings = &a->settings;
    struct adaptive_axis *first = &a->axis[0], *second = &a->axis[1];
    int parts = 1 + (int)(dt * larger(settings->final_speed, speed) / STEP_ANGLE), k;
    real h = dt / (real)parts, slope = a->slope, p0 = a->p, r0 = a->r;
    for (k = 1; k <= parts; k++) {
        real p1 = p, r1 = r;
        if (k < parts) {
            real rest = (real)(parts - k) * h, w = speed - slope * rest, square = w * w;
            real then = angle - rest * (speed - R(0.5) * slope * rest), c = cos(then), s = sin(then);
            p1 = square * c + slope * s;
            r1 = slope * c - square * s;
        }
        if (first->known)
            axis_predict(first, settings, h, p0, r0, p1, r1);
        /* The second axis is 90 degrees ahead, so angles from it are 90 degrees smaller. */
        if (settings->axes == 2 && second->known)
            axis_predict(second, settings, h, -r0, p0, -r1, p1);
        p0 = p1;
        r0 = r1;
    }
    if (first->known)
        axis_update(first, settings, readings[0], p, r);
    else
        axis_collect(first, settings, readings[0], speed);
    if (settings->axes == 2) {
        if (second->known)
            axis_update(second, settings, readings[1], -r, p);
        else
            axis_collect(second, settings, readings[1], speed);
    }
}

static enum adaptive_reason combine(struct adaptive *a, real dt)
{
    real weight = 0, re = 0, im = 0, stiff_weight = 0, stiffness = 0, damping = 0, count = 0;
    real own, size, slow;
    int i;
    for (i = 0; i < a->settings.axes; i++) {
        const struct adaptive_axis *x = &a->axis[i];
        if (!x->known)
            continue;
        own = R(1.0) / (x->covariance[2][2] + x->covariance[3][3] + R(1e-30));
        weight = weight + own;
        re = re + own * x->state[2];
        im = im + own * x->state[3];
        own = R(1.0) / (x->covariance[4][4] + R(1e-20));
        stiff_weight = stiff_weight + own;
        stiffness = stiffness + own * x->state[4];
        damping = damping + x->state[5];
        count = count + R(1.0);
    }
    a->known = (int)count == a->settings.axes;
    if (!a->known)
        return ADAPTIVE_NONE;
    a->re = re / weight;
    a->im = im / weight;
    a->deviation = sqrt(R(1.0) / weight);
    a->critical = sqrt(stiffness / stiff_weight);
    a->damping = damping / count;
    a->critical_deviation = R(0.5) * sqrt(R(1.0) / stiff_weight) / a->critical;
    size = sqrt(a->re * a->re + a->im * a->im);
    slow = dt / (dt + SLOW * a->unit);
    a->fast += (size - a->fast) * (dt / (dt + FAST * a->unit));
    a->slow += (size - a->slow) * slow;
    a->average_re += (a->re - a->average_re) * slow;
    a->average_im += (a->im - a->average_im) * slow;
    if (a->deviation < CERTAIN * size && a->critical_deviation < KNOWN_CRITICAL * a->critical &&
        a->fast > a->scale)
        a->scale = a->fast;
    return a->settings.axes == 1 ? ADAPTIVE_NONE : watch_axes(a, dt);
}

/* Process a sample; return whether it was valid. *wrong becomes the reason for an abort, if any. */
static bool take(struct adaptive *a, double time, real angle, real speed, real first, real second,
                 enum adaptive_reason *wrong)
{
    const struct adaptive_settings *settings = &a->settings;
    const real readings[2] = {first, second};
    real from_axis, c, s, square, dt, slope, p, r;
    int i;
    *wrong = ADAPTIVE_NONE;
    /* NaN and infinity fail this comparison. */
    if (!((fabs)(time) < FAR && fabs(angle) + fabs(speed) + fabs(first) + fabs(second) < LARGEST))
        return false;
    from_axis = angle - settings->axis_angle;
    c = cos(from_axis);
    s = sin(from_axis);
    square = speed * speed;
    if (a->samples == 0) {
        take_over(a, time, angle, speed, square * c, -(square * s));
        return true;
    }
    if (time - a->time <= 0.0) {
        if (time - a->time < -BACK) {
            *wrong = ADAPTIVE_TIME_BACK;
            a->speed = speed;
        }
        return false;
    }
    dt = (real)(time - a->time);
    *wrong = watch_readings(a, readings, dt, speed >= R(0.3) * settings->final_speed);
    if (!*wrong)
        *wrong = watch_angle(a, angle - a->angle, R(0.5) * (speed + a->speed) * dt);
    if (*wrong)
        return true;
    slope = (speed - a->speed) / dt;
    a->slope += (slope - a->slope) * (dt / (dt + R(0.01) * a->unit));
    slope = a->slope;
    p = square * c + slope * s;
    r = slope * c - square * s;
    if (dt > LONGEST_GAP * a->unit)
        for (i = 0; i < settings->axes; i++)
            axis_restart(&a->axis[i]);
    filter(a, dt, from_axis, speed, p, r, readings);
    take_over(a, time, angle, speed, p, r);
    *wrong = combine(a, dt);
    return true;
}

/* Relative rate of change of the net unbalance's magnitude, per unit of time. */
static real rate_of(const struct adaptive *a)
{
    return (a->fast - a->slow) / ((SLOW - FAST) * (a->slow + R(1e-30)));
}

bool adaptive_circulating(const struct adaptive *a)
{
    return a->deviation < CERTAIN * a->slow &&
           sqrt(a->average_re * a->average_re + a->average_im * a->average_im) <
               CIRCULATING * a->slow;
}

/* --- Decisions. --------------------------------------------------------------------------------- */

static bool over(const struct adaptive *a)
{
    return a->state == ADAPTIVE_DONE || a->state == ADAPTIVE_GAVE_UP || a->state == ADAPTIVE_ABORTED;
}

static bool stopped(const struct adaptive *a)
{
    return a->state == ADAPTIVE_ABORTING || a->state == ADAPTIVE_ABORTED;
}

static void enter(struct adaptive *a, enum adaptive_state state)
{
    a->state = state;
    a->in_state = 0;
    a->decisions++;
}

static void abort_for(struct adaptive *a, enum adaptive_reason reason)
{
    a->reason = reason;
    enter(a, ADAPTIVE_ABORTING);
}

/* Net unbalance relative to the scale; 1 before there is a scale. */
static real net_of(const struct adaptive *a, real size)
{
    return a->scale > R(0.0) ? size / a->scale : R(1.0);
}

/* Longest allowed stagnation, in units of time. */
static real patience_of(const struct adaptive *a)
{
    return STAGNANT + STAGNANT_PER_NET * net_of(a, a->fast);
}

/* Speed to dwell at. At the ratio r of speed to critical speed the whirl is |q| r^2 / (r^2 - 1). Its
   phase deviates from 180 degrees by atan(D r / (wn (r^2 - 1))). */
static real goal_of(const struct adaptive *a)
{
    const real final = a->settings.final_speed, critical = a->critical;
    real largest = FIRST_WHIRL, lag = LARGEST_LAG, whirl, least, distance, ratio;
    if (!a->known)
        return final;
    if (a->retries > 0) {
        largest = LATER_WHIRL;
        lag *= R(1.0) + LAG_STEP * LAGS[(a->retries - 1) % 4];
    }
    whirl = R(1.0) / (R(1.0) - smaller(net_of(a, a->fast) / largest, R(0.8)));
    least = LEAST_DISTANCE * (R(2.0) * critical / final);
    least *= R(1.0) - NEARER * smaller(a->stagnant / patience_of(a), R(1.0));
    distance = smaller(larger(a->damping / (critical * lag), least), MOST_DISTANCE);
    ratio = sqrt(larger(whirl, R(1.0) + distance)) + a->nudge;
    return smaller(ratio * critical, final);
}

/* Move the command one step towards a speed; return whether it is reached. The command leads or lags
   the spindle by a limited amount. */
static bool ramp(struct adaptive *a, real goal, real slope)
{
    real change = slope * a->settings.period, lead = LEAD * a->settings.final_speed, wanted = goal;
    if (!over(a) && a->state != ADAPTIVE_ABORTING)
        wanted = smaller(larger(smaller(larger(goal, a->speed - lead), a->speed + lead), 0),
                         a->settings.final_speed);
    a->command += smaller(larger(wanted - a->command, -change), change);
    return a->command == goal;
}

/* Whether the spindle has not approached the command for too long. */
static bool fails_to_follow(struct adaptive *a, real passed)
{
    const real final = a->settings.final_speed;
    real off = a->command - a->speed, moved = a->speed - a->stood_at;
    bool nearer = (off > R(0.0) ? moved : -moved) > R(0.02) * final;
    if (fabs(off) < R(0.05) * final || nearer) {
        a->standing = 0;
        a->stood_at = a->speed;
    } else {
        a->standing += passed;
    }
    return a->standing > NOT_FOLLOWING * a->unit;
}

static void approach(struct adaptive *a)
{
    const real final = a->settings.final_speed;
    real goal = goal_of(a);
    bool there, aimed = true;
    if (a->state == ADAPTIVE_RUN_UP) {
        bool known = a->known && a->critical_deviation < KNOWN_CRITICAL * a->critical;
        bool late = goal < a->speed - R(0.025) * final;
        aimed = known && !late && !(a->command < R(0.3) * final);
    }
    if (!aimed)
        goal = final;
    there = ramp(a, goal, a->settings.acceleration);
    if (goal == final) {
        if (there && fabs(a->speed - goal) < R(0.02) * goal)
            enter(a, ADAPTIVE_JUDGING);
    } else if ((there || fabs(a->command - goal) < R(0.005) * final) &&
               fabs(a->speed - goal) < R(0.02) * goal) {
        a->nudge = a->stagnant = 0;
        a->dwells++;
        enter(a, ADAPTIVE_DWELL);
    }
}

static void dwell(struct adaptive *a, real seconds)
{
    /* The driving force on the balls grows with the square of the critical speed. */
    real relative = R(2.0) * a->critical / a->settings.final_speed;
    real falling = FALLING * relative * relative, rate = rate_of(a), passed = seconds / a->unit, net;
    if (rate > RISING)
        a->nudge += UP * passed;
    else
        a->nudge = larger(a->nudge - DOWN * passed, R(0.0));
    if (rate > -falling)
        a->stagnant += passed;
    else
        a->stagnant = larger(a->stagnant - R(2.0) * passed, R(0.0));
    net = net_of(a, a->fast);
    ramp(a, goal_of(a), a->settings.acceleration);
    if (a->nudge >= AWAY || a->stagnant > patience_of(a) ||
        a->in_state > LONGEST_DWELL * a->unit ||
        a->elapsed > a->settings.patience + LATE * a->unit ||
        (net < SMALL && a->in_state > R(0.1) * a->unit)) {
        a->nudge = a->stagnant = 0;
        enter(a, ADAPTIVE_TO_FINAL);
    }
}

static void to_final(struct adaptive *a)
{
    const real final = a->settings.final_speed;
    real off = a->command - a->critical, slope = a->settings.acceleration;
    if (off > R(0.0))
        slope = smaller(slope, LEAVING * off * off);
    if (ramp(a, final, slope) && fabs(a->speed - final) < R(0.02) * final)
        enter(a, ADAPTIVE_JUDGING);
}

static void judge(struct adaptive *a)
{
    real settle = SETTLE * a->unit, size = R(0.5) * (a->fast + a->slow), net = net_of(a, size), rate;
    if (a->in_state <= settle)
        return;
    if (net < BALANCED || (a->retries > 0 && net < ACCEPTED && net > GAIN * a->before)) {
        if (a->in_state > R(2.0) * settle)
            enter(a, ADAPTIVE_DONE);
        return;
    }
    if (!a->known || a->deviation > UNSURE * size) {
        if (a->in_state > WAIT * a->unit)
            enter(a, ADAPTIVE_GAVE_UP);
        return;
    }
    rate = rate_of(a);
    if (rate < R(-0.01) && log(net / BALANCED) < -(rate * WAIT))
        return;
    if (a->retries >= a->settings.most_retries || a->elapsed > a->settings.patience) {
        enter(a, ADAPTIVE_GAVE_UP);
        return;
    }
    a->retries++;
    a->before = net;
    enter(a, ADAPTIVE_RETRY);
}

/* --- Public functions. -------------------------------------------------------------------------- */

struct adaptive_settings adaptive_defaults(void)
{
    struct adaptive_settings settings;
    memset(&settings, 0, sizeof settings);
    settings.axes = 1;
    settings.most_retries = 8;
    settings.patience = R(14.5);
    settings.silence = R(0.5);
    settings.limit = (real)INFINITY;
    return settings;
}

void adaptive_init(struct adaptive *a, const struct adaptive_settings *settings)
{
    int i;
    memset(a, 0, sizeof *a);
    a->settings = *settings;
    a->unit = UNIT / settings->final_speed;
    a->agreement = R(1.0);
    for (i = 0; i < settings->axes; i++)
        axis_init(&a->axis[i], settings);
}

void adaptive_sample(struct adaptive *a, double time, adaptive_real angle, adaptive_real speed,
                     adaptive_real first, adaptive_real second)
{
    enum adaptive_reason wrong;
    if (take(a, time, angle, speed, first, second, &wrong))
        a->since_sample = 0;
    if (wrong && !stopped(a) && (wrong == ADAPTIVE_TIME_BACK || !over(a)))
        abort_for(a, wrong);
}

adaptive_real adaptive_command(struct adaptive *a, double time)
{
    const struct adaptive_settings *settings = &a->settings;
    real passed = (real)(time - a->clock);
    if (!(R(0.0) < passed && passed <= R(20.0) * settings->period) || !a->called)
        passed = settings->period;
    a->called = true;
    a->clock = time;
    a->in_state += passed;
    a->since_sample += passed;
    if (a->state == ADAPTIVE_WAITING) {
        if (a->samples > 1) {
            a->command = smaller(larger(a->speed, R(0.0)), settings->final_speed);
            a->elapsed = 0;
            enter(a, ADAPTIVE_RUN_UP);
        } else if (a->since_sample > FIRST_SAMPLES) {
            abort_for(a, ADAPTIVE_SILENT);
        }
        return a->command;
    }
    a->elapsed += passed;
    if (a->state == ADAPTIVE_ABORTING) {
        /* A drive that was reset stands still: a ramp down would first start it. */
        if (a->reason == ADAPTIVE_TIME_BACK && a->speed < R(0.01) * settings->final_speed)
            a->command = 0;
        if (ramp(a, R(0.0), settings->acceleration))
            enter(a, ADAPTIVE_ABORTED);
        return a->command;
    }
    if (a->state == ADAPTIVE_ABORTED)
        return a->command;
    if (a->since_sample > settings->silence) {
        abort_for(a, ADAPTIVE_SILENT);
        return a->command;
    }
    if (!over(a) && fails_to_follow(a, passed)) {
        abort_for(a, ADAPTIVE_NOT_FOLLOWING);
        return a->command;
    }
    if (a->state == ADAPTIVE_RUN_UP || a->state == ADAPTIVE_RETRY)
        approach(a);
    else if (a->state == ADAPTIVE_DWELL)
        dwell(a, passed);
    else if (a->state == ADAPTIVE_TO_FINAL)
        to_final(a);
    else if (a->state == ADAPTIVE_JUDGING)
        judge(a);
    return a->command;
}

void adaptive_abort(struct adaptive *a, double time)
{
    if (stopped(a))
        return;
    a->clock = time;
    abort_for(a, ADAPTIVE_REQUESTED);
}

const char *adaptive_state_text(enum adaptive_state state)
{
    static const char *const TEXTS[] = {"waiting", "run up", "dwell", "to final", "judging",
                                        "retry", "done", "gave up", "aborting", "aborted"};
    return TEXTS[state];
}

const char *adaptive_reason_text(enum adaptive_reason reason)
{
    static const char *const TEXTS[] = {
        "",
        "requested",
        "no valid sample for too long: sensor or spindle angle dropped out",
        "the sensor's time went back: the drive was reset",
        "a reading beyond the limit",
        "the sensor repeats one reading: it is stuck or saturated",
        "the sensor's offset drifts away",
        ("the two axes contradict each other: one has the wrong sign or is turned, or the spindle "
         "turns the other way"),
        "the spindle's angle contradicts its speed: wrong sign, or slipped",
        "the spindle does not follow: caught at the critical speed, or no torque",
    };
    return TEXTS[reason];
}

/* Saving and restoring visit the values in the same order, because they share the walk_* functions. */
struct walk {
    double *numbers;
    const double *from;
    int count;
};

static void number(struct walk *w, real *x)
{
    if (w->from)
        *x = (real)w->from[w->count];
    else
        w->numbers[w->count] = (double)*x;
    w->count++;
}

static void whole(struct walk *w, long *x)
{
    real y = (real)*x;
    number(w, &y);
    *x = (long)y;
}

static void whole_int(struct walk *w, int *x)
{
    long y = *x;
    whole(w, &y);
    *x = (int)y;
}

static void flag(struct walk *w, bool *x)
{
    long y = *x;
    whole(w, &y);
    *x = y != 0;
}

static void instant(struct walk *w, double *x)
{
    if (w->from)
        *x = w->from[w->count];
    else
        w->numbers[w->count] = *x;
    w->count++;
}

static void walk_axis(struct walk *w, struct adaptive_axis *x)
{
    real *const own[] = {&x->variance, &x->size, &x->first, &x->sum,  &x->squares,
                         &x->rough,    &x->last, &x->before, &x->count, &x->wild};
    int i, j;
    for (i = 0; i < ADAPTIVE_SIZE; i++)
        number(w, &x->state[i]);
    for (i = 0; i < ADAPTIVE_SIZE; i++)
        for (j = 0; j < ADAPTIVE_SIZE; j++)
            number(w, &x->covariance[i][j]);
    flag(w, &x->known);
    for (i = 0; i < (int)(sizeof own / sizeof *own); i++)
        number(w, own[i]);
}

static void walk(struct walk *w, struct adaptive *a)
{
    real *const doing[] = {&a->since_sample, &a->standing, &a->stood_at, &a->nudge, &a->stagnant,
                           &a->before};
    real *const seen[] = {&a->angle, &a->speed,    &a->slope,      &a->p,          &a->r,
                          &a->re,    &a->im,       &a->deviation,  &a->fast,       &a->slow,
                          &a->average_re,          &a->average_im, &a->scale,      &a->critical,
                          &a->critical_deviation,  &a->damping};
    real *const watch[] = {&a->stuck[0], &a->stuck[1], &a->agreement, &a->slip, &a->doubt};
    int state = (int)a->state, reason = (int)a->reason, i;
    whole_int(w, &state);
    whole_int(w, &reason);
    a->state = (enum adaptive_state)state;
    a->reason = (enum adaptive_reason)reason;
    whole_int(w, &a->decisions);
    number(w, &a->command);
    instant(w, &a->clock);
    number(w, &a->elapsed);
    number(w, &a->in_state);
    flag(w, &a->called);
    for (i = 0; i < (int)(sizeof doing / sizeof *doing); i++)
        number(w, doing[i]);
    whole_int(w, &a->dwells);
    whole_int(w, &a->retries);
    whole(w, &a->samples);
    instant(w, &a->time);
    for (i = 0; i < (int)(sizeof seen / sizeof *seen); i++)
        number(w, seen[i]);
    flag(w, &a->known);
    number(w, &a->last[0]);
    number(w, &a->last[1]);
    number(w, &a->peak[0]);
    number(w, &a->peak[1]);
    whole(w, &a->run[0]);
    whole(w, &a->run[1]);
    for (i = 0; i < 2; i++)
        number(w, &a->mean[i]);
    for (i = 0; i < 2; i++)
        number(w, &a->origin[i]);
    for (i = 0; i < 2; i++)
        number(w, &a->swing[i]);
    for (i = 0; i < (int)(sizeof watch / sizeof *watch); i++)
        number(w, watch[i]);
    for (i = 0; i < a->settings.axes; i++)
        walk_axis(w, &a->axis[i]);
}

int adaptive_numbers(const struct adaptive *a, double *numbers)
{
    struct adaptive copy = *a;
    struct walk w = {numbers, NULL, 0};
    walk(&w, &copy);
    return w.count;
}

void adaptive_restore(struct adaptive *a, const double *numbers)
{
    struct walk w = {NULL, numbers, 0};
    walk(&w, a);
}
