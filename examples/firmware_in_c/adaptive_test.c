/* Test of the adaptive start-up in C with simulated drives in C. Unbalance, stiffness, damping, drag
 * and start angles of the balls are random and unknown to the start-up; the accelerometer has noise.
 * Exit code 0: at most MISSED of TRIALS drives were not balanced.
 */
#include <math.h>
#include <stdint.h>
#include <stdio.h>

#include "adaptive.h"
#include "drive.h"

enum { TRIALS = 100, MISSED = 10 };

static const double TICK = 0.004;   /* period of the controller [s] */
static const double LONGEST = 60.0; /* longest start-up [s] */
static const double SETTLING = 12.0; /* time after it [s]: the free whirl may decay at 0.5 1/s only */
static const double LIMIT = 0.3;    /* largest allowed whirl, relative to that without balls */
static const double NOISE = 0.05;   /* standard deviation of a reading [m/s^2] */

/* Return a random number in [0, 1) by a linear congruential generator, equal on all machines. */
static double drawn(uint64_t *seed)
{
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(*seed >> 11) / 9007199254740992.0;
}

static double within(uint64_t *seed, double least, double most)
{
    return least + (most - least) * drawn(seed);
}

/* Return approximately normal noise, as the sum of 12 uniform numbers [m/s^2]. */
static double noise(uint64_t *seed)
{
    double sum = -6.0;
    for (int k = 0; k < 12; k++)
        sum += drawn(seed);
    return NOISE * sum;
}

/* Return the whirl without balls at a speed far above the critical speed [m]. */
static double whirl_without_balls(const struct drive *d, double speed)
{
    const double stiffness = d->p.suspension_stiffness / d->p.total_mass;
    return d->p.unbalance / d->p.total_mass * speed * speed / (speed * speed - stiffness);
}

/* Return the final whirl relative to that without balls; INFINITY if controller or drive failed. */
static double final_share(uint64_t *seed)
{
    const long steps = lround(TICK / DRIVE_STEP);
    struct adaptive_settings settings = adaptive_defaults();
    struct adaptive firmware;
    double ended = INFINITY; /* time at which the start-up ended [s] */
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
    while (drive_time(&d) < fmin(ended + SETTLING, LONGEST + SETTLING)) {
        for (long k = 0; k < steps; k++) { /* sensors are sampled at each step */
            if (drive_step(&d, 1) != DRIVE_OK)
                return INFINITY;
            const double x = d.out.ax + noise(seed), y = d.out.ay + noise(seed);
            adaptive_sample(&firmware, drive_time(&d), d.out.angle, d.out.speed, x, y);
        }
        if (drive_command(&d, adaptive_command(&firmware, drive_time(&d))) != DRIVE_OK)
            return INFINITY;
        if (firmware.state >= ADAPTIVE_DONE && isinf(ended))
            ended = drive_time(&d);
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
        const double share = final_share(&seed);
        if (!(share <= LIMIT)) {
            printf("drive %d: the final whirl is %.2g of that without balls\n", k, share);
            missed++;
        }
    }
    printf("%d of %d drives balanced to %g of their whirl without balls\n", TRIALS - missed, TRIALS,
           LIMIT);
    return missed > MISSED;
}
