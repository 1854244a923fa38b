"""Elementary functions by arithmetic alone, in the subset: the same bits on every machine.

Sources: fdlibm (Sun Microsystems, 1993) for how arguments are reduced; the polynomial is Taylor's.
Cosine and sine are in ``ab_sim.tracing.cosine``.
"""

import math

from ab_sim.compiling.kinds import float_from_bits, fma
from ab_sim.tracing.cosine import ROUND

_LOG2_E = 1.4426950408889634
_LN2_HIGH, _LN2_LOW = 0.6931471803691238, 1.9082149292705877e-10
"""ln 2 in two pieces, the first of 32 bits, whose products with whole numbers are exact."""
_OVERFLOW, _UNDERFLOW = 709.782712893384, -745.2
"""Above the one, e^x is infinity, below the other zero."""
_LOST = -40.0
"""Below this, e^x - 1 is -1."""


def exp(x: float) -> float:
    """e^x to within 0.65 ulp, where it is 2.2e-308 or more; below, to within 0.8 of the spacing."""
    if not _UNDERFLOW <= x <= _OVERFLOW:
        return x if x != x else (math.inf if x > 0.0 else 0.0)
    twos, r, low = _reduced(x)
    # In two steps, as 2^1024 and 2^-1075 are no numbers.
    n = int(twos)
    part = n // 2
    return _one_and(1.0, r, low) * power_of_two(part) * power_of_two(n - part)


def expm1(x: float) -> float:
    """e^x - 1 to within 0.75 ulp."""
    if x > _OVERFLOW:
        return math.inf
    if x < _LOST:
        return -1.0
    if not abs(x) > 0.5:
        # Also of a NaN.
        return fma(x * x, _rest(x), x)
    twos, r, low = _reduced(x)
    n = int(twos)
    less = power_of_two(-n) if n < 60 else 0.0
    one = 1.0 - less
    part = n // 2
    found = _one_and(one, r, low + ((1.0 - one) - less))
    return found * power_of_two(part) * power_of_two(n - part)


def power_of_two(n: int) -> float:
    """2^n, n within -1022 .. 1023."""
    return float_from_bits((n + 1023) << 52)


def _reduced(x: float) -> tuple[float, float, float]:
    """x = n ln 2 + r + low: n whole, abs(r) no more than ln(2)/2, low what r lost by rounding."""
    twos = fma(x, _LOG2_E, ROUND) - ROUND
    high = fma(twos, -_LN2_HIGH, x)
    r = fma(twos, -_LN2_LOW, high)
    return twos, r, fma(twos, -_LN2_LOW, high - r)


def _rest(r: float) -> float:
    """(e^r - 1 - r) / r^2 for abs(r) up to 0.5: Taylor's series, but for less than a rounding."""
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
    """one + (e^(r + low) - 1), rounded once but for little; abs(one) not less than abs(r)."""
    total = one + r
    lost = r - (total - one)
    square = r * r
    return total + fma(square, _rest(r), fma(0.5, fma(r, r, -square), lost + low))
