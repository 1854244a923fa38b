/* @MADE_BY@
 *
 * Check that this compiler, on this machine, gives the same bits as ab_sim. States after some steps
 * are compared with those of ab_sim. Exit code 0: all bits are equal. 1: they differ; the largest
 * difference is printed.
 */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "drive.h"

struct expected {
    long steps; /* number of steps since the previous row */
    double command; /* rad/s, given before these steps; NAN: none, the profile is followed */
    double y[DRIVE_STATES];
};

static const struct expected expected[] = {
@EXPECTED@};

int main(void)
{
    struct drive d;
    double most = 0.0;
    int same = 1;
    drive_init(&d);
    drive_follow_profile(&d);
    for (size_t k = 0; k < sizeof expected / sizeof expected[0]; k++) {
        const struct expected *e = &expected[k];
        if (!isnan(e->command) && drive_command(&d, e->command) != DRIVE_OK)
            return 1;
        if (drive_step(&d, e->steps) != DRIVE_OK)
            return 1;
        same = same && memcmp(d.y, e->y, sizeof d.y) == 0;
        for (int j = 0; j < DRIVE_STATES; j++)
            most = fmax(most, fabs(d.y[j] - e->y[j]));
    }
    if (same)
        printf("the same bits as ab_sim, at t = %g s\n", drive_time(&d));
    else
        printf("not the same bits as ab_sim: states differ by up to %g\n", most);
    return same ? 0 : 1;
}
