"""Elementary functions by arithmetic alone, in the subset, bitwise the same on every machine.

Source: fdlibm (Sun Microsystems, 1993) for the reduction of arguments; the polynomial is Taylor's.
Cosine and sine are in ``ab_sim.tracing.cosine``.
"""

import math

from ab_sim.compiling.kinds import float_from_bits, fma
from ab_sim.tracing.cosine import ROUND

_LOG2_E = 1.4426950408889634
_LN2_HIGH, _LN2_LOW = 0.6931471803691238, 1.9082149292705877e-10
"""ln 2 in two pieces, the first of 32 bits, whose products with the integers used are exact."""
_OVERFLOW, _UNDERFLOW = 709.782712893384, -745.2
"""Limits above which e^x is infinity, and below which it is zero."""
_LOST = -40.0
"""Limit below which e^x - 1 is -1."""


def exp(x: float) -> float:
    """Return e^x, to within 0.65 ulp if it is 2.2e-308 or more; else, 0.8 of the spacing."""
    if not _UNDERFLOW <= x <= _OVERFLOW:
        return x if x != x else (math.inf if x > 0.0 else 0.0)
    twos, r, low = _reduced(x)
    # Scale in two steps, as 2^1024 and 2^-1075 are not representable.
    n = int(twos)
    part = n // 2
    return _one_and(1.0, r, low) * power_of_two(part) * power_of_two(n - part)


def expm1(x: float) -> float:
    """Return e^x - 1, to within 0.75 ulp."""
    if x > _OVERFLOW:
        return math.inf
    if x < _LOST:
        return -1.0
    if not abs(x) > 0.5:
        # The negated comparison takes a NaN here, too.
        return fma(x * x, _rest(x), x)
    twos, r, low = _reduced(x)
    n = int(twos)
    # e^x - 1 = 2^n (1 - 2^-n + (e^r - 1)): take the 1 off before scaling, and add what rounding
    # 1 - 2^-n loses to the low part.
    less = power_of_two(-n) if n < 60 else 0.0
    one = 1.0 - less
    part = n // 2
    found = _one_and(one, r, low + ((1.0 - one) - less))
    return found * power_of_two(part) * power_of_two(n - part)


def power_of_two(n: int) -> float:
    """Return 2^n, for n from -1022 to 1023."""
    return float_from_bits((n + 1023) << 52)


def _reduced(x: float) -> tuple[float, float, float]:
    """Return (n, r, low) with x = n ln 2 + r + low.

    n is an integer, abs(r) is at most ln(2)/2, and low is the rounding error of r.
    """
    twos = fma(x, _LOG2_E, ROUND) - ROUND
    high = fma(twos, -_LN2_HIGH, x)
    r = fma(twos, -_LN2_LOW, high)
    return twos, r, fma(twos, -_LN2_LOW, high - r)


def _rest(r: float) -> float:
    """Return (e^r - 1 - r) / r^2 for abs(r) up to 0.5.

    The Taylor series is truncated where the remainder is less than a rounding error.
    """
    e = fma(r, 1.0 / 1307674368000.0, 1.0 / 87178291200.0)
    e = fma(r, e, 1.0 / 6227020800.0)
    e = fma(r, e, 1.0 / 479001600.0)
    e = fma(r, e, 1.0 / 39916800.0)
    e = fma(r, e, 1.0 / 3628800.0)
    e = fma(r, e, 1.0 / 362880.0)
    e = fma(r, e, 1.0 / 40320.0)
    e = fma(r, e, 1.0 / 5040.0)
    e = fma(r, e, 1.0 / 720.0)
    e = fma(r, e, 1.0 / 120.0)
    e = fma(r, e, 1.0 / 24.0)
    e = fma(r, e, 1.0 / 6.0)
    return fma(r, e, 0.5)


def _one_and(one: float, r: float, low: float) -> float:
    """Return one + (e^(r + low) - 1), nearly rounded once; abs(one) must be at least abs(r).

    The sum one + r is compensated: ``lost`` is its exact rounding error (Dekker 1971, Numer. Math.
    18, 224-242), and the rounding error of r^2 is taken along by ``fma``.
    """
    total = one + r
    lost = r - (total - one)
    square = r * r
    return total + fma(square, _rest(r), fma(0.5, fma(r, r, -square), lost + low))
