"""What x'' + c x' + k x = f(t) makes of an f that is a polynomial through eight Gauss nodes.

For a step of length h with nodes t_j, and G the response to a unit impulse,

    x(t) = (1 - k U(t)) x_0 + G(t) v_0 + sum_k f_k int_0^t G(t - s) l_k(s) ds
    v(t) = -k G(t) x_0 + G'(t) v_0     + sum_k f_k int_0^t G'(t - s) l_k(s) ds

with U the response to f = 1, and l_k the nodes' Lagrange polynomials: exact however large c h and
k h^2 are. Tables hold the integrals up to eight instants, each line in lanes. A ball under linear
drag has k = 0; with c = 0 as well, v is the plain integral of f.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.polynomial import legendre

from ab_sim.dynamics.dispatch import APART
from ab_sim.dynamics.numbers.across import product_onto, put_column, total
from ab_sim.dynamics.numbers.cos_sin import cos_sin
from ab_sim.dynamics.numbers.kinds import EIGHT
from ab_sim.dynamics.numbers.lanes import as_lanes, zero_in_lanes
from ab_sim.integrate.on_stack import own_array
from ab_sim.integrate.workspace import aligned

NODES = EIGHT
LEADING = 12870.0
"""Of x^8 in P_8 on 0 .. 1."""
POINTS = 24
"""Of the quadrature on each panel."""
REACH = 20.0
"""Rate times length of a panel: there the quadrature is right to rounding."""
NEAR = 4.0
"""Rate times length of a step, up to which the response is summed as a power series: what its
terms cancel of each other is a few roundings."""
TERMS = 34
"""Of that, at most: the next one is less than rounding."""
NOTHING = 1e-19
"""Share of the first term at which two in a row are not worth adding, nor those after them."""
HYPERBOLIC = 9
"""Terms of sinh(x) / x for x up to 1."""
GONE = 40.0
"""Decay rate times time after which a response is nothing any more."""

INTO_X, INTO_V, INTO_PULL, UNIT, IMPULSE, IMPULSE_RATE, NUMBERS = 0, 8, 16, 24, 25, 26, 27
"""Lines of a table: the integrals into x, v and c v + k x at eight instants, a line for each k; U,
G and G' there; and numbers:"""
LENGTH, DAMPING, STIFFNESS, MOST_UNIT, BEYOND, COUNT = range(6)
"""h [s]; c, k; U at most; what f = P_8, the first of Legendre's polynomials that none through
the nodes has in it, makes of x at the instants, at most; and one for who keeps tables."""
LINES = 28
"""INTO_PULL is read of the deck's tables up to the nodes only; they are no kind of their own."""


class Nodes(NamedTuple):
    """Eight Gauss nodes on 0 .. 1, and how to integrate between them."""

    at: np.ndarray
    """c_k, shape (8,)."""
    scale: np.ndarray
    """1 / prod_i (c_k - c_i), shape (8,)."""
    points: np.ndarray
    """Points and weights of the quadrature of a panel, on 0 .. 1, in lanes: shape (2, 3, 8)."""
    ends: np.ndarray
    """Sets of eight instants up to which there are tables, as fractions of the step: the nodes, and
    others; shape (sets, 8)."""
    within: np.ndarray
    """l_k so long before each of them as the quadrature of a panel from there to the beginning
    asks for, shape (sets, 8, POINTS, 8)."""
    beyond: np.ndarray
    """P_8 there, in lanes: shape (sets, 8, 3, 8)."""
    moments: np.ndarray
    """int_0^e (e - s)^m l_k(s) ds for each of these instants e, in lanes, a line for each k; in
    line 8 the same of P_8, in line 9 e^m; shape (sets, TERMS, 10, 8)."""


def gauss(count: int) -> np.ndarray:
    """Points and weights of Gauss' quadrature on 0 .. 1, shape (2, count)."""
    # To more digits than doubles have: numpy's are off by ten roundings.
    x: Any = np.asarray(legendre.leggauss(count)[0], np.longdouble)
    for _ in range(2):
        last, value = np.ones_like(x), x
        for n in range(1, count):
            last, value = value, ((2 * n + 1) * x * value - n * last) / (n + 1)
        slope = count * (last - x * value) / ((1 - x) * (1 + x))
        x = x - value / slope
    w = 2 / ((1 - x) * (1 + x) * slope**2)
    return np.array([0.5 * (1 + x), 0.5 * w], float)


def nodes(instants: Sequence[np.ndarray]) -> Nodes:
    """The nodes, and sets of eight instants beside them, in rising order."""
    at = gauss(NODES)[0]
    apart = at[:, None] - at[None, :] + np.eye(NODES)
    scale, ends = 1.0 / apart.prod(axis=1), np.array([at, *instants])
    points, groups = gauss(POINTS), (POINTS // NODES, NODES)
    before, share = ends[..., None] * points[:, None, None]
    within, beyond = aligned((*before.shape, NODES)), np.empty(before.shape)
    for place in np.ndindex(before.shape):
        ago = ends[place[:2]] - before[place]
        beyond[place] = polynomials.py_func(at, scale, ago, within[place])
    moments, power = aligned((len(ends), TERMS, NODES + 2, NODES)), np.arange(TERMS)[:, None]
    weights = share[:, None] * before[:, None] ** power[..., None]
    moments[:, :, :NODES] = np.einsum("smjp,sjpk->smkj", weights, within)
    moments[:, :, NODES] = np.einsum("smjp,sjp->smj", weights, beyond)
    moments[:, :, NODES + 1] = ends[:, None] ** power
    in_lanes, of_more = aligned((2, *groups)), aligned((*ends.shape, *groups))
    in_lanes[:], of_more[:] = points.reshape(2, *groups), beyond.reshape(*ends.shape, *groups)
    return Nodes(at, scale, in_lanes, ends, within, of_more, moments)


@numba.njit(**APART)
def impulse(c, k, t):  # type: ignore[no-untyped-def]
    """G(t) and G'(t) of x'' + c x' + k x = 0."""
    if k == 0.0 and c > 0.0:
        fallen = math.expm1(-c * t)
        return -fallen / c, 1.0 + fallen
    a = 0.5 * c
    if k > a * a:
        w, left = math.sqrt(k - a * a), math.exp(-a * t)
        cosine, sine = cos_sin(w * t)
        g = left * sine / w
        return g, left * cosine - a * g
    d = math.sqrt(a * a - k)
    if d == 0.0:
        left = math.exp(-a * t)
        return t * left, (1.0 - a * t) * left
    slow = k / (a + d)
    g = math.exp(-slow * t) * -math.expm1(-2.0 * d * t) / (2.0 * d)
    return g, math.exp(-(a + d) * t) - slow * g


@numba.njit(**APART)
def rates(c, k):  # type: ignore[no-untyped-def]
    """How fast the response changes at first; how fast that dies away; and the same of the rest."""
    a = 0.5 * c
    if k > a * a:
        return math.sqrt(k), a, math.sqrt(k), a
    d = math.sqrt(a * a - k)
    slow = k / (a + d) if d > 0.0 else a
    return a + d, a + d, slow, slow


@numba.njit(**APART)
def polynomials(at, scale, x, out):  # type: ignore[no-untyped-def]
    """l_k(x) into ``out``, shape (8,), x as a fraction of the step; returns P_8 there.

    A number or lanes, ``out`` alike.

    Args:
        at, scale: of the Nodes.
    """
    before = behind = 0.0 * x + 1.0
    for k in range(NODES):
        out[k] = before * scale[k]
        before *= x - at[k]
    for i in range(NODES):
        k = NODES - 1 - i
        out[k] *= behind
        behind *= x - at[k]
    return LEADING * behind


@numba.njit(**APART)
def fill(nodes, chosen, length, c, k, table):  # type: ignore[no-untyped-def]
    """The table of a step.

    Args:
        nodes: the Nodes.
        chosen: up to which of their sets of instants.
        length: h [s].
        c, k: not negative [1/s, 1/s^2].
        table: shape (LINES, 8), aligned.
    """
    if rates(c, k)[0] * length <= NEAR:
        sum_series(nodes.moments[chosen], length, c, k, table)
        return
    ends, most, unit = nodes.ends[chosen], 0.0, abs(last_unit(length, c, k))
    for j in range(NODES):
        if j > 0 and ends[j] == ends[j - 1]:
            for line in range(NUMBERS):
                table[line, j] = table[line, j - 1]
            continue
        end = length * ends[j]
        if rates(c, k)[0] * end <= REACH:
            beyond = integrate(nodes, chosen, j, end, c, k, table)
        else:
            beyond = integrate_far(nodes, j, end, length, c, k, table)
        most = max(most, abs(beyond))
        table[IMPULSE, j], table[IMPULSE_RATE, j] = impulse(c, k, end)
        table[UNIT, j] = 0.0
        for i in range(NODES):
            table[UNIT, j] += table[INTO_X + i, j]
        unit = max(unit, abs(table[UNIT, j]))
    finish(length, c, k, most, unit, table)


@numba.njit(**APART)
def finish(length, c, k, most, unit, table):  # type: ignore[no-untyped-def]
    """What follows from x and v, and the last line of a table, but for COUNT."""
    into = as_lanes(table)
    for i in range(NODES):
        into[INTO_PULL + i] = c * into[INTO_V + i] + k * into[INTO_X + i]
    table[NUMBERS, LENGTH], table[NUMBERS, DAMPING], table[NUMBERS, STIFFNESS] = length, c, k
    table[NUMBERS, BEYOND], table[NUMBERS, MOST_UNIT] = most, unit


@numba.njit(**APART)
def sum_series(moments, length, c, k, table):  # type: ignore[no-untyped-def]
    """The table of a step that is short: of ``fill``; ``moments`` of the set of instants.

    With G(t) = sum_m a_m (t/h)^m, (m + 1) (m + 2) a_m+2 = -(c h (m + 1) a_m+1 + k h^2 a_m).
    """
    into, beyond = as_lanes(table), zero_in_lanes()
    for line in range(NUMBERS):
        into[line] = 0.0
    this, following, at_end = 0.0, length, 0.0
    for m in range(TERMS):
        if abs(this) + abs(following) < NOTHING * length:
            break
        terms, rate = as_lanes(moments[m]), (m + 1) * following / length
        for i in range(NODES):
            into[INTO_X + i] += (length * this) * terms[i]
            into[INTO_V + i] += (length * rate) * terms[i]
        beyond += (length * this) * terms[NODES]
        into[IMPULSE] += this * terms[NODES + 1]
        into[IMPULSE_RATE] += rate * terms[NODES + 1]
        at_end += length * this / (m + 1)
        after = -(c * (m + 1) * following + k * length * this) * length / ((m + 1) * (m + 2))
        this, following = following, after
    for i in range(NODES):
        into[UNIT] += into[INTO_X + i]
    most, unit = 0.0, abs(at_end)
    into[NUMBERS] = beyond  # for a moment, to look at its lanes
    for j in range(NODES):
        most, unit = max(most, abs(table[NUMBERS, j])), max(unit, abs(table[UNIT, j]))
    finish(length, c, k, most, unit, table)


@numba.njit(**APART)
def integrate(nodes, chosen, j, end, c, k, table):  # type: ignore[no-untyped-def]
    """The integrals up to an instant into column j, in one panel; returns that of P_8 into x."""
    points, shares = as_lanes(nodes.points[0]), as_lanes(nodes.points[1])
    within, left_out = as_lanes(nodes.within[chosen, j]), as_lanes(nodes.beyond[chosen, j])
    into_x = into_v = beyond = zero_in_lanes()
    for group in range(POINTS // NODES):
        g, r = impulses(c, k, end * points[group], end)
        g, r = (end * shares[group]) * g, (end * shares[group]) * r
        into_x = product_onto(within, NODES * group, g, into_x)
        into_v = product_onto(within, NODES * group, r, into_v)
        beyond += g * left_out[group]
    put_column(into_x, table[INTO_X : INTO_X + NODES], j)
    put_column(into_v, table[INTO_V : INTO_V + NODES], j)
    return total(beyond)


@numba.njit(**APART)
def impulses(c, k, t, until):  # type: ignore[no-untyped-def]
    """G(t) and G'(t) at eight times up to one; to rounding beside what they are there."""
    a = 0.5 * c
    if k == 0.0 and c > 0.0:
        left = math.exp(-c * t)
        return (1.0 - left) / c, left
    if k > a * a:
        w, left = math.sqrt(k - a * a), math.exp(-a * t)
        cosine, sine = cos_sin(w * t)
        return left * sine / w, left * (cosine - (a / w) * sine)
    d = math.sqrt(a * a - k)
    slow, left = k / (a + d), math.exp(-(a + d) * t)
    if d * until > 1.0:
        g = (math.exp(-slow * t) - left) / (2.0 * d)
    else:
        # exp(-a t) sinh(d t) / d, where two exponentials cancel each other.
        square, term, sinh = (d * d) * (t * t), t, t
        for m in range(1, HYPERBOLIC):
            term = term * square * (1.0 / (2 * m * (2 * m + 1)))
            sinh += term
        g = math.exp(-a * t) * sinh
    return g, left - slow * g


@numba.njit(**APART)
def integrate_far(nodes, j, end, length, c, k, table):  # type: ignore[no-untyped-def]
    """The same in panels, as long as the response lasts."""
    points, shares, nothing = as_lanes(nodes.points[0]), as_lanes(nodes.points[1]), zero_in_lanes()
    sums, within = own_array(nothing, (2 * NODES,)), own_array(nothing, (NODES,))
    begin, beyond = 0.0, nothing
    for i in range(2 * NODES):
        sums[i] = nothing
    while begin < end:
        width = panel(c, k, begin, end)
        if width == 0.0:
            break
        for group in range(POINTS // NODES):
            ago = begin + width * points[group]
            g, r = impulses(c, k, ago, begin + width)
            g, r = (width * shares[group]) * g, (width * shares[group]) * r
            left_out = polynomials(nodes.at, nodes.scale, (end - ago) / length, within)
            for i in range(NODES):
                sums[i] += g * within[i]
                sums[NODES + i] += r * within[i]
            beyond += g * left_out
        begin += width
    for i in range(NODES):
        table[INTO_X + i, j], table[INTO_V + i, j] = total(sums[i]), total(sums[NODES + i])
    return total(beyond)


@numba.njit(**APART)
def last_unit(length, c, k):  # type: ignore[no-untyped-def]
    """U at the end of a step that is not short."""
    g, r = impulse(c, k, length)
    if k == 0.0:
        return (length - g) / c
    fast, _, slow, _ = rates(c, k)
    if slow * length > 0.1:
        return (1.0 - r - c * g) / k
    # Of what hardly begins to give way; the roots are far from each other.
    slowly, quickly = math.expm1(-slow * length) / slow, math.expm1(-fast * length) / fast
    return (quickly - slowly) / (fast - slow)


@numba.njit(**APART)
def panel(c, k, begin, end):  # type: ignore[no-untyped-def]
    """How long the next panel is, from ``begin`` to ``end`` at most; 0 where nothing is left."""
    fast, fades, slow, fades_slowly = rates(c, k)
    if begin * fades_slowly >= GONE:
        return 0.0
    rate = fast if begin * fades < GONE else slow
    return min(end - begin, REACH / rate) if rate > 0.0 else end - begin
