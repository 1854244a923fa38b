"""Gauss' nodes, and what follows from them alone: weights, matrices, integrals of powers.

For Python, before a run. A step is 0 .. 1 here; l_k are the nodes' Lagrange polynomials, P_N is
Legendre's polynomial on 0 .. 1 that vanishes at the nodes.
"""

import functools
import math
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import legendre

from ab_sim.compiling.kinds import Cube, Floats, Integers, IntegerTable, Table

TERMS = 34
"""Of a power series, at most: for rates times times up to 4 the next one is less than rounding."""
BACK = 4
"""How many of the last coefficients say how large an error is."""
PIECES = 16
"""Of a step, in each of which an event function is told apart from zero or is not."""


class CollocationNodes(NamedTuple):
    """What is made of N nodes, and of the sets of instants up to which there are tables.

    The instants of a set are reached on a chain of stops, so near each other that a response is
    summed as a power series from one to the next.
    """

    at: Floats
    """c_k, shape (N,)."""
    scale: Floats
    """1 / prod_i (c_k - c_i), shape (N,)."""
    leading: float
    """Of x^N in P_N."""
    legendre: Table
    """(2 p + 1) w_k P_p(c_k) for powers p = 0, 1 .. of polynomials that are carried on into the
    next step, shape (N, powers)."""
    points: Table
    """Points and weights of a quadrature on 0 .. 1, where a response is too fast for a series;
    shape (2, points)."""
    stops: Table
    """Where each set's chain stops, shape (sets, stops); those behind the last are 2."""
    columns: IntegerTable
    """Which column of a table a stop fills, or -1; shape (sets, stops). Columns behind the last one
    that is filled are like it."""
    begins: Integers
    """Whether a set's chain goes on from where that of the set before ended, 1, or begins at 0;
    shape (sets,)."""
    moments: Cube
    """For each stop, at e, d behind the one before: the integrals of (e - s)^m l_k(s) over that
    piece, k = 0 .. N - 1, the same of P_N, and d^m; shape (sets * stops, TERMS, N + 2)."""
    counts: Integers
    """How many samples a step may have, shape (counts,)."""
    first_sets: Integers
    """Which set is the first with so many samples; others follow, N samples each."""


@functools.cache
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


def legendre_values(power: int, x: np.ndarray) -> np.ndarray:
    """Return Legendre's polynomial of a power at places from -1 to 1.

    Clenshaw's recursion. The order of operations of numpy's own changes with its version.
    """
    if power == 0:
        return np.ones_like(x)
    before: Any = 0.0
    last: Any = 1.0
    for n in range(power, 1, -1):
        before, last = -last * ((n - 1) / n), before + last * x * ((2 * n - 1) / n)
    return np.asarray(before + last * x)


@functools.cache
def nodes(count: int, samples: tuple[int, ...], powers: int) -> CollocationNodes:
    """The nodes of a step, and the sets of instants of its samples; made once, for all runs.

    Args:
        count: N.
        samples: how many samples a step may have, rising.
        powers: how many of Legendre's polynomials are carried on into the next step, N at most.
    """
    at, share = gauss(count)
    apart = at[:, None] - at[None, :] + np.eye(count)
    scale = 1.0 / apart.prod(axis=1)
    leading = float(math.comb(2 * count, count))
    chains: list[tuple[list[float], list[int], int]] = [(at.tolist(), list(range(count)), 0)]
    first_sets = []
    for number in samples:
        first_sets.append(len(chains))
        for group in range(0, number, count):
            chains.append(_chain(number, group, count))
    sets = len(chains)
    stops, columns = np.full((sets, count), 2.0), np.full((sets, count), -1)
    moments = np.zeros((sets * count, TERMS, count + 2))
    for s, (places, filled, goes_on) in enumerate(chains):
        stops[s, : len(places)], columns[s, : len(places)] = places, filled
        begin = chains[s - 1][0][-1] if goes_on else 0.0
        for j, end in enumerate(places):
            moments[s * count + j] = _moments(at, scale, leading, begin, end)
            begin = end
    values = np.array([legendre_values(p, 2.0 * at - 1.0) for p in range(powers)])
    return CollocationNodes(
        at,
        scale,
        leading,
        ((2.0 * np.arange(powers)[:, None] + 1.0) * share * values).T.copy(),
        gauss(max(24, 3 * count)),
        stops,
        columns.astype(np.int64),
        np.array([goes_on for _, _, goes_on in chains], np.int64),
        moments,
        np.array(samples, np.int64),
        np.array(first_sets, np.int64),
    )


def _chain(number: int, group: int, count: int) -> tuple[list[float], list[int], int]:
    """Stops of a group of samples, the columns that they fill, and whether it goes on."""
    here = min(number - group, count)
    between = max(count // (number if group == 0 else count), 1)
    places = [(group + j + (k + 1) / between) / number for j in range(here) for k in range(between)]
    filled = [j if k == between - 1 else -1 for j in range(here) for k in range(between)]
    return places, filled, int(group > 0)


def _moments(
    at: np.ndarray, scale: np.ndarray, leading: float, begin: float, end: float
) -> np.ndarray:
    """See ``CollocationNodes.moments``, of one piece."""
    long: Any = np.longdouble
    d = long(end) - long(begin)
    before, weights, powers, of_length = _powers(d)
    apart = (long(end) - before)[:, None] - at.astype(long)
    product = apart.prod(axis=1)
    lagrange = product[:, None] / apart * scale
    functions = np.concatenate([lagrange, (leading * product)[:, None]], axis=1)
    found = (powers * weights) @ functions
    return np.concatenate([found, of_length], axis=1).astype(float)


@functools.cache
def _powers(d: Any) -> tuple[Any, ...]:
    """Of a piece as long as that, which many are.

    Points of a quadrature, and weights; powers of the points, and of the length itself.
    """
    points, weights = (np.longdouble(each) for each in gauss(32))
    powers = np.arange(TERMS)[:, None]
    return d * points, d * weights, (d * points)[None, :] ** powers, d**powers


def last_coefficients(at: np.ndarray, share: np.ndarray) -> np.ndarray:
    """The matrix from values at the nodes to a polynomial's last coefficients by Legendre's.

    Args:
        at, share: the nodes and their weights, shape (N,).

    Returns:
        Column by column, shape (N, N): lines for the last BACK coefficients, the last first, and
        else zeros.
    """
    count = len(at)
    found = np.zeros((count, count))
    for back in range(min(BACK, count)):
        power = count - 1 - back
        values = legendre_values(power, 2.0 * at - 1.0)
        found[:, back] = (2 * power + 1) * share * values
    return found


def bounds_within_pieces(at: np.ndarray) -> np.ndarray:
    """Matrices from values at the nodes to Bernstein's coefficients on 0 .. 1 and on its pieces.

    A polynomial on a piece lies within its coefficients there.

    Args:
        at: the nodes, shape (N,).

    Returns:
        Shape (PIECES + 1, N, N), coefficients in columns; the last is that of all pieces together.
    """
    most, one = len(at) - 1, 2**80
    # In whole numbers, and rounded once: what solves linear equations rounds as its kernel does.
    roots = [int(Fraction(x) * one) for x in at.tolist()]
    found = np.empty((PIECES + 1, len(at), len(at)))
    for piece in range(PIECES + 1):
        begin, end = 0, one
        if piece < PIECES:
            begin, end = piece * one // PIECES, (piece + 1) * one // PIECES
        for k, own in enumerate(roots):
            # The coefficients of prod_i (x - c_i) are those of prod_i (begin - c_i + (end - c_i) z)
            # by powers of z, each over its binomial coefficient.
            product, size = [1], 1
            for root in roots[:k] + roots[k + 1 :]:
                low, high = begin - root, end - root
                product = [
                    low * this + high * before
                    for this, before in zip([*product, 0], [0, *product], strict=True)
                ]
                size *= own - root
            found[piece, k] = [
                coefficient / (size * math.comb(most, b)) for b, coefficient in enumerate(product)
            ]
    return found
