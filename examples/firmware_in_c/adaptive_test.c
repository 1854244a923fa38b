/* The adaptive start-up in C against drives in C that it is told nothing of: unbalance, stiffness,
 * damping, drag and the balls' places are drawn at random, the accelerometer has noise. Exit code 0:
 * at most MISSED of TRIALS were not balanced.
 */
#include <math.h>
#include <stdint.h>
#include <stdio.h>

#include "adaptive.h"
#include "drive.h"

enum { TRIALS = 100, MISSED = 10 };

static const double TICK = 0.004;   /* s, the controller's period */
static const double LONGEST = 60.0; /* s, until it is through */
static const double SETTLING = 12.0; /* s, after that: a free whirl dies at 0.5 / s in some */
static const double LIMIT = 0.3;    /* of the whirl without balls, that may be left */
static const double NOISE = 0.05;   /* m/s^2, of a reading */

/* A number within 0 .. 1: a linear congruential generator, the same on every machine. */
static double drawn(uint64_t *seed)
{
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(*seed >> 11) / 9007199254740992.0;
}

static double within(uint64_t *seed, double least, double most)
{
    return least + (most - least) * drawn(seed);
}

/* Noise, nearly normal. */
static double noise(uint64_t *seed)
{
    double sum = -6.0;
    for (int k = 0; k < 12; k++)
        sum += drawn(seed);
    return NOISE * sum;
}

/* The whirl without balls at a speed, far above the critical one [m]. */
static double whirl_without_balls(const struct drive *d, double speed)
{
    const double stiffness = d->p.suspension_stiffness / d->p.total_mass;
    return d->p.unbalance / d->p.total_mass * speed * speed / (speed * speed - stiffness);
}

/* The whirl that is left, of that without balls; INFINITY if controller or drive gave up. */
static double share_left(uint64_t *seed)
{
    const long steps = lround(TICK / DRIVE_STEP);
    struct adaptive_settings settings = adaptive_defaults();
    struct adaptive firmware;
    double through = INFINITY; /* s, when it was */
    struct drive d;
    drive_init(&d);
    for (int i = 0; i < DRIVE_BALLS; i++)
        d.p.start_ball_angle[i] = within(seed, -3.14, 3.14);
    d.p.unbalance *= within(seed, 0.5, 1.0);
    d.p.suspension_stiffness *= within(seed, 0.8, 1.2);
    d.p.suspension_damping *= within(seed, 0.5, 1.5);
    d.p.viscous_drag_coefficient *= pow(10.0, within(seed, -0.5, 0.5));
    drive_reset(&d);
    settings.final_speed = 200.0;
    settings.acceleration = 200.0;
    settings.period = TICK;
    settings.quantity = ADAPTIVE_ACCELERATION;
    settings.axes = 2;
    settings.noise = NOISE;
    adaptive_init(&firmware, &settings);
    while (drive_time(&d) < fmin(through + SETTLING, LONGEST + SETTLING)) {
        for (long k = 0; k < steps; k++) { /* sensors are sampled at each step */
            if (drive_step(&d, 1) != DRIVE_OK)
                return INFINITY;
            const double x = d.out.ax + noise(seed), y = d.out.ay + noise(seed);
            adaptive_sample(&firmware, drive_time(&d), d.out.angle, d.out.speed, x, y);
        }
        if (drive_command(&d, adaptive_command(&firmware, drive_time(&d))) != DRIVE_OK)
            return INFINITY;
        if (firmware.state >= ADAPTIVE_DONE && isinf(through))
            through = drive_time(&d);
    }
    if (firmware.state != ADAPTIVE_DONE && firmware.state != ADAPTIVE_GAVE_UP)
        return INFINITY;
    return drive_whirl(&d) / whirl_without_balls(&d, settings.final_speed);
}

int main(void)
{
    uint64_t seed = 1;
    int missed = 0;
    for (int k = 0; k < TRIALS; k++) {
        const double left = share_left(&seed);
        if (!(left <= LIMIT)) {
            printf("drive %d: %.2g of the whirl without balls is left\n", k, left);
            missed++;
        }
    }
    printf("%d of %d drives balanced to %g of their whirl without balls\n", TRIALS - missed, TRIALS,
           LIMIT);
    return missed > MISSED;
}
