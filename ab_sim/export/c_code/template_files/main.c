/* @MADE_BY@
 *
 * Example: commands a speed, and prints a table of the drive's motion, with a line about every
 * 10 ms. Usage: example [SPEED in rad/s] [SECONDS]; without a speed it follows the scene's profile.
 */
#include <stdio.h>
#include <stdlib.h>

#include "drive.h"

int main(int count, char **arguments)
{
    double values[2] = {0.0, @SECONDS@}; /* speed, seconds */
    for (int i = 1; i < count; i++) {
        char *end = arguments[i];
        if (i < 3)
            values[i - 1] = strtod(arguments[i], &end);
        if (end == arguments[i] || *end != '\0' || !(values[1] >= 0.0)) {
            fprintf(stderr, "usage: %s [SPEED in rad/s] [SECONDS]\n", arguments[0]);
            return 2;
        }
    }
    const double seconds = values[1];
    const long every = @EVERY@;
    struct drive d;
    drive_init(&d);
    if (count < 2)
        drive_follow_profile(&d);
    else if (drive_command(&d, values[0]) != DRIVE_OK) {
        fprintf(stderr, "%s rad/s: must be within +-%g rad/s\n", arguments[1], DRIVE_MAX_SPEED);
        return 2;
    }
    printf("t [s],speed [rad/s],whirl [m],ax [m/s^2],ay [m/s^2]\n");
    while (drive_time(&d) < seconds) {
        if (drive_step(&d, every) != DRIVE_OK) {
            fprintf(stderr, "the drive went beyond all bounds after %g s\n", drive_time(&d));
            return 1;
        }
        printf("%.4f,%.4f,%.6g,%.6g,%.6g\n", drive_time(&d), d.out.speed, drive_whirl(&d),
               d.out.ax, d.out.ay);
    }
    return 0;
}
