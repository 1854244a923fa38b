"""Fixed steps over one segment of the speed profile."""

from math import pi
from typing import Any

import numba
from numba.extending import overload

from ab_sim.dynamics.calling import address_of, callback
from ab_sim.dynamics.dispatch import INLINED, chosen_by, effect_class
from ab_sim.dynamics.layout import angle_at, spindle_angle_at, state_size
from ab_sim.dynamics.race.calls import CALLS, EVALUATE, KICK, RESTITUTION, TAKE_STEP, Calls
from ab_sim.dynamics.race.race import race_of
from ab_sim.dynamics.slope import evaluate, inlined_evaluate
from ab_sim.dynamics.spindle_motion import spindle_motion
from ab_sim.dynamics.system import (
    TURNS,
    Plant,
    ball_count,
    carrier_outputs,
    has_events,
    has_motor,
    kick,
    output,
    restitution,
    straighten,
)
from ab_sim.integrate.compile_cache import compiled
from ab_sim.integrate.events import RACE, WORK, call_events, within_bounds
from ab_sim.integrate.on_stack import room_of, stage_room_of
from ab_sim.integrate.stepper import step

TWO_PI_REST = 2.4492935982947064e-16
"""2 pi less the floating-point number nearest to it."""


@compiled
def advance(  # type: ignore[no-untyped-def]
    system, place, weights, start, clock, length, state, modes, work, events, rows, sample
):
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
        events: ``events.events_address()``; of no account where the system has none.
        rows: shape (steps, ``row_width``): the state after each step, angles with all their turns,
            what the carrier gives beyond it, and the motor's torque.
        sample: shape (row_width,): a row of the state as it is, instead of any steps; or (0,).

    Returns:
        How many steps were taken; fewer than asked for if the state left its bounds.
    """
    return march(
        weights, system, place, start, clock, length, state, modes, work, events, rows, sample
    )


@numba.njit(**INLINED)
def step_by_step(  # type: ignore[no-untyped-def]
    weights, system, place, start, clock, length, state, modes, work, events, rows, sample
):
    """``advance`` with a stepper whose steps are the scene's."""
    first, nominal, offset = clock
    trial, steps = work.trial, rows.shape[0]
    plant = Plant(system, place, modes, room_kept(system, work))
    owner = owner_of(plant, weights, work)
    own = Calls(
        take_context(owner),
        at_evaluate(owner),
        at_take_step(owner),
        at_restitution(owner),
        at_kick(owner),
    )
    calls = (
        take_calls(own),
        take_race(race_if_needed(plant)),
        take_work(work_if_needed(plant, work)),
    )
    known = False
    for k in range(steps + 1):
        begin = ((first + k) * nominal - start) + offset
        if k > 0 and length != nominal:
            begin = ((first + k - 1) * nominal - start) + offset + length
        # The slope at the end of a step is the first stage of the next.
        if known:
            look_back(plant, work)
        else:
            inlined_evaluate(plant, begin, state, work.slopes[0])
            if sample.size == 0:
                enter(plant, calls, work, events, begin, state)
        if k > 0:
            record(plant, begin, state, rows[k - 1])
        elif sample.size > 0:
            record(plant, begin, state, sample)
        if k == steps:
            break
        end = ((first + k + 1) * nominal - start) + offset if length == nominal else begin + length
        known = step_over_events(plant, weights, calls, work, events, begin, length, end, state)
        if not within_bounds(trial, work.bounds):
            for j in range(state_size(system, state)):
                rows[k, j] = trial[j]
            return k
        for j in range(state_size(system, state)):
            state[j] = trial[j]
        known = not unwind(plant, state) and known
    return steps


def march(weights: Any, *arguments: Any) -> int:
    """``advance`` as the stepper does it."""
    raise TypeError("is called by compiled code only")


@overload(march, jit_options=INLINED, strict=False)
def _march(weights, *arguments):  # type: ignore[no-untyped-def]
    own = getattr(effect_class(weights), "march", None)
    return own or step_by_step.py_func


def row_width(states: int, outputs: int) -> int:
    """Columns of a row: the states, what the carrier gives, the motor's torque [N m]."""
    return states + outputs + 1


@numba.njit(**INLINED)
def _evaluate(owner, time, state, slope):  # type: ignore[no-untyped-def]
    evaluate(owner[0], time, state, slope)
    return 0


@numba.njit(**INLINED)
def _take_step(owner, begin, length, state):  # type: ignore[no-untyped-def]
    plant, weights, work = owner
    own = Plant(plant.system, plant.place, plant.modes, stage_room_of(plant.system, work))
    step(weights, own, begin, length, state, work)
    return 0


@numba.njit(**INLINED)
def _restitution(owner, approach):  # type: ignore[no-untyped-def]
    return restitution(owner[0].system.effects, approach)


@numba.njit(**INLINED)
def _kick(owner, state, jumps):  # type: ignore[no-untyped-def]
    kick(owner[0].system.carrier, state, jumps, state)
    return 0


take_context = address_of()
take_race, take_work, take_calls = address_of(RACE), address_of(WORK), address_of(CALLS)
at_evaluate = callback(_evaluate, numba.int64, *EVALUATE)
at_take_step = callback(_take_step, numba.int64, *TAKE_STEP)
at_restitution = callback(_restitution, numba.float64, *RESTITUTION)
at_kick = callback(_kick, numba.int64, *KICK)


room_kept = chosen_by(
    has_events, lambda system, work: work.room, lambda system, work: room_of(system, work)
)
"""Where an evaluation writes: events read what it has written; ``(system, work)``."""
owner_of = chosen_by(
    has_events, lambda plant, weights, work: (plant, weights, work), lambda plant, *_: None
)
"""What a scene's own functions are given by events; None where there are none. ``(plant, weights,
work)``."""
race_if_needed = chosen_by(has_events, lambda plant: race_of(plant), lambda plant: None)
"""The Race for events, or None; ``(plant)``."""
work_if_needed = chosen_by(has_events, lambda plant, work: work, lambda plant, work: None)
"""The Workspace for events, or None; ``(plant, work)``."""


@numba.njit(**INLINED)
def _enter(plant, calls, work, events, time, state):  # type: ignore[no-untyped-def]
    call_events(events, (calls[0], calls[1], calls[2], True, time, 0.0, time, state))


enter = chosen_by(has_events, _enter, lambda plant, calls, work, events, time, state: None)
"""Branches and margins at the beginning of steps, right after ``evaluate``; ``(plant, calls, work,
events, time, state)``."""


@numba.njit(**INLINED)
def _step(plant, weights, calls, work, events, begin, length, end, state):  # type: ignore[no-untyped-def]
    step(weights, plant, begin, length, state, work)
    return False


@numba.njit(**INLINED)
def _step_with_events(plant, weights, calls, work, events, begin, length, end, state):  # type: ignore[no-untyped-def]
    return call_events(events, (calls[0], calls[1], calls[2], False, begin, length, end, state))


step_over_events = chosen_by(has_events, _step_with_events, _step)
"""One step, cut at every event; ``(plant, weights, calls, work, events, begin, length, end,
state)``, ``end`` being the time that the next step begins at.

The result is in ``work.trial``. At events state and modes change. Returns whether the workspace
knows slope, margins and accelerations there.
"""


@numba.njit(**INLINED)
def _look_back(plant, work):  # type: ignore[no-untyped-def]
    slope = work.slopes[0]
    for j in range(slope.size):
        slope[j] = work.ahead[j]
    for slot in range(work.margin.size):
        work.margin[slot] = work.margin_ahead[slot]
        work.rate[slot] = work.rate_ahead[slot]
    for r in range(work.acceleration_ahead.size):
        plant.room.acceleration[r] = work.acceleration_ahead[r]


look_back = chosen_by(has_events, _look_back, lambda plant, work: None)
"""Take over what is known of the step's end; ``(plant, work)``."""


@numba.njit(**INLINED)
def unwind(plant, state):  # type: ignore[no-untyped-def]
    """Count whole turns of balls and spindle apart: an angle keeps its digits for ever.

    Returns:
        Whether that, or what else may drift, has changed the state.
    """
    system, changed = plant.system, straighten(plant.system.carrier, state)
    n = ball_count(system)
    for i in range(n):
        changed = take_out_turns(state, angle_at(system, i), plant.modes, i) or changed
    if has_motor(system.effects):
        changed = take_out_turns(state, spindle_angle_at(system), plant.modes, n) or changed
    return changed


@numba.njit(**INLINED)
def take_out_turns(state, at, modes, i):  # type: ignore[no-untyped-def]
    """Bring one angle back into -2 pi .. 2 pi; whether it was not there."""
    turned = False
    while abs(state[at]) > 2.0 * pi:
        turn = 1.0 if state[at] > 0.0 else -1.0
        state[at] = (state[at] - turn * 2.0 * pi) - turn * TWO_PI_REST
        modes[i, TURNS] += int(turn)
        turned = True
    return turned


@numba.njit(**INLINED)
def record(plant, time, state, row):  # type: ignore[no-untyped-def]
    """One row of a run's samples, right after ``evaluate``."""
    system = plant.system
    n, states = ball_count(system), state_size(system, state)
    for j in range(states):
        row[j] = state[j]
    for i in range(n):
        row[angle_at(system, i)] += 2.0 * pi * plant.modes[i, TURNS]
    if has_motor(system.effects):
        row[spindle_angle_at(system)] += 2.0 * pi * plant.modes[n, TURNS]
    spindle = spindle_motion(plant, time, state)
    output(system.carrier, plant, spindle, state, plant.room.acceleration, row[states:])
    row[states + carrier_outputs(system.carrier)] = spindle.torque
