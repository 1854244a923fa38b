// Vectors of doubles by GCC's extension, in pieces as wide as the processor's registers.
//
// Lanes<N>   N doubles side by side, in pieces of at most WIDTH.
#pragma once

#include <utility>

#ifndef WIDTH
#define WIDTH 8
#endif

#define INLINE inline __attribute__((always_inline))

template <int N>
struct Raw {
  typedef double type __attribute__((vector_size(8 * N)));
  typedef long mask __attribute__((vector_size(8 * N)));
};

template <int N>
struct Lanes {
  static constexpr int W = N < WIDTH ? N : WIDTH, PIECES = N / W;
  typedef typename Raw<W>::type Piece;
  Piece p[PIECES];

  INLINE Lanes() {}
  INLINE Lanes(double x) {
    for (auto &one : p) one = x - Piece{};
  }
  INLINE double operator[](int i) const { return p[i / W][i % W]; }
  INLINE void put(int i, double x) { p[i / W][i % W] = x; }
};

#define EACH_PIECE(expression)                          \
  Lanes<N> out;                                         \
  for (int i = 0; i < Lanes<N>::PIECES; i++) out.p[i] = expression; \
  return out;

template <int N> INLINE Lanes<N> operator+(Lanes<N> a, Lanes<N> b) { EACH_PIECE(a.p[i] + b.p[i]) }
template <int N> INLINE Lanes<N> operator-(Lanes<N> a, Lanes<N> b) { EACH_PIECE(a.p[i] - b.p[i]) }
template <int N> INLINE Lanes<N> operator*(Lanes<N> a, Lanes<N> b) { EACH_PIECE(a.p[i] * b.p[i]) }
template <int N> INLINE Lanes<N> operator/(Lanes<N> a, Lanes<N> b) { EACH_PIECE(a.p[i] / b.p[i]) }
template <int N> INLINE Lanes<N> operator*(double a, Lanes<N> b) { EACH_PIECE(a * b.p[i]) }
template <int N> INLINE Lanes<N> operator-(Lanes<N> a) { EACH_PIECE(-a.p[i]) }
template <int N> INLINE Lanes<N> larger(Lanes<N> a, Lanes<N> b) {
  EACH_PIECE(a.p[i] > b.p[i] ? a.p[i] : b.p[i])
}
template <int N> INLINE Lanes<N> magnitude(Lanes<N> a) { return larger(a, -a); }

template <int N>
INLINE double largest(Lanes<N> a) {
  double most = a[0];
  for (int i = 1; i < N; i++) most = a[i] > most ? a[i] : most;
  return most;
}

// Lanes change places with those at a distance, which is a power of two.
template <int DISTANCE, typename Piece, typename Mask, long... I>
INLINE Piece exchanged_within(Piece a, std::integer_sequence<long, I...>) {
  return __builtin_shuffle(a, Mask{(I ^ DISTANCE)...});
}
template <int DISTANCE, int N>
INLINE Lanes<N> exchanged(Lanes<N> a) {
  typedef Lanes<N> L;
  if constexpr (DISTANCE >= L::W) {
    EACH_PIECE(a.p[i ^ (DISTANCE / L::W)])
  } else {
    typedef typename L::Piece Piece;
    typedef typename Raw<L::W>::mask Mask;
    typedef std::make_integer_sequence<long, L::W> Places;
    EACH_PIECE((exchanged_within<DISTANCE, Piece, Mask>(a.p[i], Places())))
  }
}

// Of every second lane, in each of them.
template <int N, int DISTANCE = 2>
INLINE Lanes<N> sum_of_every_second(Lanes<N> a) {
  if constexpr (DISTANCE >= N)
    return a;
  else
    return sum_of_every_second<N, 2 * DISTANCE>(a + exchanged<DISTANCE>(a));
}

// Cosine and sine of angles of moderate size, to about 1 ulp: Cody and Waite's reduction, fdlibm's
// polynomials.
template <int N>
INLINE void cos_sin(Lanes<N> angle, Lanes<N> &c, Lanes<N> &s) {
  typedef Lanes<N> L;
  for (int i = 0; i < L::PIECES; i++) {
    typedef typename L::Piece V;
    typedef typename Raw<L::W>::mask M;
    const V x = angle.p[i], magic = V{} + 0x1.8p52;
    V shifted = x * 0x1.45f306dc9c883p-1 + magic;
    __asm__("" : "+x"(shifted));  // or -ffast-math takes away what was added to round
    const V turns = shifted - magic;
    const M quadrant = (M)shifted;
    const V r = (x - turns * 0x1.921fb54400000p0) - turns * 0x1.0b4611a626331p-34, z = r * r;
    V ps = 1.58969099521155010221e-10 * z - 2.50507602534068634195e-08;
    ps = (ps * z + 2.75573137070700676789e-06) * z - 1.98412698298579493134e-04;
    ps = (ps * z + 8.33333333332248946124e-03) * z - 1.66666666666666324348e-01;
    V pc = -1.13596475577881948265e-11 * z + 2.08757232129817482790e-09;
    pc = (pc * z - 2.75573143513906633035e-07) * z + 2.48015872894767294178e-05;
    pc = (pc * z - 1.38888888888741095749e-03) * z + 4.16666666666666019037e-02;
    const V sine = r + r * z * ps, half = 0.5 * z, w = 1.0 - half;
    const V cosine = w + (((1.0 - w) - half) + z * z * pc);
    const M odd = (quadrant & 1) != 0;
    const M negative_s = (quadrant & 2) != 0, negative_c = ((quadrant + 1) & 2) != 0;
    const V first = odd ? sine : cosine, second = odd ? cosine : sine;
    c.p[i] = negative_c ? -first : first;
    s.p[i] = negative_s ? -second : second;
  }
}
