"""What x'' + c x' + k x = f(t) makes of an f that is a polynomial through eight Gauss nodes.

For a step of length h with nodes t_j, and G the response to a unit impulse,

    x(t) = (1 - k U(t)) x_0 + G(t) v_0 + sum_k f_k int_0^t G(t - s) l_k(s) ds
    v(t) = -k G(t) x_0 + G'(t) v_0     + sum_k f_k int_0^t G'(t - s) l_k(s) ds

with U the response to f = 1, and l_k the nodes' Lagrange polynomials: exact however large c h and
k h^2 are. Tables hold the integrals up to eight instants, each line in lanes. A ball under linear
drag has k = 0; with c = 0 as well, v is the plain integral of f.
"""

import math
from typing import NamedTuple

import numba
import numpy as np
from numpy.polynomial import legendre

from ab_sim.dynamics.dispatch import APART
from ab_sim.dynamics.numbers.kinds import EIGHT

NODES = EIGHT
LEADING = 12870.0
"""Of x^8 in P_8 on 0 .. 1."""
POINTS = 16
"""Of the quadrature on each panel."""
REACH = 5.0
"""Rate times length of a panel: there the quadrature is right to rounding."""
GONE = 40.0
"""Decay rate times time after which a response is nothing any more."""

INTO_X, INTO_V, UNIT, IMPULSE, IMPULSE_RATE, NUMBERS = 0, 8, 16, 17, 18, 19
"""Lines of a table: the integrals into x and v at eight instants, a line for each k; U, G and G'
there; and numbers:"""
LENGTH, DAMPING, STIFFNESS, MOST_UNIT, BEYOND, COUNT = range(6)
"""h [s]; c, k; U at most; what f = P_8, the first of Legendre's polynomials that none through
the nodes has in it, makes of x at the instants, at most; and one for who keeps tables."""
LINES = 20


class Nodes(NamedTuple):
    """Eight Gauss nodes on 0 .. 1, and how to integrate between them."""

    at: np.ndarray
    """c_k, shape (8,)."""
    scale: np.ndarray
    """1 / prod_i (c_k - c_i), shape (8,)."""
    points: np.ndarray
    """Points and weights of the quadrature of a panel, on 0 .. 1, shape (2, POINTS)."""


def gauss(count: int) -> np.ndarray:
    """Points and weights of Gauss' quadrature on 0 .. 1, shape (2, count)."""
    x, w = legendre.leggauss(count)
    return np.array([0.5 * (1.0 + x), 0.5 * w])


def nodes() -> Nodes:
    """The nodes."""
    at = gauss(NODES)[0]
    apart = at[:, None] - at[None, :] + np.eye(NODES)
    return Nodes(at, 1.0 / apart.prod(axis=1), gauss(POINTS))


@numba.njit(**APART)
def impulse(c, k, t):  # type: ignore[no-untyped-def]
    """G(t) and G'(t) of x'' + c x' + k x = 0."""
    a = 0.5 * c
    if k > a * a:
        w, left = math.sqrt(k - a * a), math.exp(-a * t)
        g = left * math.sin(w * t) / w
        return g, left * math.cos(w * t) - a * g
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
def polynomials(nodes, x, out):  # type: ignore[no-untyped-def]
    """l_k(x) into ``out``, shape (8,), x as a fraction of the step; returns P_8 there."""
    before = 1.0
    for k in range(NODES):
        out[k] = before * nodes.scale[k]
        before *= x - nodes.at[k]
    behind = 1.0
    for i in range(NODES):
        k = NODES - 1 - i
        out[k] *= behind
        behind *= x - nodes.at[k]
    return LEADING * behind


@numba.njit(**APART)
def fill(nodes, length, c, k, ends, values, table):  # type: ignore[no-untyped-def]
    """The table of a step.

    Args:
        nodes: the Nodes.
        length: h [s].
        c, k: not negative [1/s, 1/s^2].
        ends: the instants as fractions of the step, shape (8,).
        values: room for eight numbers.
        table: shape (LINES, 8).
    """
    fast, fades, slow, fades_slowly = rates(c, k)
    table[NUMBERS, MOST_UNIT] = table[NUMBERS, BEYOND] = 0.0
    for j in range(NODES + 1):
        end = length * (ends[j] if j < NODES else 1.0)
        for i in range(NODES):
            if j < NODES:
                table[INTO_X + i, j] = table[INTO_V + i, j] = 0.0
        t, beyond, last = 0.0, 0.0, 0.0
        while t < end and t * fades_slowly < GONE:
            rate = fast if t * fades < GONE else slow
            width = end - t
            if rate * width > REACH:
                width = REACH / rate
            for p in range(POINTS):
                ago = t + width * nodes.points[0, p]
                g, r = impulse(c, k, ago)
                weight = width * nodes.points[1, p]
                if j == NODES:
                    last += weight * g
                    continue
                beyond += weight * g * polynomials(nodes, (end - ago) / length, values)
                for i in range(NODES):
                    table[INTO_X + i, j] += weight * g * values[i]
                    table[INTO_V + i, j] += weight * r * values[i]
            t += width
        table[NUMBERS, MOST_UNIT] = max(table[NUMBERS, MOST_UNIT], abs(last))
        if j < NODES:
            table[NUMBERS, BEYOND] = max(table[NUMBERS, BEYOND], abs(beyond))
            table[IMPULSE, j], table[IMPULSE_RATE, j] = impulse(c, k, end)
    table[NUMBERS, LENGTH] = length
    table[NUMBERS, DAMPING], table[NUMBERS, STIFFNESS] = c, k
    for j in range(NODES):
        table[UNIT, j] = 0.0
        for i in range(NODES):
            table[UNIT, j] += table[INTO_X + i, j]
        table[NUMBERS, MOST_UNIT] = max(table[NUMBERS, MOST_UNIT], abs(table[UNIT, j]))
