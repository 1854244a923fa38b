"""Functions drawn as cubics between two ends: where they are lowest, and where they are zero."""

import math

from ab_sim.events.event_functions import NEVER

NEWTON = 8
"""Steps of Newton's to the root of a cubic."""


def minimum_of_cubic(g0: float, g1: float, r0: float, r1: float) -> tuple[float, float]:
    """Where in 0 .. 1 a cubic with these ends and slopes is lowest, and how low; (0, ..) if not."""
    if r0 >= 0.0 or r1 <= 0.0:
        return 0.0, g0
    # g0 + r0 x + p x^2 + q x^3; its minimum is where the derivative rises through zero.
    p = 3.0 * (g1 - g0) - 2.0 * r0 - r1
    q = 2.0 * (g0 - g1) + r0 + r1
    root = p * p - 3.0 * q * r0
    if root < 0.0:
        return 0.0, g0
    x = -r0 / (p + math.sqrt(root))
    if not 0.0 < x < 1.0:
        return 0.0, g0
    return x, g0 + x * (r0 + x * (p + x * q))


def crossing(
    low: float, high: float, at_low: float, at_high: float, rate_low: float, rate_high: float
) -> float:
    """Where a function is zero that is drawn between two ends by its values and rates there.

    As a cubic; where it falls at both ends, its inverse is one; a straight line if a rate is NEVER.
    """
    length, span = high - low, at_high - at_low
    part = -at_low / span
    if rate_low >= NEVER or rate_high >= NEVER:
        return low + part * length
    if rate_low < 0.0 and rate_high < 0.0:
        rest = 1.0 - part
        beyond_low, beyond_high = span / rate_low - length, span / rate_high - length
        return low + part * length + part * rest * (rest * beyond_low - part * beyond_high)
    r0, r1 = rate_low * length, rate_high * length
    p, q = 3.0 * span - 2.0 * r0 - r1, r0 + r1 - 2.0 * span
    before, behind = 0.0, 1.0
    for _ in range(NEWTON):
        here = at_low + part * (r0 + part * (p + part * q))
        before, behind = (part, behind) if here > 0.0 else (before, part)
        part -= here / (r0 + part * (2.0 * p + 3.0 * part * q))
        if not before < part < behind:
            part = 0.5 * (before + behind)
    return low + part * length


def landing(r0: float, g1: float, r1: float) -> float:
    """Where in 0 .. 1 a cubic that rises from zero is zero again; 1 if it is not.

    Args:
        r0, r1: changes over the whole at its start and end.
        g1: its value at the end.
    """
    p = 3.0 * g1 - 2.0 * r0 - r1
    q = r0 + r1 - 2.0 * g1
    root = p * p - 4.0 * q * r0
    if not (r0 > 0.0 and p < 0.0 and root >= 0.0):
        return 1.0
    return min(2.0 * r0 / (math.sqrt(root) - p), 1.0)
