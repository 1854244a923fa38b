"""Fixed steps of an explicit Runge-Kutta method over one segment of the speed profile."""

from typing import NamedTuple

import numpy as np

from ab_sim.dynamics.planar import deck_acceleration_of, derivatives
from ab_sim.integrate.compile_cache import compiled


class Workspace(NamedTuple):
    """Arrays that a run reuses."""

    slopes: np.ndarray
    """Shape (stages, states)."""
    trial: np.ndarray
    """Shape (states,)."""
    scratch: np.ndarray
    """Shape (balls, WIDTH)."""
    bounds: np.ndarray
    """Shape (states,): magnitudes that no sound run reaches."""


@compiled
def advance(system, segment, weights, start, clock, length, state, work, rows):  # type: ignore[no-untyped-def]
    """Take steps within one segment, recording every one.

    Args:
        system, segment: what moves, and the spindle-speed segment in force.
        weights: the tableau's Weights.
        start: time [s] at which the segment begins.
        clock: (number of the first step, nominal step [s], offset into it [s]). Times are
            products of these, not sums, so that they do not depend on how a run is cut up.
        length: step to take [s]: the nominal one, or a part of it next to a breakpoint.
        state: the state; holds the last good one at the end.
        work: a Workspace.
        rows: shape (steps, states + 2): the state after each step, and the deck's acceleration.

    Returns:
        How many steps were taken; fewer than asked for if the state left its bounds.
    """
    first, step, offset = clock
    slopes, trial, scratch, bounds = work
    stages, states = weights.b.size, state.size
    for k in range(rows.shape[0]):
        begin = ((first + k) * step + offset) - start
        if k == 0:
            derivatives(system, segment, begin, state, slopes[0], scratch)
        for stage in range(1, stages):
            for j in range(states):
                trial[j] = 0.0
            for earlier in range(stage):
                weight = weights.a[stage, earlier]
                if weight != 0.0:
                    for j in range(states):
                        trial[j] += weight * slopes[earlier, j]
            for j in range(states):
                trial[j] = state[j] + length * trial[j]
            derivatives(
                system, segment, begin + weights.c[stage] * length, trial, slopes[stage], scratch
            )
        for j in range(states):
            trial[j] = 0.0
        for stage in range(stages):
            for j in range(states):
                trial[j] += weights.b[stage] * slopes[stage, j]
        finite = True
        for j in range(states):
            trial[j] = state[j] + length * trial[j]
            # Written so that a NaN fails too.
            if not abs(trial[j]) < bounds[j]:
                finite = False
        if not finite:
            for j in range(states):
                rows[k, j] = trial[j]
            return k
        for j in range(states):
            state[j] = trial[j]
            rows[k, j] = trial[j]
        # The slope at the end of this step is the first stage of the next.
        end = ((first + k + 1) * step + offset) - start if length == step else begin + length
        derivatives(system, segment, end, state, slopes[0], scratch)
        A1, A2 = deck_acceleration_of(segment, end, state, slopes[0])
        rows[k, states] = A1
        rows[k, states + 1] = A2
    return rows.shape[0]


@compiled
def acceleration_at(system, segment, time, state, work):  # type: ignore[no-untyped-def]
    """The deck's acceleration A [m/s^2] on the rotating axes at local ``time`` in the segment."""
    derivatives(system, segment, time, state, work.slopes[0], work.scratch)
    return deck_acceleration_of(segment, time, state, work.slopes[0])
