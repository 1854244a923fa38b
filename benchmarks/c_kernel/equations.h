/* Equations of the thesis' drive in C, as one would write them by hand for this one scene:
 * suspension, drag, spindle acceleration and spin, prescribed speed, no friction
 * (ab_sim/model/equations/planar.py has the equations). The compiler knows BALLS.
 */
#define _GNU_SOURCE
#include <math.h>

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
