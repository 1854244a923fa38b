"""Collocation for stiff drag: drag is solved for, all else is iterated.

A step y' = f_E(y) + f_I(y), with f_I the response of deck, balls and spindle to the race's linear
drag, is done on nodes c_1 .. c_M of Radau's right-hand quadrature, in sweeps

    Y_m = y_0 + h sum_j Q_mj [ f_E(Y'_j) + f_I(Y_j) ],        Y' the sweep before,

Q integrating the polynomial through the nodes. Each sweep gains one order, however stiff the drag
is; the first sweeps have fewer nodes, and f_E is interpolated from their nodes to the next ones'.
Dutt, Greengard and Rokhlin (2000), BIT 40: spectral deferred corrections; Minion (2003), Commun.
Math. Sci. 1: semi-implicit ones. Solving for the drag on all nodes at once, instead of a
Gauss-Seidel sweep, keeps the order where the drag is stiff: with the sweep it fell to between 0
and 2 at drag rates times step of 10 to 100.

The linear equations for f_I are one elimination of the balls, O(n): see drag_response.py.
"""

import functools
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.polynomial import legendre

from ab_sim.dynamics.dispatch import APART
from ab_sim.dynamics.drag_response import drag_response, drag_responses, equations_at_node
from ab_sim.dynamics.slope import equations, evaluate
from ab_sim.dynamics.spindle_motion import spindle_motion
from ab_sim.dynamics.system import Plant, ball_count
from ab_sim.integrate.registry import register
from ab_sim.integrate.stepper import Stepper

DRAG_GRID = -np.concatenate([[0.0], np.logspace(-2, 6, 25)])
"""Drag rates times step for which growth is looked at."""


class SweepWeights(NamedTuple):
    """Nodes and integration matrices as arrays, as the compiled loop takes them."""

    sizes: np.ndarray
    """Nodes of each sweep, shape (K,)."""
    nodes: np.ndarray
    """c, as fractions of the step, shape (K, M)."""
    integrate: np.ndarray
    """Q, shape (K, M, M)."""
    carry: np.ndarray
    """Q times the interpolation from 0 and the nodes of the sweep before, shape (K, M, M + 1)."""

    def step(self, plant: Any, begin: float, length: float, state: Any, work: Any) -> None:
        """See ``Stepper.weights``."""
        sweep_step(self, plant, begin, length, state, work)


def growth_of(weights: SweepWeights, z: complex) -> complex:
    """What one step makes of y' = lambda_E y at z = step times lambda_E.

    The largest of what it makes of it with any amount of drag beside it, up to the growth of
    modulus; of the drag itself any amount is stable.
    """
    y = np.ones((DRAG_GRID.size, 1), dtype=complex)
    for k, m in enumerate(weights.sizes):
        q, carry = weights.integrate[k, :m, :m], weights.carry[k, :m, : y.shape[1]]
        right = 1.0 + z * (y @ carry.T)
        matrix = np.eye(m) - DRAG_GRID[:, None, None] * q
        nodes = np.linalg.solve(matrix, right[:, :, None])[:, :, 0]
        y = np.concatenate([np.ones((DRAG_GRID.size, 1)), nodes], axis=1)
    return complex(max(y[:, -1], key=abs))


def radau_right(m: int) -> np.ndarray:
    """The m nodes of Radau's quadrature on (0, 1] with the right end, roots of P_m - P_m-1."""
    p = np.zeros(m + 1)
    p[m - 1 :] = -1.0, 1.0
    x = np.sort(legendre.legroots(p).real)
    for _ in range(2):  # Newton's steps to the last digit.
        x -= legendre.legval(x, p) / legendre.legval(x, legendre.legder(p))
    x[-1] = 1.0
    return np.asarray((x + 1.0) / 2.0)


def lagrange(nodes: np.ndarray, at: np.ndarray) -> np.ndarray:
    """l_j(at_a): what the polynomial through data on ``nodes`` is there, shape (at, nodes)."""
    rows = [[np.prod([(t - y) / (x - y) for y in nodes if y != x]) for x in nodes] for t in at]
    return np.array(rows)


def integration(nodes: np.ndarray) -> np.ndarray:
    """Q_mj, the integral of l_j from 0 to c_m, by Gauss' quadrature, exactly."""
    x, w = legendre.leggauss((len(nodes) + 1) // 2 + 1)
    return np.array([c / 2.0 * (w @ lagrange(nodes, c * (x + 1.0) / 2.0)) for c in nodes])


def sweeps_on(name: str, order: int, sizes: tuple[int, ...]) -> Stepper:
    """The method whose sweeps have these numbers of nodes."""
    k, m = len(sizes), max(sizes)
    nodes, integrate = np.zeros((k, m)), np.zeros((k, m, m))
    carry = np.zeros((k, m, m + 1))
    before = np.zeros(1)
    for i, size in enumerate(sizes):
        c = radau_right(size)
        q = integration(c)
        nodes[i, :size], integrate[i, :size, :size] = c, q
        carry[i, :size, : before.size] = q @ lagrange(before, c)
        before = np.concatenate([[0.0], c])
    source = (
        "Minion (2003), Commun. Math. Sci. 1, 471-500, the drag solved for on all nodes at once"
    )
    weights = SweepWeights(np.array(sizes, np.int64), nodes, integrate, carry)
    return Stepper(
        name,
        order,
        source,
        weights,
        evaluations=sum(sizes[:-1]) + 1,
        growth=functools.partial(growth_of, weights),
        slopes=2 + 4 * m,
        nodes=m,
        solves_drag=True,
    )


SWEEPS = register(sweeps_on("sweeps", 7, (1, 2, 3, 4, 4, 4, 4)))


@numba.njit(**APART)
def sweep_step(weights, plant, begin, length, state, work):  # type: ignore[no-untyped-def]
    """One step of the method; see ``Stepper.weights``."""
    slopes, trial, system = work.slopes, work.trial, plant.system
    # The caller's room: nodes have theirs behind it.
    own = Plant(system, plant.place, plant.modes, work.room)
    n, states, most = ball_count(system), state.size, weights.nodes.shape[1]
    # Rows of slopes: f(y0); f_E at 0 and the nodes; at the nodes Y, f_I, and Y without f_I.
    known, at_node = 1, 2 + most
    response, bare = at_node + most, at_node + 2 * most
    equations(own, spindle_motion(own, begin, state), state)
    drag_response(own, state, slopes[response])
    for j in range(states):
        slopes[known, j] = slopes[0, j] - slopes[response, j]
    before = 1
    for k in range(weights.sizes.size):
        size = weights.sizes[k]
        for m in range(size):
            for j in range(states):
                total = 0.0
                for i in range(before):
                    total += weights.carry[k, m, i] * slopes[known + i, j]
                slopes[bare + m, j] = state[j] + length * total
            equations_at_node(own, m, begin + weights.nodes[k, m] * length, slopes[bare + m])
        drag_responses(
            own,
            length,
            weights.integrate[k, :size, :size],
            slopes[bare : bare + size],
            slopes[response : response + size],
            work.room.table[(1 + most) * n :],
        )
        for m in range(size):
            for j in range(states):
                total = 0.0
                for i in range(size):
                    total += weights.integrate[k, m, i] * slopes[response + i, j]
                slopes[at_node + m, j] = slopes[bare + m, j] + length * total
        if k + 1 == weights.sizes.size:
            break
        for m in range(size):
            time = begin + weights.nodes[k, m] * length
            evaluate(own, time, slopes[at_node + m], slopes[known + 1 + m])
            for j in range(states):
                slopes[known + 1 + m, j] -= slopes[response + m, j]
        before = size + 1
    for j in range(states):
        trial[j] = slopes[at_node + weights.sizes[weights.sizes.size - 1] - 1, j]
