"""Gauss collocation with eight nodes, order 16: the reference of scenes without events.

    Y_i = y + h sum_j a_ij f(t + c_j h, Y_j),       y+ = y + h sum_j b_j f(t + c_j h, Y_j)

The method is implicit and belongs to another family than all methods that are compared with it.
(The package's rk8 and SciPy's DOP853 share their coefficients, so neither can judge the other.) The
stages are iterated to rounding. Increments are summed with Kahan's compensation, so that rounding
does not accumulate over the steps. Butcher (1964), Math. Comp. 18, 50-64.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from ab_sim.analysis.accuracy_cost.methods import FailedError
from ab_sim.analysis.accuracy_cost.right_hand_side import RightHandSide
from ab_sim.engine.compiling import compiled
from ab_sim.engine.compiling.kinds import Floats, Table, call
from ab_sim.engine.integrate.vector_field import Field
from ab_sim.model.dynamics.assemble import linear_rates

NODES, ITERATIONS = 8, 60
LONGEST = 1e-3
"""Longest step [s]."""
REACH = 1.0
"""Largest product of step and fastest rate; the iteration then converges in about 20 rounds."""
SETTLED = 3e-16
"""Change at which the iteration ends, relative to each state's magnitude."""


class CollocationCoefficients(NamedTuple):
    """Butcher tableau: nodes c, matrix a and weights b; shapes (s,), (s, s), (s,) for s nodes."""

    c: np.ndarray
    a: np.ndarray
    b: np.ndarray


class CollocationSteps(NamedTuple):
    """Equations, coefficients and work arrays for steps."""

    field: Field
    c: Floats
    a: Table
    b: Floats
    scale: Floats
    """Magnitudes of the states, shape (states,)."""
    rest: Floats
    """Kahan compensation of the state, shape (states,)."""
    slopes: Table
    """Slopes at the nodes, shape (nodes, states)."""
    ahead: Table
    """Slopes of the next iteration, shape (nodes, states)."""
    trial: Floats
    """State at a node, shape (states,)."""


class Clock(NamedTuple):
    """Times of consecutive steps."""

    begin: float
    """Local time at the begin [s]."""
    length: float
    """Length of each step [s]."""
    steps: int


def lagrange(nodes: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return the Lagrange basis l_j on ``nodes`` at the points ``at``, shape (at, nodes)."""
    rows = [[np.prod([(t - y) / (x - y) for y in nodes if y != x]) for x in nodes] for t in at]
    return np.array(rows)


def integration(nodes: np.ndarray) -> np.ndarray:
    """Return Q_mj, the integral of l_j from 0 to c_m, by Gauss quadrature, exact up to rounding.

    Integrating in the monomial basis would lose four digits at eight nodes.
    """
    x, w = legendre.leggauss((len(nodes) + 1) // 2)
    return np.array([c / 2.0 * (w @ lagrange(nodes, c * (x + 1.0) / 2.0)) for c in nodes])


def gauss_nodes(count: int = NODES) -> CollocationCoefficients:
    """Return the coefficients of the method with ``count`` nodes."""
    x, w = legendre.leggauss(count)
    c = (x + 1.0) / 2.0
    return CollocationCoefficients(c, integration(c), w / 2.0)


def step_for(f: RightHandSide) -> float:
    """Return the longest step at which the iteration converges [s]."""
    rates = linear_rates(f.system, f.scene.spindle.max_speed).values()
    return min([LONGEST, *(REACH / abs(rate) for rate in rates if rate)])


def collocate(f: RightHandSide, longest: float) -> np.ndarray:
    """Return the states at the sample times by collocation, shape (samples, states).

    Args:
        f: right-hand side of the scene.
        longest: longest step [s].

    Raises:
        FailedError: the iteration does not converge at this step.
    """
    nodes, state, rest = gauss_nodes(), f.start.copy(), np.zeros(f.start.size)
    shape = (NODES, state.size)
    room = np.empty(shape), np.empty(shape), state.copy()
    kept = []
    for leg in f.legs:
        steps_of = CollocationSteps(leg.field.emitted, *nodes, f.scale, rest, *room)
        states = [state.copy()]
        for begin, end in zip(leg.grid[:-1], leg.grid[1:], strict=True):
            steps = math.ceil((end - begin) / longest - 1e-9)
            length = (end - begin) / steps
            local = begin - leg.start
            if not compiled(take_steps)(steps_of, Clock(local, length, steps), state):
                raise FailedError(
                    f"collocation does not converge at t = {begin:.6g} s with steps of {length:g} s"
                )
            states.append(state.copy())
        kept.append(np.array(states)[leg.keep])
    return np.concatenate(kept)


def take_steps(collocation_steps: CollocationSteps, clock: Clock, state: Floats) -> bool:
    """Take collocation steps; update ``state`` and its compensation ``collocation_steps.rest``.

    Args:
        collocation_steps: equations, method and work arrays.
        clock: begin, length and number of the steps.
        state: state at the begin, shape (states,); overwritten by the state at the end.

    Returns:
        Whether the iterations converged.
    """
    field, slopes, ahead, trial, rest = (
        collocation_steps.field,
        collocation_steps.slopes,
        collocation_steps.ahead,
        collocation_steps.trial,
        collocation_steps.rest,
    )
    count, states = collocation_steps.c.size, state.size
    for step in range(clock.steps):
        time = clock.begin + step * clock.length
        call(field.slope, field.c, field.b, state, trial, time)
        for i in range(count):
            for j in range(states):
                slopes[i, j] = trial[j]
        # Fixed-point iteration of all stages from the slope at the step's start. It converges
        # because ``step_for`` limits the step by the fastest rate.
        settled, change = False, math.inf
        for _ in range(ITERATIONS):
            change = 0.0
            for i in range(count):
                for j in range(states):
                    total = rest[j]
                    for k in range(count):
                        total += clock.length * collocation_steps.a[i, k] * slopes[k, j]
                    trial[j] = state[j] + total
                at = time + collocation_steps.c[i] * clock.length
                call(field.slope, field.c, field.b, trial, ahead[i], at)
                for j in range(states):
                    moved = (
                        abs(ahead[i, j] - slopes[i, j]) * clock.length / collocation_steps.scale[j]
                    )
                    # Negated comparison, so that a NaN counts as a change.
                    if not moved <= change:
                        change = moved
            for i in range(count):
                for j in range(states):
                    slopes[i, j] = ahead[i, j]
            if change <= SETTLED:
                settled = True
                break
            if not change < 1e9:
                break
        # Rounding may keep the last digits from settling: accept changes up to 100 times as large.
        if not settled and not change <= 100.0 * SETTLED:
            return False
        for j in range(states):
            total = rest[j]
            for k in range(count):
                total += clock.length * collocation_steps.b[k] * slopes[k, j]
            summed = state[j] + total
            rest[j] = total - (summed - state[j])
            state[j] = summed
    return True
