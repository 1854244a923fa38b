/* Test of a firmware in CI: its decisions in C, with a simulated drive in C. No Python, no ROS.
 *
 * The start-up of ../firmware_prototype starts the drive with several start angles of the balls, and
 * drives that differ from the one it was tuned for. Exit code 0: all were balanced.
 */
#include <math.h>
#include <stdio.h>

#include "drive.h"
#include "start_up.h"

static const double TICK = 0.005;   /* period of the firmware [s] */
static const double LONGEST = 30.0; /* longest time to the final speed [s] */
static const double SETTLING = 6.0; /* time at the final speed [s] */
static const double LIMIT = 5e-6;   /* largest allowed final whirl [m]; 1.3e-4 without balls */

struct trial {
    const char *what;
    double angles[2];            /* start angles of the balls [rad] */
    double unbalance, stiffness; /* factors on the scene's values */
};

static const struct trial trials[] = {
    {"balls apart", {0.0, 2.0}, 1.0, 1.0},
    {"balls at the unbalance", {0.1, -0.3}, 1.0, 1.0},
    {"balls opposite the unbalance", {2.5, -2.8}, 1.0, 1.0},
    {"a disc that is better balanced", {0.0, 2.0}, 0.7, 1.0},
    {"softer mounts", {0.0, 2.0}, 1.0, 0.9},
};

static void quietly(const char *line)
{
    (void)line;
}

/* Return the final whirl [m]; INFINITY if firmware or drive failed. */
static double whirl_after(const struct trial *trial)
{
    const long steps = lround(TICK / DRIVE_STEP);
    struct start_up firmware;
    double judged = INFINITY; /* time at which the firmware judged the vibration [s] */
    struct drive d;
    drive_init(&d);
    for (int i = 0; i < DRIVE_BALLS; i++)
        d.p.start_ball_angle[i] = trial->angles[i];
    d.p.unbalance *= trial->unbalance;
    d.p.suspension_stiffness *= trial->stiffness;
    drive_reset(&d);
    start_up_init(&firmware, &default_settings, quietly);
    while (drive_time(&d) < fmin(judged + SETTLING, LONGEST + SETTLING)) {
        for (long k = 0; k < steps; k++) { /* sensors are sampled at each step */
            if (drive_step(&d, 1) != DRIVE_OK)
                return INFINITY;
            start_up_spindle(&firmware, drive_time(&d), d.out.angle, d.out.speed);
            start_up_vibration(&firmware, drive_time(&d), d.out.ax, d.out.ay);
        }
        if (firmware.failed || drive_command(&d, start_up_tick(&firmware, TICK)) != DRIVE_OK)
            return INFINITY;
        if (firmware.judged && isinf(judged))
            judged = drive_time(&d);
    }
    return firmware.judged ? drive_whirl(&d) : INFINITY;
}

int main(void)
{
    int failed = 0;
    for (size_t k = 0; k < sizeof trials / sizeof trials[0]; k++) {
        const double whirl = whirl_after(&trials[k]);
        const int good = whirl <= LIMIT;
        printf("%s: %s, whirl %.3g m\n", good ? "passed" : "FAILED", trials[k].what, whirl);
        failed += !good;
    }
    return failed > 0;
}
