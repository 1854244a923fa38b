/* The thesis' drive in C with steps of a fixed length, to compare the package's kernel with. BALLS
 * and the tableau (tableau.h, written by ../c_kernels.py) are known to the compiler.
 * Build: gcc -O3 -march=native -DBALLS=2 -shared -fPIC thesis.c -lm
 */
#include "equations.h"
#include "tableau.h" /* STAGES, A[STAGES][STAGES], B[STAGES], C[STAGES] */

/* Takes steps, and records state and acceleration after each; rows has STATES + 2 columns. */
void advance(const struct drive *d, double begin, double h, long steps, double *y, double *rows) {
  double k[STAGES][STATES], trial[STATES], A[2];
  derivatives(d, begin, y, k[0], A);
  for (long step = 0; step < steps; step++) {
    const double time = begin + step * h;
    for (int stage = 1; stage < STAGES; stage++) {
      for (int j = 0; j < STATES; j++) trial[j] = 0.0;
      for (int earlier = 0; earlier < stage; earlier++)
        for (int j = 0; j < STATES; j++) trial[j] += A_[stage][earlier] * k[earlier][j];
      for (int j = 0; j < STATES; j++) trial[j] = y[j] + h * trial[j];
      derivatives(d, time + C_[stage] * h, trial, k[stage], A);
    }
    for (int j = 0; j < STATES; j++) trial[j] = 0.0;
    for (int stage = 0; stage < STAGES; stage++)
      for (int j = 0; j < STATES; j++) trial[j] += B_[stage] * k[stage][j];
    for (int j = 0; j < STATES; j++) y[j] += h * trial[j];
    derivatives(d, begin + (step + 1) * h, y, k[0], A);
    double *row = rows + step * (STATES + 2);
    for (int j = 0; j < STATES; j++) row[j] = y[j];
    row[STATES] = A[0];
    row[STATES + 1] = A[1];
  }
}
