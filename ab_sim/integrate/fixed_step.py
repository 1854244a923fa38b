"""Fixed steps over one segment of the speed profile."""

from math import pi

import numba
import numpy as np

from ab_sim.dynamics.dispatch import INLINED, chosen_by
from ab_sim.dynamics.planar import gravity_on_rotating_axes, spindle_motion
from ab_sim.dynamics.settle import settle
from ab_sim.dynamics.switches import inlined_margins
from ab_sim.dynamics.system import TURNS, ball_count, has_events, has_gravity, has_motor
from ab_sim.integrate.compile_cache import compiled
from ab_sim.integrate.events import first_below, step_over_events, within_bounds
from ab_sim.integrate.on_stack import scratch_of, state_size
from ab_sim.integrate.one_step import inlined_derivatives

TWO_PI_REST = 2.4492935982947064e-16
"""2 pi less the floating-point number nearest to it."""


@compiled
def advance(system, place, weights, start, clock, length, state, modes, work, rows):  # type: ignore[no-untyped-def]
    """Take steps within one segment, recording every one; with none, only see to the branches.

    Args:
        system, place: what moves, and where it is along the speed profile.
        weights: the stepper's.
        start: time [s] at which the segment begins.
        clock: (number of the first step, nominal step [s], offset into it [s]). Times are
            products of these, not sums, so that they do not depend on how a run is cut up; the
            offset comes last, so that a segment of microseconds keeps its digits.
        length: step to take [s]: the nominal one, or a part of it next to a breakpoint.
        state: the state; holds the last good one at the end.
        modes: the branches in force; changed at events.
        work: a Workspace.
        rows: shape (steps, states + 3): the state after each step, angles with all their turns,
            the deck's acceleration, and the motor's torque.

    Returns:
        How many steps were taken; fewer than asked for if the state left its bounds.
    """
    first, step, offset = clock
    trial = work.trial
    states = state_size(system, state)
    enter(system, place, (first * step - start) + offset, state, modes, work)
    for k in range(rows.shape[0]):
        begin = ((first + k) * step - start) + offset
        end = ((first + k + 1) * step - start) + offset if length == step else begin + length
        known, A1, A2 = step_over_events(
            system, weights, place, begin, length, end, state, modes, work
        )
        if not within_bounds(trial, work.bounds):
            for j in range(states):
                rows[k, j] = trial[j]
            return k
        for j in range(states):
            state[j] = trial[j]
        turned = take_out_turns(system, state, modes)
        # The slope at the end of this step is the first stage of the next.
        if known and not turned:
            look_back(system, work)
        else:
            A1, A2 = enter(system, place, end, state, modes, work)
        record(system, place, end, state, modes, A1, A2, rows[k])
    return rows.shape[0]


@compiled
def acceleration_at(system, place, time, state, modes, work):  # type: ignore[no-untyped-def]
    """What an Observation needs beyond the state, at local ``time`` in the segment.

    Returns:
        The deck's acceleration [m/s^2] on the rotating axes, and the motor's torque [N m].
    """
    scratch = scratch_of(system, work)
    A1, A2, _ = inlined_derivatives(system, place, time, state, modes, work.slopes[0], scratch)
    spindle = spindle_motion(system, place, time, state, modes)
    g1, g2 = gravity_on_rotating_axes(system, spindle)
    return A1 + g1, A2 + g2, spindle.torque


@numba.njit(**INLINED)
def _enter(system, place, time, state, modes, work):  # type: ignore[no-untyped-def]
    scratch = scratch_of(system, work)
    A1, A2, _ = inlined_derivatives(system, place, time, state, modes, work.slopes[0], scratch)
    return A1, A2


@numba.njit(**INLINED)
def _enter_with_events(system, place, time, state, modes, work):  # type: ignore[no-untyped-def]
    A1, A2, al = inlined_derivatives(
        system, place, time, state, modes, work.slopes[0], work.scratch
    )
    look(system, place, time, state, modes, A1, A2, al, work)
    # Where the spindle's acceleration jumps, or events were too many to locate, what held so far
    # may hold no more; elsewhere nothing may change, or a run would depend on how it is cut up.
    if first_below(work.margin, work.margin, work.grain) >= 0:
        # Variables, because numba would compile all of it once more for literals.
        slot, plastic = np.int64(-1), work.counts[0] < 0
        A1, A2 = settle(system, place, time, state, modes, slot, plastic, work)
    return A1, A2


enter = chosen_by(has_events, _enter_with_events, _enter)
"""Slope, branches and margins at the beginning of steps; ``(system, place, time, state, modes,
work)``. Returns the deck's specific force A1, A2 [m/s^2] there."""


@numba.njit(**INLINED)
def _look(system, place, time, state, modes, A1, A2, al, work):  # type: ignore[no-untyped-def]
    inlined_margins(
        system, place, time, state, modes, A1, A2, al, work.scratch, work.margin, work.grain
    )


look = chosen_by(
    has_events, _look, lambda system, place, time, state, modes, A1, A2, al, work: None
)
"""Margins after ``derivatives``; ``(system, place, time, state, modes, A1, A2, al, work)``."""


@numba.njit(**INLINED)
def _look_back(system, work):  # type: ignore[no-untyped-def]
    slope = work.slopes[0]
    for j in range(slope.size):
        slope[j] = work.ahead[j]
    for slot in range(work.margin.size):
        work.margin[slot] = work.margin_ahead[slot]


look_back = chosen_by(has_events, _look_back, lambda system, work: None)
"""Take slope and margins over from the step's last trial; ``(system, work)``."""


@numba.njit(**INLINED)
def take_out_turns(system, state, modes):  # type: ignore[no-untyped-def]
    """Count whole turns of balls and spindle apart: an angle keeps its digits for ever.

    Returns:
        Whether there were any.
    """
    n, turned = ball_count(system), False
    for i in range(n):
        turned = unwind(state, 4 + i, modes, i) or turned
    if has_motor(system.effects):
        turned = unwind(state, 4 + 2 * n, modes, n) or turned
    return turned


@numba.njit(**INLINED)
def unwind(state, at, modes, i):  # type: ignore[no-untyped-def]
    """Bring one angle back into -2 pi .. 2 pi; whether it was not there."""
    turned = False
    while abs(state[at]) > 2.0 * pi:
        turn = 1.0 if state[at] > 0.0 else -1.0
        state[at] = (state[at] - turn * 2.0 * pi) - turn * TWO_PI_REST
        modes[i, TURNS] += int(turn)
        turned = True
    return turned


@numba.njit(**INLINED)
def record(system, place, time, state, modes, A1, A2, row):  # type: ignore[no-untyped-def]
    """One row of a run's samples."""
    n, states = ball_count(system), state_size(system, state)
    for j in range(states):
        row[j] = state[j]
    for i in range(n):
        row[4 + i] = state[4 + i] + 2.0 * pi * modes[i, TURNS]
    if has_motor(system.effects):
        row[4 + 2 * n] += 2.0 * pi * modes[n, TURNS]
    spindle = spindle_motion(system, place, time, state, modes)
    row[states] = A1
    row[states + 1] = A2
    if has_gravity(system.effects):
        g1, g2 = gravity_on_rotating_axes(system, spindle)
        row[states] += g1
        row[states + 1] += g2
    row[states + 2] = spindle.torque
