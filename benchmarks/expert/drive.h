// The planar drive in the variables in which it has the fewest products.
//
// On the rotating axes, with kappa = m/(mu R), the deck's place and velocity times kappa are u and
// v. Its momentum, and each ball's along the race, are
//
//     P = v + beta sum p t + eps (0, w)        l = p + v.t        p = w + r
//
// t the race's tangent at the ball, r the ball's rate on the race. With J a turn by 90 degrees
//
//     u' = v - w J u               P' = -(c/M) v - (k/M) u - w J P
//     angle' = r                   l' = -(c_b/mu) r + spin al - v.q
//     t' = J (p t - w t)           q = -J p t
//
// so that accelerations need not be solved for, and of products there are but p t, v.t and v.q.
#pragma once

#include "kinds.h"

template <class Kind>
struct Constants {
  typename Kind::Number beta, eps, damping, stiffness, drag, spin, kappa;

  explicit Constants(const double *from)
      : beta(Kind::number(from)),
        eps(Kind::number(from + Kind::SIDE)),
        damping(Kind::number(from + 2 * Kind::SIDE)),
        stiffness(Kind::number(from + 3 * Kind::SIDE)),
        drag(Kind::number(from + 4 * Kind::SIDE)),
        spin(Kind::number(from + 5 * Kind::SIDE)),
        kappa(Kind::number(from + 6 * Kind::SIDE)) {}
};

// A ramp of the speed; time counts from where the speed was start_speed.
struct Leg {
  double start_speed, slope;
  long count;  // of its times, its begin and its end among them
};

// v = a (rhs) + b (rhs with its components exchanged) solves v - beta sum t (t.v) = rhs.
template <class Kind>
struct Inverse {
  typename Kind::Deck a;
  typename Kind::Number b;

  INLINE Inverse(const Constants<Kind> &k, typename Kind::Both t) {
    typedef typename Kind::Number Number;
    typedef typename Kind::Deck Deck;
    const Deck d = Deck(1.0) - k.beta * Kind::over_balls(t * t);
    const Number cross = k.beta * Kind::first(Kind::over_balls(t * Kind::swapped(t)));
    const Number det = Kind::first(d * Kind::swapped(d)) - cross * cross;
    a = Kind::swapped(d) / det;
    b = cross / det;
  }
  INLINE typename Kind::Deck operator()(typename Kind::Deck rhs) const {
    return a * rhs + b * Kind::swapped(rhs);
  }
};

template <class Kind>
struct State {
  typename Kind::Deck u, P;
  typename Kind::Ball angle, l;
  typename Kind::Both t;
};

// The race's tangents at the balls, by overloads for both kinds.
template <int COUNT>
INLINE typename OneRun<COUNT>::Both tangents(OneRun<COUNT>, typename OneRun<COUNT>::Ball angle) {
  typedef OneRun<COUNT> Kind;
  typename Kind::Ball c, s;
  cos_sin(angle, c, s);
  const auto for_x = Kind::deck(-1.0, 0.0), for_y = Kind::deck(0.0, 1.0);
  const auto present = Kind::present();
  return present * (for_x * s + for_y * c);
}
template <int COUNT, int LANES>
INLINE typename SideBySide<COUNT, LANES>::Both tangents(
    SideBySide<COUNT, LANES>, typename SideBySide<COUNT, LANES>::Ball angle) {
  typename SideBySide<COUNT, LANES>::Both t;
  for (int i = 0; i < COUNT; i++) {
    Lanes<LANES> c, s;
    cos_sin(angle.of[i], c, s);
    t.x.of[i] = -s, t.y.of[i] = c;
  }
  return t;
}

// From a row of a run to the state.
template <class Kind>
INLINE State<Kind> state_of(const Constants<Kind> &k, const double *row, double speed) {
  typedef typename Kind::Number Number;
  State<Kind> y;
  typename Kind::Deck v;
  typename Kind::Ball rate;
  Kind::get(row, y.u, v, y.angle, rate);
  y.u = k.kappa * y.u, v = k.kappa * v;
  y.t = tangents(Kind(), y.angle);
  const Number w(speed);
  const auto p = w + rate;
  y.P = v + k.beta * Kind::over_balls(p * y.t) + Kind::along_y(k.eps * w);
  y.l = p + Kind::dot(Kind::product(v, y.t));
  return y;
}
