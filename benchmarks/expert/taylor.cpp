// Taylor's method of a fixed order with steps by tolerance, for the drive of drive.h.
//
// Coefficients follow from each other as in automatic differentiation; the tangents are carried on
// by their own series, made unit vectors again at each step, so that no sine has to be found.
// BALLS; RUNS side by side, or 1; ORDERS as a list of calls of ORDER.
#include <cmath>
#include <cstdint>
#include <cstring>

#include "drive.h"

namespace {

// Up to this order all sums are written out: beyond it the code is too large for the caches.
constexpr int WRITTEN_OUT = RUNS > 1 || 2 * BALLS > WIDTH ? 12 : 32;

template <class Kind, int K>
struct Series {
  typedef typename Kind::Number Number;
  typedef typename Kind::Deck Deck;
  typedef typename Kind::Ball Ball;
  typedef typename Kind::Both Both;
  typedef typename Kind::Products Products;

  Deck u[K + 1], P[K + 1], v[K];
  Ball angle[K + 1], l[K + 1], p[K], rate[K];
  Both t[K + 1], turned[K];  // the latter of p t

  // What is latest known at an order enters what is asked for by matrices of the step, so that few
  // operations have to wait for each other: each order waits for the one before.
  INLINE void fill(const Constants<Kind> &k, const State<Kind> &y, double speed, double slope) {
    const Number w(speed), al(slope);
    const Inverse<Kind> inverse(k, y.t);
    u[0] = y.u, P[0] = y.P, angle[0] = y.angle, l[0] = y.l, t[0] = y.t;
    v[0] = inverse(P[0] - Kind::along_y(k.eps * w) - k.beta * Kind::over_balls(l[0] * t[0]));
    p[0] = l[0] - Kind::dot(Kind::product(v[0], t[0]));
    const Both across = Kind::turned(t[0]);
    turned[0] = p[0] * across;
    const Deck a = k.beta * inverse.a;
    const Number b = k.beta * inverse.b;
    const Both by_l = Kind::spread(a) * t[0] + b * Kind::swapped(t[0]);
    const Both by_t = p[0] * Kind::spread(a) - by_l * Kind::spread(v[0]);
    const Both by_swapped = p[0] * Both(b) - by_l * Kind::spread(Kind::swapped(v[0]));
    const Ball by_p = Kind::dot(Kind::product(v[0], across)) - Ball(k.drag);
    Ball force = k.spin * al + (p[0] * by_p + k.drag * w);
    next(k, 0, w, al, force);
#pragma GCC unroll 32
    for (int i = 1; i < K; i++) {
      Both older(0.0);
      Products vt(0.0), vq(0.0);
      const auto add = [&](int j) __attribute__((always_inline)) {
        older = older + p[j] * t[i - j];
        Kind::add_product(vt, v[j], t[i - j]);
        Kind::add_product(vq, v[j], turned[i - j]);
      };
      if constexpr (K <= WRITTEN_OUT) {
        // From the middle outwards: what was found last comes last.
        if (i % 2 == 0) add(i / 2);
#pragma GCC unroll 32
        for (int j = (i - 1) / 2; j > 0; j--) add(j), add(i - j);
      } else {
#pragma GCC unroll 2
        for (int j = 1; j < i; j++) add(j);
      }
      const Deck momentum = i == 1 ? P[1] - Kind::along_y(k.eps * al) : P[i];
      const Ball known = l[i] - Kind::dot(vt);
      const Both moved = (Kind::spread(a) * older + b * Kind::swapped(older)) + known * by_l;
      v[i] = inverse(momentum) -
             Kind::over_balls((moved + by_t * t[i]) + by_swapped * Kind::swapped(t[i]));
      p[i] = (known - Kind::dot(Kind::product(v[0], t[i]))) - Kind::dot(Kind::product(v[i], t[0]));
      const Both but_latest = Kind::turned(older + p[0] * t[i]);
      turned[i] = but_latest + p[i] * across;
      Kind::add_product(vq, v[0], but_latest);
      Kind::add_product(vq, v[i], turned[0]);
      force = Kind::dot(vq) + p[i] * by_p;
      if (i == 1) force = force + Ball(k.drag * al);
      next(k, i, w, al, force);
    }
  }

  // The coefficients of the state that follow from order i.
  INLINE void next(const Constants<Kind> &k, int i, Number w, Number al, Ball force) {
    const Number part(1.0 / (i + 1));
    Both wt = w * t[i];
    Deck wu = w * u[i], wP = w * P[i];
    if (i > 0) {
      wt = wt + al * t[i - 1];
      wu = wu + al * u[i - 1];
      wP = wP + al * P[i - 1];
    }
    rate[i] = i == 0 ? p[0] - w : i == 1 ? p[1] - al : p[i];
    t[i + 1] = part * turned[i] - part * Kind::turned(wt);
    angle[i + 1] = part * rate[i];
    l[i + 1] = part * force;
    u[i + 1] = part * (v[i] - Kind::turned(wu));
    P[i + 1] = part * ((Deck(0.0) - k.stiffness * u[i] - Kind::turned(wP)) - k.damping * v[i]);
  }

  template <class Value, int LAST>
  static INLINE Value sum(const Value (&c)[LAST], Number h, Number hh) {
    Value even = c[(LAST - 1) & ~1], odd = c[(LAST - 2) | 1];
#pragma GCC unroll 32
    for (int j = ((LAST - 1) & ~1) - 2; j >= 0; j -= 2) even = hh * even + c[j];
#pragma GCC unroll 32
    for (int j = ((LAST - 2) | 1) - 2; j >= 0; j -= 2) odd = hh * odd + c[j];
    return even + h * odd;
  }

  INLINE State<Kind> end(double length) const {
    const Number h(length), hh(length * length);
    State<Kind> y;
    y.u = sum(u, h, hh), y.P = sum(P, h, hh), y.angle = sum(angle, h, hh), y.l = sum(l, h, hh);
    y.t = sum(t, h, hh);
    const Ball square = Kind::dot(y.t * y.t);
    y.t = (Ball(1.5) - Number(0.5) * square) * y.t;
    return y;
  }

  INLINE void put(const Number per_kappa, double length, double *row) const {
    const Number h(length), hh(length * length);
    Kind::put(row, per_kappa * sum(u, h, hh), per_kappa * sum(v, h, hh), sum(angle, h, hh),
              sum(rate, h, hh));
  }

  INLINE double longest(double log_tolerance) const {
    const double last = Kind::most(u[K], angle[K]), before = Kind::most(u[K - 1], angle[K - 1]);
    const double a = (log_tolerance - log2_of(last)) * (1.0 / K);
    const double b = (log_tolerance - log2_of(before)) * (1.0 / (K - 1));
    return exp2_of(a < b ? a : b);
  }

  // To a few thousandths: enough for a length.
  static INLINE double log2_of(double x) {
    std::uint64_t bits;
    std::memcpy(&bits, &x, 8);
    const double exponent = static_cast<double>(static_cast<std::int64_t>(bits >> 52) - 1023);
    bits = (bits & 0xfffffffffffffu) | 0x3ff0000000000000u;
    double m;
    std::memcpy(&m, &bits, 8);
    return exponent + ((-0.33582878 * m + 2.0) * m - 1.65871022);
  }
  static INLINE double exp2_of(double x) {
    x = x < -60.0 ? -60.0 : x > 10.0 ? 10.0 : x;
    const std::int64_t whole = static_cast<std::int64_t>(x + 1024.0) - 1024;
    const double f = x - static_cast<double>(whole);
    const double m = (0.33977 * f + 0.65723) * f + 1.00249;
    const std::uint64_t bits = static_cast<std::uint64_t>(whole + 1023) << 52;
    double power;
    std::memcpy(&power, &bits, 8);
    return power * m;
  }
};

template <class Kind, int K>
long run(const double *constants, const Leg *legs, long many, const double *times,
         const double *start, double *rows, double tolerance) {
  const Constants<Kind> k(constants);
  const typename Kind::Number per_kappa = typename Kind::Number(1.0) / k.kappa;
  const double log_tolerance = std::log2(tolerance);
  constexpr long row = (4 + 2 * Kind::N) * Kind::SIDE;
  State<Kind> y = state_of(k, start, legs[0].start_speed + legs[0].slope * times[0]);
  Series<Kind, K> series;
  long steps = 0;
  for (long leg = 0; leg < many; leg++) {
    const double slope = legs[leg].slope;
    const long count = legs[leg].count;
    double time = times[0];
    const double end = times[count - 1];
    std::memcpy(rows, leg ? rows - row : start, row * sizeof(double));
    for (long i = 1; i < count; steps++) {
      series.fill(k, y, legs[leg].start_speed + slope * time, slope);
      double h = series.longest(log_tolerance);
      if (!(h < end - time)) h = end - time;
      const double next = h == end - time ? end : time + h;
      for (; i < count && times[i] <= next; i++)
        series.put(per_kappa, times[i] - time, rows + i * row);
      y = series.end(h);
      time = next;
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

#define ORDER(order)                                                                         \
  extern "C" long taylor_##order(const double *constants, const Leg *legs, long many,        \
                                 const double *times, const double *start, double *rows,     \
                                 double tolerance) {                                         \
    return run<Chosen, order>(constants, legs, many, times, start, rows, tolerance);         \
  }
ORDERS
