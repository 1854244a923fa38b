// What stands side by side in the lanes of vectors: the balls of one run, or runs.
//
// Both kinds have the same operations on three types of values: of the deck (two components), of
// the balls (a number for each), and of both (two components for each ball).
#pragma once

#include "vectors.h"

// One run. Lanes are x and y of the first ball, of the second, and so on; numbers of the deck, or
// without components, are repeated, so that nothing has to be taken out of a vector or spread.
template <int COUNT>
struct OneRun {
  static constexpr int ROOM = COUNT <= 2 ? 2 : COUNT <= 4 ? 4 : 8, SIDE = 1, N = COUNT;
  typedef Lanes<2 * ROOM> Number, Deck, Ball, Both, Products;

  static INLINE Deck deck(double x, double y) {
    Deck out(x);
    for (int i = 1; i < 2 * ROOM; i += 2) out.put(i, y);
    return out;
  }
  static INLINE Deck along_y(Number a) { return deck(0.0, 1.0) * a; }
  static INLINE Both spread(Deck a) { return a; }
  static INLINE Deck swapped(Deck a) { return exchanged<1>(a); }
  static INLINE Deck turned(Deck a) { return deck(-1.0, 1.0) * swapped(a); }  // by 90 degrees
  static INLINE Products product(Deck v, Both t) { return v * t; }
  static INLINE void add_product(Products &sum, Deck v, Both t) { sum = sum + v * t; }
  static INLINE Ball dot(Products a) { return a + swapped(a); }
  static INLINE Deck over_balls(Both a) { return sum_of_every_second(a); }
  static INLINE Number first(Deck a) { return a; }

  // Rows of a run: u1, u2, v1, v2, angles, rates.
  static INLINE void get(const double *row, Deck &u, Deck &v, Ball &angle, Ball &rate) {
    u = deck(row[0], row[1]);
    v = deck(row[2], row[3]);
    angle = rate = Ball(0.0);
    for (int i = 0; i < 2 * N; i++) {
      angle.put(i, row[4 + i / 2]);
      rate.put(i, row[4 + N + i / 2]);
    }
  }
  static INLINE void put(double *row, Deck u, Deck v, Ball angle, Ball rate) {
    row[0] = u[0], row[1] = u[1], row[2] = v[0], row[3] = v[1];
    for (int i = 0; i < N; i++) row[4 + i] = angle[2 * i], row[4 + N + i] = rate[2 * i];
  }
  static INLINE Both present() {  // 1 where there is a ball
    Both out(0.0);
    for (int i = 0; i < 2 * N; i++) out.put(i, 1.0);
    return out;
  }
  static INLINE Number number(const double *from) { return Number(from[0]); }
  static INLINE double most(Deck a, Ball b) {
    return largest(larger(magnitude(a), present() * magnitude(b)));
  }
};

// So many runs, each in a lane of its own.
template <int COUNT, int LANES>
struct SideBySide {
  static constexpr int SIDE = LANES, N = COUNT;
  typedef Lanes<LANES> Number;
  struct Ball {
    Number of[N];
    INLINE Ball() {}
    INLINE Ball(Number x) {
      for (auto &one : of) one = x;
    }
    INLINE Ball(double x) : Ball(Number(x)) {}
  };
  struct Deck {
    Number x, y;
    INLINE Deck() {}
    INLINE Deck(Number x, Number y) : x(x), y(y) {}
    INLINE Deck(double a) : x(a), y(a) {}
  };
  struct Both {
    Ball x, y;
    INLINE Both() {}
    INLINE Both(Number a) : x(a), y(a) {}
    INLINE Both(double a) : x(a), y(a) {}
  };
  typedef Ball Products;

#define OPERATION(sign)                                                        \
  friend INLINE Ball operator sign(Ball a, Ball b) {                           \
    for (int i = 0; i < N; i++) a.of[i] = a.of[i] sign b.of[i];                \
    return a;                                                                  \
  }                                                                            \
  friend INLINE Both operator sign(Both a, Both b) {                           \
    a.x = a.x sign b.x, a.y = a.y sign b.y;                                    \
    return a;                                                                  \
  }                                                                            \
  friend INLINE Deck operator sign(Deck a, Deck b) {                           \
    return Deck(a.x sign b.x, a.y sign b.y);                                   \
  }
  OPERATION(+)
  OPERATION(-)
  OPERATION(*)
#undef OPERATION
  friend INLINE Both operator*(Ball a, Both b) {
    b.x = a * b.x, b.y = a * b.y;
    return b;
  }
  friend INLINE Ball operator*(Number a, Ball b) {
    for (int i = 0; i < N; i++) b.of[i] = a * b.of[i];
    return b;
  }
  friend INLINE Ball operator+(Number a, Ball b) {
    for (int i = 0; i < N; i++) b.of[i] = a + b.of[i];
    return b;
  }
  friend INLINE Ball operator-(Ball a, Number b) {
    for (int i = 0; i < N; i++) a.of[i] = a.of[i] - b;
    return a;
  }
  friend INLINE Both operator*(Number a, Both b) {
    b.x = a * b.x, b.y = a * b.y;
    return b;
  }
  friend INLINE Deck operator*(Number a, Deck b) { return Deck(a * b.x, a * b.y); }
  friend INLINE Deck operator/(Deck a, Number b) { return Deck(a.x / b, a.y / b); }

  static INLINE Deck along_y(Number a) { return Deck(Number(0.0), a); }
  static INLINE Both spread(Deck a) {
    Both out;
    out.x = Ball(a.x), out.y = Ball(a.y);
    return out;
  }
  static INLINE Deck swapped(Deck a) { return Deck(a.y, a.x); }
  static INLINE Deck turned(Deck a) { return Deck(-a.y, a.x); }
  static INLINE Both turned(Both a) {
    Both out;
    for (int i = 0; i < N; i++) out.x.of[i] = -a.y.of[i];
    out.y = a.x;
    return out;
  }
  static INLINE Both swapped(Both a) {
    Both out;
    out.x = a.y, out.y = a.x;
    return out;
  }
  static INLINE Products product(Deck v, Both t) {
    Products out;
    for (int i = 0; i < N; i++) out.of[i] = v.x * t.x.of[i] + v.y * t.y.of[i];
    return out;
  }
  static INLINE void add_product(Products &sum, Deck v, Both t) {
    for (int i = 0; i < N; i++) sum.of[i] = sum.of[i] + v.x * t.x.of[i] + v.y * t.y.of[i];
  }
  static INLINE Ball dot(Products a) { return a; }
  static INLINE Ball dot(Both a) { return a.x + a.y; }
  static INLINE Deck over_balls(Both a) {
    Deck sum(0.0);
    for (int i = 0; i < N; i++) sum = Deck(sum.x + a.x.of[i], sum.y + a.y.of[i]);
    return sum;
  }
  static INLINE Number first(Deck a) { return a.x; }

  static INLINE Number number(const double *from) {
    Number out;
    for (int i = 0; i < LANES; i++) out.put(i, from[i]);
    return out;
  }
  static INLINE void put_number(double *to, Number a) {
    for (int i = 0; i < LANES; i++) to[i] = a[i];
  }
  static INLINE void get(const double *row, Deck &u, Deck &v, Ball &angle, Ball &rate) {
    u = Deck(number(row), number(row + LANES));
    v = Deck(number(row + 2 * LANES), number(row + 3 * LANES));
    for (int i = 0; i < N; i++) {
      angle.of[i] = number(row + (4 + i) * LANES);
      rate.of[i] = number(row + (4 + N + i) * LANES);
    }
  }
  static INLINE void put(double *row, Deck u, Deck v, Ball angle, Ball rate) {
    put_number(row, u.x), put_number(row + LANES, u.y);
    put_number(row + 2 * LANES, v.x), put_number(row + 3 * LANES, v.y);
    for (int i = 0; i < N; i++) {
      put_number(row + (4 + i) * LANES, angle.of[i]);
      put_number(row + (4 + N + i) * LANES, rate.of[i]);
    }
  }
  static INLINE Both present() { return Both(1.0); }
  static INLINE double most(Deck a, Ball b) {
    Number out = larger(magnitude(a.x), magnitude(a.y));
    for (int i = 0; i < N; i++) out = larger(out, magnitude(b.of[i]));
    return largest(out);
  }
};
