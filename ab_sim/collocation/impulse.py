"""The response G of x'' + c x' + k x to a unit impulse, and U to one.

G(t) = h sum_m a_m (t/h)^m, with a_0 = 0, a_1 = 1 and (m + 1) (m + 2) a_m+2 = -(c h (m + 1) a_m+1 +
k h^2 a_m); in closed form where that is no series to be summed.
"""

import math
from typing import NamedTuple

from ab_sim.collocation.nodes import TERMS
from ab_sim.compiling.elementary import exp, expm1
from ab_sim.compiling.kinds import Floats
from ab_sim.tracing.cosine import cos_sin

NEAR = 4.0
"""Rate times time up to which a response is summed as a power series: what its terms cancel of each
other is a few roundings."""
NOTHING = 1e-19
"""Share of the first term at which two in a row are not worth adding, nor those after them."""
REACH = 20.0
"""Rate times length of a panel: there the quadrature is right to rounding."""
GONE = 40.0
"""Decay rate times time after which a response is nothing any more."""
SERIES = TERMS + 2
"""Room for a power series, with two terms behind the last that is added."""


class ImpulseResponse(NamedTuple):
    """What tables are made of."""

    length: float
    """h [s]."""
    c: float
    """Not negative [1/s], as is k."""
    k: float
    """1/s^2."""
    values: Floats
    """a_m, shape (SERIES,)."""
    rates: Floats
    """(m + 1) a_m+1, shape (SERIES,)."""
    terms: int
    """How many of them are worth adding at t = h."""
    to_one: float
    """U at t = h [s^2]."""
    fastest: float
    """See the function of that name."""


def impulse_response(
    length: float, c: float, k: float, values: Floats, rates: Floats
) -> ImpulseResponse:
    """Of a left-hand side, to the end of a step; ``values`` and ``rates``: room for them."""
    terms = put_series(length, c, k, values, rates)
    to_one = response_to_one(length, c, k, values, terms)
    return ImpulseResponse(length, c, k, values, rates, terms, to_one, fastest(c, k))


def put_series(length: float, c: float, k: float, values: Floats, rates: Floats) -> int:
    """The power series; returns how many of its terms are worth adding."""
    ch, khh, terms = c * length, k * length * length, TERMS
    values[0], values[1] = 0.0, 1.0
    for m in range(TERMS):
        rates[m] = (m + 1) * values[m + 1]
        values[m + 2] = -(ch * rates[m] + khh * values[m]) / ((m + 1) * (m + 2))
        if abs(values[m + 1]) + abs(values[m + 2]) < NOTHING:
            terms = m + 1
            break
    return terms


def fastest(c: float, k: float) -> float:
    """How fast a response changes at first [1/s]."""
    a = 0.5 * c
    return math.sqrt(k) if k > a * a else a + math.sqrt(a * a - k)


def impulse(c: float, k: float, t: float) -> tuple[float, float]:
    """G(t) and G'(t) of x'' + c x' + k x = 0; to rounding beside what they were before."""
    a = 0.5 * c
    if k == 0.0 and c > 0.0:
        fallen = expm1(-c * t)
        return -fallen / c, 1.0 + fallen
    if k > a * a:
        w, left = math.sqrt(k - a * a), exp(-a * t)
        cosine, sine = cos_sin(w * t)
        g = left * sine / w
        return g, left * cosine - a * g
    d = math.sqrt(a * a - k)
    if d == 0.0:
        left = exp(-a * t)
        return t * left, (1.0 - a * t) * left
    slow = k / (a + d)
    g = exp(-slow * t) * -expm1(-2.0 * d * t) / (2.0 * d)
    return g, exp(-(a + d) * t) - slow * g


def response_to_one(t: float, c: float, k: float, values: Floats, terms: int) -> float:
    """U after a time [s], that of a series."""
    if fastest(c, k) * t <= NEAR:
        u = 0.0
        for m in range(terms):
            u += values[m] / (m + 1)
        return t * t * u
    g, r = impulse(c, k, t)
    if k == 0.0:
        return (t - g) / c
    a = 0.5 * c
    slow = math.sqrt(k) if k > a * a else k / (a + math.sqrt(a * a - k))
    if slow * t > 0.1:
        return (1.0 - r - c * g) / k
    # Of what hardly begins to give way; the roots are far from each other.
    fast = c - slow
    return (expm1(-fast * t) / fast - expm1(-slow * t) / slow) / (fast - slow)


def panel(c: float, k: float, begin: float, end: float) -> float:
    """How long the next panel is, from ``begin`` to ``end`` at most; 0 where nothing is left."""
    a = 0.5 * c
    rate, slow = fastest(c, k), a
    if k <= a * a:
        slow = k / rate if rate > 0.0 else 0.0
    if begin * slow >= GONE:
        return 0.0
    if k <= a * a and begin * rate >= GONE:
        rate = slow
    return min(end - begin, REACH / rate) if rate > 0.0 else end - begin
