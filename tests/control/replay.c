/* Run the start-up over recorded samples, then without samples, and print state and command of each
   period.

   samples.h defines SAMPLES (a table of time, angle, speed, reading) and PER_PERIOD. */
#include <stdio.h>

#include "adaptive.h"
#include "samples.h"

static struct adaptive start_up;

static void command(double time)
{
    double speed = adaptive_command(&start_up, time);
    printf("%d %.12g\n", (int)start_up.state, speed);
}

int main(void)
{
    struct adaptive_settings settings = adaptive_defaults();
    int count = (int)(sizeof SAMPLES / sizeof *SAMPLES), k;
    settings.final_speed = 200;
    settings.acceleration = 200;
    settings.period = (adaptive_real)0.005;
    settings.axis_angle = (adaptive_real)0.3;
    settings.noise = (adaptive_real)1.3e-6;
    adaptive_init(&start_up, &settings);
    for (k = 0; k < count; k++) {
        const double *s = SAMPLES[k];
        adaptive_sample(&start_up, s[0], (adaptive_real)s[1], (adaptive_real)s[2],
                        (adaptive_real)s[3], 0);
        if ((k + 1) % PER_PERIOD == 0)
            command(s[0]);
    }
    for (k = 1; start_up.state != ADAPTIVE_ABORTED; k++)
        command(SAMPLES[count - 1][0] + 0.005 * k);
    return 0;
}
