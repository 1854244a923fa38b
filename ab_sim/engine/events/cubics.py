"""Minima and roots of cubics that interpolate values and rates at two ends (Hermite)."""

import math

from ab_sim.engine.events.event_functions import NEVER

_NEWTON = 8
"""Newton iterations for the root of a cubic."""


def minimum_of_cubic(g0: float, g1: float, r0: float, r1: float) -> tuple[float, float]:
    """Return the position of the minimum of a cubic inside 0 .. 1, and its value there.

    The cubic has the values g0 and g1 and the slopes r0 and r1 at 0 and 1. The position is 0 if
    it has no minimum inside.
    """
    if r0 >= 0.0 or r1 <= 0.0:
        return 0.0, g0
    # g0 + r0 x + p x^2 + q x^3; its minimum is where the derivative rises through zero.
    p = 3.0 * (g1 - g0) - 2.0 * r0 - r1
    q = 2.0 * (g0 - g1) + r0 + r1
    root = p * p - 3.0 * q * r0
    if root < 0.0:
        return 0.0, g0
    # The form of the quadratic's root without cancellation, also for q = 0.
    x = -r0 / (p + math.sqrt(root))
    if not 0.0 < x < 1.0:
        return 0.0, g0
    return x, g0 + x * (r0 + x * (p + x * q))


def crossing(
    low: float, high: float, at_low: float, at_high: float, rate_low: float, rate_high: float
) -> float:
    """Return the root of a function from its values and rates at two ends with different signs.

    If the function falls at both ends, its inverse is interpolated by a cubic, which gives the
    root directly. Otherwise the function itself is interpolated, and Newton's method with bisection
    finds the root of the cubic. If a rate is NEVER (unknown), the interpolation is linear.

    Parameters
    ----------
    low, high
        The two ends [s].
    at_low, at_high
        Values there, positive and negative.
    rate_low, rate_high
        Time derivatives there.
    """
    length, span = high - low, at_high - at_low
    part = -at_low / span
    # Linear interpolation gives ``part``, a fraction of the bracket; all else corrects it.
    if rate_low >= NEVER or rate_high >= NEVER:
        return low + part * length
    if rate_low < 0.0 and rate_high < 0.0:
        rest = 1.0 - part
        beyond_low, beyond_high = span / rate_low - length, span / rate_high - length
        return low + part * length + part * rest * (rest * beyond_low - part * beyond_high)
    r0, r1 = rate_low * length, rate_high * length
    p, q = 3.0 * span - 2.0 * r0 - r1, r0 + r1 - 2.0 * span
    before, behind = 0.0, 1.0
    for _ in range(_NEWTON):
        here = at_low + part * (r0 + part * (p + part * q))
        before, behind = (part, behind) if here > 0.0 else (before, part)
        part -= here / (r0 + part * (2.0 * p + 3.0 * part * q))
        if not before < part < behind:
            part = 0.5 * (before + behind)
    return low + part * length


def landing(r0: float, g1: float, r1: float) -> float:
    """Return the second root, in 0 .. 1, of a cubic that rises from zero at 0; 1 if none.

    Parameters
    ----------
    r0, r1
        Slopes at 0 and 1.
    g1
        Value at 1.
    """
    p = 3.0 * g1 - 2.0 * r0 - r1
    q = r0 + r1 - 2.0 * g1
    root = p * p - 4.0 * q * r0
    if not (r0 > 0.0 and p < 0.0 and root >= 0.0):
        return 1.0
    return min(2.0 * r0 / (math.sqrt(root) - p), 1.0)
