"""Functions for formulas: for floats they compute, for expressions they create nodes."""

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from ab_sim.tracing import expression
from ab_sim.tracing.expression import Expression


def cos(x: Any) -> Any:
    """Return the cosine of an angle [rad]."""
    return math.cos(x) if isinstance(x, float) else np.cos(x)


def sin(x: Any) -> Any:
    """Return the sine of an angle [rad]."""
    return math.sin(x) if isinstance(x, float) else np.sin(x)


def sqrt(x: Any) -> Any:
    """Return the square root."""
    return math.sqrt(x) if isinstance(x, float) else np.sqrt(x)


def fma(a: Any, b: Any, c: Any) -> Any:
    """Return a b + c, rounded once."""
    for x in (a, b, c):
        if isinstance(x, Expression):
            return expression.fma(*(expression.lifted(x.graph, operand) for operand in (a, b, c)))
    return multiply_add(a, b, c)


def multiply_add(a: float, b: float, c: float) -> float:
    """Return a b + c, rounded once, as IEEE 754 defines it.

    Python has no ``math.fma`` before 3.13; exact fractions replace it, as dividing two integers
    rounds correctly.
    """
    if not (math.isfinite(a) and math.isfinite(b) and math.isfinite(c)):
        return c if math.isfinite(a) and math.isfinite(b) else a * b + c
    exact = Fraction(a) * Fraction(b) + Fraction(c)
    if exact == 0:
        # Fractions have no sign of zero. If both terms are zeros, floats add them with the right
        # sign; terms that cancel give +0.
        product = math.copysign(0.0, a) * math.copysign(1.0, b)
        return product + c if a * b == 0 and c == 0 else 0.0
    try:
        return exact.numerator / exact.denominator
    except OverflowError:
        return math.inf if exact > 0 else -math.inf


def where(condition: Any, a: Any, b: Any) -> Any:
    """Return ``a`` if a condition holds, else ``b``; both are computed, and neither may fail."""
    if isinstance(condition, Expression):
        graph = condition.graph
        return expression.where(condition, expression.lifted(graph, a), expression.lifted(graph, b))
    if isinstance(condition, np.ndarray):
        return np.where(condition, a, b)
    return a if condition else b


def total(x: Any) -> Any:
    """Return the sum over the balls of an expression, or of a sequence with a number per ball."""
    if isinstance(x, Expression):
        return expression.total(x)
    if isinstance(x, Sequence | np.ndarray):
        return added_up(list(x), lambda a, b: a + b)
    raise TypeError(f"total of {x!r}: must be an expression or a sequence with a number per ball")


def across(x: Any) -> Any:
    """Return the sum over lanes, repeated in each lane; the number of lanes is a power of two.

    In an array, the last axis counts lanes.
    """
    if isinstance(x, Expression):
        return expression.across(x)
    return halved(list(np.moveaxis(x, -1, 0)), lambda a, b: a + b)[..., None]


GROUP = 8
"""Number of balls in a vector register."""


def added_up(parts: Sequence[Any], add: Any) -> Any:
    """Return a sum over the balls in the order that all emitted forms share.

    Floating-point addition is not associative, so the order is fixed. Whole groups of eight are
    added element by element, then the result by halves. An incomplete last group is added by
    halves on its own, and its sum is added last.
    """
    whole = len(parts) - len(parts) % GROUP
    sums = []
    if whole:
        lanes = list(parts[:GROUP])
        for at in range(GROUP, whole, GROUP):
            lanes = [add(a, b) for a, b in zip(lanes, parts[at : at + GROUP], strict=True)]
        sums.append(halved(lanes, add))
    if whole < len(parts):
        sums.append(halved(parts[whole:], add))
    return sums[0] if len(sums) == 1 else add(*sums)


def halved(parts: Sequence[Any], add: Any) -> Any:
    """Return a sum, by adding the second half to the first until one element remains."""
    remaining = list(parts)
    while len(remaining) > 1:
        half = 1 << (len(remaining) - 1).bit_length() - 1
        remaining = [
            add(a, remaining[half + k]) if half + k < len(remaining) else a
            for k, a in enumerate(remaining[:half])
        ]
    return remaining[0]


_QUARTERS = 0.6366197723675814
"""2/pi, the number of quarter turns per radian."""
ROUND = 6755399441055744.0
"""1.5 * 2^52; adding and subtracting it rounds a number to the nearest integer."""
_PI_2A, _PI_2B, _PI_2C = 1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21
"""pi/2 in pieces of 33 bits, whose products with up to 2^20 quarter turns are exact. With more, the
remainder after the first piece is still exact, and the other pieces are small."""


def cos_sin(x: float) -> tuple[float, float]:
    """Return (cos x, sin x), with an absolute error of about 2^-53 for abs(x) up to 10^9.

    The code has no branches, so it can run in lanes.
    """
    quarters = fma(x, _QUARTERS, ROUND) - ROUND
    # Cody and Waite reduction: r is x less the nearest multiple of pi/2, so abs(r) <= pi/4.
    r = fma(quarters, -_PI_2A, x)
    r = fma(quarters, -_PI_2C, fma(quarters, -_PI_2B, r))
    z = r * r
    zz = z * z
    # Polynomials of sine and cosine on +-pi/4, from fdlibm's __kernel_sin and __kernel_cos (Sun
    # Microsystems, 1993). Pairs of terms are joined by powers of z z, as in Estrin's scheme, which
    # keeps the chain of dependent operations short.
    s = fma(z, 1.58969099521155e-10, -2.5050760253406863e-08)
    s = fma(zz, s, fma(z, 2.7557313707070068e-06, -0.0001984126982985795))
    s = fma(zz, s, fma(z, 0.00833333333332249, -0.16666666666666632))
    s = fma(r * z, s, r)
    c = fma(z, -1.1359647557788195e-11, 2.087572321298175e-09)
    c = fma(zz, c, fma(z, -2.7557314351390663e-07, 2.480158728947673e-05))
    c = fma(zz, c, fma(z, -0.001388888888887411, 0.0416666666666666))
    # As in fdlibm: the rounding error of 1 - z/2 is computed exactly and added to the small rest.
    half = 0.5 * z
    near = 1.0 - half
    c = near + fma(zz, c, (1.0 - near) - half)
    # Rotate by the number of quarter turns modulo 4, from -2 to 2: cosine and sine of that
    # rotation are -1, 0 or 1, and (1 - |n|, n (2 - |n|)) gives them without a branch.
    remainder = fma(-(fma(quarters, 0.25, ROUND) - ROUND), 4.0, quarters)
    turn_c = 1.0 - abs(remainder)
    turn_s = remainder * (2.0 - abs(remainder))
    return fma(c, turn_c, -(s * turn_s)), fma(s, turn_c, c * turn_s)
