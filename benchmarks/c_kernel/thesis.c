/* The thesis' drive in C, as one would write it by hand for this one scene: suspension, drag,
 * spindle acceleration and spin, prescribed speed, no friction (ab_sim/dynamics/planar.py has the
 * equations). BALLS and the tableau (tableau.h, written by ../c_kernels.py) are known to the
 * compiler. Build: gcc -O3 -march=native -DBALLS=2 -shared -fPIC thesis.c -lm
 */
#define _GNU_SOURCE
#include <math.h>

#include "tableau.h" /* STAGES, A[STAGES][STAGES], B[STAGES], C[STAGES] */

#define STATES (4 + 2 * BALLS)

struct drive {
  double total_mass, unbalance, race_radius, stiffness, damping, drag, start_speed, slope;
  double mass, radius; /* of a ball */
};

static inline void derivatives(const struct drive *d, double time, const double *y, double *slope,
                               double *A) {
  const double R = d->race_radius, m = d->mass, al = d->slope;
  const double w = d->start_speed + d->slope * time;
  const double mu = 1.0 / (1.4 * m), curvature = 1.0 / R, lever = m * R - 0.4 * m * d->radius;
  double f1 = -d->damping * y[2] - d->stiffness * y[0] + d->unbalance * w * w;
  double f2 = -d->damping * y[3] - d->stiffness * y[1] - d->unbalance * al;
  double d11 = d->total_mass, d12 = 0.0, d22 = d->total_mass;
  double g0[BALLS + 1], g1[BALLS + 1], g2[BALLS + 1];
  for (int i = 0; i < BALLS; i++) {
    const double rate = y[4 + BALLS + i];
    double s, c;
    sincos(y[4 + i], &s, &c);
    const double load = m * R * (w + rate) * (w + rate);
    g0[i] = (-d->drag * R * rate - lever * al) * mu;
    g1[i] = m * s * mu;
    g2[i] = -m * c * mu;
    f1 += load * c + m * R * al * s + m * s * g0[i];
    f2 += load * s - m * R * al * c - m * c * g0[i];
    d11 -= m * s * g1[i];
    d12 -= m * s * g2[i];
    d22 += m * c * g2[i];
  }
  const double determinant = 1.0 / (d11 * d22 - d12 * d12);
  A[0] = (f1 * d22 - f2 * d12) * determinant;
  A[1] = (f2 * d11 - f1 * d12) * determinant;
  slope[0] = y[2] + w * y[1];
  slope[1] = y[3] - w * y[0];
  slope[2] = A[0] + w * y[3];
  slope[3] = A[1] - w * y[2];
  for (int i = 0; i < BALLS; i++) {
    slope[4 + i] = y[4 + BALLS + i];
    slope[4 + BALLS + i] = (g0[i] + g1[i] * A[0] + g2[i] * A[1]) * curvature;
  }
}

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
