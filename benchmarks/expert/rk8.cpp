// The Runge-Kutta method of order 8 of tableau.h, for the drive of drive.h, with steps of fixed
// length: so many from each output to the next.
#include <cstring>

#include "drive.h"
#include "tableau.h"

namespace {

template <class Kind>
struct Slope {
  typename Kind::Deck u, P;
  typename Kind::Ball angle, l;
};

template <class Kind>
struct Motion {
  typename Kind::Deck v;
  typename Kind::Ball rate;
};

template <class Kind>
INLINE Slope<Kind> slope_of(const Constants<Kind> &k, const State<Kind> &y, double speed,
                            double slope, Motion<Kind> &motion) {
  typedef typename Kind::Number Number;
  typedef typename Kind::Deck Deck;
  typedef typename Kind::Ball Ball;
  const Number w(speed), al(slope);
  const auto t = tangents(Kind(), y.angle);
  const Inverse<Kind> inverse(k, t);
  const Deck momentum = y.P - Kind::along_y(k.eps * w);
  const Deck v = inverse(momentum - k.beta * Kind::over_balls(y.l * t));
  const Ball p = y.l - Kind::dot(Kind::product(v, t)), rate = p - w;
  motion.v = v, motion.rate = rate;
  const auto turned = Kind::turned(p * t);  // -q
  Slope<Kind> out;
  out.u = v - w * Kind::turned(y.u);
  out.P = Deck(0.0) - k.damping * v - k.stiffness * y.u - w * Kind::turned(y.P);
  out.angle = rate;
  out.l = k.spin * al + (Kind::dot(Kind::product(v, turned)) - k.drag * rate);
  return out;
}

template <class Kind>
INLINE State<Kind> moved(const State<Kind> &y, const Slope<Kind> *slopes, const double *weights,
                         int many, double h) {
  typedef typename Kind::Number Number;
  Slope<Kind> sum;
  bool first = true;
#pragma GCC unroll 16
  for (int i = 0; i < many; i++) {
    if (weights[i] == 0.0) continue;
    const Number weight(weights[i]);
    if (first) {
      sum.u = weight * slopes[i].u, sum.P = weight * slopes[i].P;
      sum.angle = weight * slopes[i].angle, sum.l = weight * slopes[i].l;
    } else {
      sum.u = sum.u + weight * slopes[i].u, sum.P = sum.P + weight * slopes[i].P;
      sum.angle = sum.angle + weight * slopes[i].angle, sum.l = sum.l + weight * slopes[i].l;
    }
    first = false;
  }
  const Number length(h);
  State<Kind> out;
  out.u = y.u + length * sum.u, out.P = y.P + length * sum.P;
  out.angle = y.angle + length * sum.angle, out.l = y.l + length * sum.l;
  return out;
}

template <class Kind>
long run(const double *constants, const Leg *legs, long many, const double *times,
         const double *start, double *rows, long parts) {
  const Constants<Kind> k(constants);
  const typename Kind::Number per_kappa = typename Kind::Number(1.0) / k.kappa;
  constexpr long row = (4 + 2 * Kind::N) * Kind::SIDE;
  State<Kind> y = state_of(k, start, legs[0].start_speed + legs[0].slope * times[0]);
  Slope<Kind> slopes[STAGES];
  Motion<Kind> motion, unused;
  long steps = 0;
  for (long leg = 0; leg < many; leg++) {
    const double slope = legs[leg].slope, speed = legs[leg].start_speed;
    const long count = legs[leg].count;
    std::memcpy(rows, leg ? rows - row : start, row * sizeof(double));
    slopes[0] = slope_of(k, y, speed + slope * times[0], slope, motion);
    for (long i = 1; i < count; i++) {
      const double h = (times[i] - times[i - 1]) / parts;
      for (long part = 0; part < parts; part++, steps++) {
        const double w = speed + slope * (times[i - 1] + part * h), change = slope * h;
#pragma GCC unroll 16
        for (int s = 1; s < STAGES; s++) {
          const State<Kind> trial = moved(y, slopes, A[s], s, h);
          slopes[s] = slope_of(k, trial, w + C[s] * change, slope, unused);
        }
        y = moved(y, slopes, B, STAGES, h);
        slopes[0] = slope_of(k, y, w + change, slope, motion);
      }
      Kind::put(rows + i * row, per_kappa * y.u, per_kappa * motion.v, y.angle, motion.rate);
    }
    times += count, rows += count * row;
  }
  return steps;
}

#if RUNS > 1
typedef SideBySide<BALLS, RUNS> Chosen;
#else
typedef OneRun<BALLS> Chosen;
#endif

}  // namespace

extern "C" long rk8(const double *constants, const Leg *legs, long many, const double *times,
                    const double *start, double *rows, long parts) {
  return run<Chosen>(constants, legs, many, times, start, rows, parts);
}
