#include "start_up.h"

#include <math.h>
#include <stdio.h>

static const double TURN = 6.283185307179586;

const struct settings default_settings = {
    .ramp = 200.0,
    .hold_speed = 110.0,
    .final_speed = 200.0,
    .turns = 10.0,
    .quiet = 0.1,
    .permissible = 1.2,
    .longest_hold = 8.0,
    .settle = 2.0,
    .limit = 150.0,
    .silence = 2.0,
    .catching_up = 5.0,
};

static const char *const NAMES[] = {
    "waiting", "run up", "hold", "to final", "at speed", "run down", "off",
};

static void restart_window(struct start_up *s)
{
    s->sum_x = s->sum_y = 0.0;
    s->count = 0;
}

static void enter(struct start_up *s, enum state state, const char *why)
{
    char line[200];
    s->state = state;
    s->in_state = 0.0;
    restart_window(s);
    snprintf(line, sizeof line, "%s: %s", NAMES[state], why);
    s->say(line);
}

/* Run down because of a failure; if already running down, record the failure only. */
static void fail(struct start_up *s, const char *why)
{
    char text[160];
    if (s->state == OFF || (s->state == RUN_DOWN && s->failed))
        return;
    s->failed = true;
    snprintf(text, sizeof text, "failure: %s", why);
    enter(s, RUN_DOWN, text);
}

/* Fail because the drive was reset. It stands still; a ramp down would first start it. */
static void time_went_back(struct start_up *s)
{
    s->vibration_time = s->angle_time = -INFINITY;
    restart_window(s);
    fail(s, "the drive's time went back");
    s->command = 0.0;
}

static void leave_hold(struct start_up *s, const char *why)
{
    char text[160];
    snprintf(text, sizeof text, "after %.2f s, vibration %.3g of at most %.3g m/s^2, %s",
             s->in_state, s->amplitude, s->largest, why);
    enter(s, TO_FINAL, text);
}

/* Decide on a new amplitude of the vibration that turns with the spindle [m/s^2]. */
static void window(struct start_up *s, double amplitude)
{
    char line[160];
    s->amplitude = amplitude;
    if (s->state == HOLD) {
        s->largest = fmax(s->largest, amplitude);
        if (amplitude <= fmax(s->settings.quiet * s->largest, s->settings.permissible))
            leave_hold(s, "quiet");
    } else if (s->state == AT_SPEED && !s->judged && s->in_state >= s->settings.settle) {
        s->judged = true;
        snprintf(line, sizeof line, "balanced to %.3g m/s^2, a whirl of %.3g um", amplitude,
                 1e6 * amplitude / (s->speed * s->speed));
        s->say(line);
    }
}

/* Move the command one step towards a speed; return whether the spindle has reached it. */
static bool reached(struct start_up *s, double goal, double passed)
{
    char text[100];
    double change = s->settings.ramp * passed;
    s->command += fmin(fmax(goal - s->command, -change), change);
    if (s->command != goal) {
        s->in_state = 0.0;
        return false;
    }
    if (fabs(s->speed - goal) <= 0.01 * s->settings.hold_speed)
        return true;
    if (s->in_state > s->settings.catching_up) {
        if (s->state == RUN_DOWN) {
            snprintf(text, sizeof text, "but the last reported speed is %.3g rad/s",
                     s->speed);
            enter(s, OFF, text);
        } else {
            snprintf(text, sizeof text, "the spindle stays at %.4g rad/s, commanded %g", s->speed,
                     goal);
            fail(s, text);
        }
    }
    return false;
}

void start_up_init(struct start_up *s, const struct settings *settings, void (*say)(const char *))
{
    *s = (struct start_up){
        .settings = *settings,
        .say = say,
        .state = WAITING,
        .amplitude = NAN,
        .angle_time = -INFINITY,
        .vibration_time = -INFINITY,
        .spindle_silent = INFINITY,
        .vibration_silent = INFINITY,
    };
}

void start_up_spindle(struct start_up *s, double time, double angle, double speed)
{
    if (!isfinite(angle) || !isfinite(speed))
        return; /* an invalid sample counts as silence */
    if (time < s->angle_time)
        time_went_back(s);
    s->angle_time = time;
    s->angle = angle;
    s->speed = speed;
    s->spindle_silent = 0.0;
}

void start_up_vibration(struct start_up *s, double time, double x, double y)
{
    char text[60];
    double angle;
    if (!isfinite(x) || !isfinite(y))
        return;
    if (time < s->vibration_time)
        time_went_back(s);
    s->vibration_time = time;
    s->vibration_silent = 0.0;
    if (hypot(x, y) > s->settings.limit) {
        snprintf(text, sizeof text, "vibration of %.3g m/s^2", hypot(x, y));
        fail(s, text);
    }
    if (!isfinite(s->angle_time))
        return;
    /* Spindle and vibration may be sampled at different times: extrapolate the angle. */
    angle = s->angle + s->speed * (time - s->angle_time);
    if (s->count == 0)
        s->begin = angle;
    s->sum_x += x * cos(angle) + y * sin(angle);
    s->sum_y += y * cos(angle) - x * sin(angle);
    s->count++;
    if (fabs(angle - s->begin) >= s->settings.turns * TURN) {
        /* With fewer samples per turn, parts of the vibration that do not turn would alias. */
        if (s->count >= 4 * s->settings.turns)
            window(s, hypot(s->sum_x, s->sum_y) / s->count);
        restart_window(s);
    }
}

double start_up_tick(struct start_up *s, double passed)
{
    char text[80];
    const struct settings *settings = &s->settings;
    bool valid;
    s->in_state += passed;
    s->spindle_silent += passed;
    s->vibration_silent += passed;
    valid = fmax(s->spindle_silent, s->vibration_silent) <= settings->silence;
    if (s->state == WAITING) {
        if (valid) {
            /* The disc may be turning already, if this firmware was restarted. */
            s->command = s->speed;
            snprintf(text, sizeof text, "to %g rad/s", settings->hold_speed);
            enter(s, RUN_UP, text);
        }
        return s->command;
    }
    if (!valid) {
        snprintf(text, sizeof text, "no valid sample for %g s", settings->silence);
        fail(s, text);
    }
    if (s->state == RUN_UP && reached(s, settings->hold_speed, passed)) {
        s->largest = 0.0;
        snprintf(text, sizeof text, "at %g rad/s, until the balls are in place",
                 settings->hold_speed);
        enter(s, HOLD, text);
    } else if (s->state == HOLD && s->in_state >= settings->longest_hold) {
        leave_hold(s, "not quiet, but the longest hold is over");
    } else if (s->state == TO_FINAL && reached(s, settings->final_speed, passed)) {
        snprintf(text, sizeof text, "%g rad/s", settings->final_speed);
        enter(s, AT_SPEED, text);
    } else if (s->state == RUN_DOWN && reached(s, 0.0, passed)) {
        enter(s, OFF, "standing still");
    }
    return s->command;
}

void start_up_stop(struct start_up *s)
{
    if (s->state == WAITING)
        enter(s, OFF, "never started");
    else if (s->state != RUN_DOWN && s->state != OFF)
        enter(s, RUN_DOWN, "stop requested");
}
