"""Fixed steps along a speed profile."""

import functools
from collections.abc import Callable
from math import pi
from typing import Any, NamedTuple

import numba
import numpy as np
from numba.core import types
from numba.extending import overload

from ab_sim.dynamics.calling import address_of, callback
from ab_sim.dynamics.dispatch import INLINED, chosen_by, effect_class, part_of
from ab_sim.dynamics.layout import angle_at, spindle_angle_at, state_size
from ab_sim.dynamics.numbers.tables import spread
from ab_sim.dynamics.race.calls import CALLS, EVALUATE, KICK, RESTITUTION, TAKE_STEP, Calls
from ab_sim.dynamics.race.race import race_of
from ab_sim.dynamics.slope import evaluate, inlined_evaluate
from ab_sim.dynamics.system import (
    TURNS,
    Place,
    Plant,
    System,
    ball_count,
    has_events,
    has_motor,
    kick,
    restitution,
    straighten,
)
from ab_sim.integrate.compile_cache import compiled
from ab_sim.integrate.events import RACE, WORK, call_events, within_bounds
from ab_sim.integrate.kept import Kept, values_of
from ab_sim.integrate.on_stack import room_of, stage_room_of
from ab_sim.integrate.samples import ANGLE, COMMAND, STEP, TIME, along, record
from ab_sim.integrate.stepper import step
from ab_sim.integrate.workspace import Workspace

FIRST, END, START, OFFSET, LENGTH, PLACE = range(6)
"""Columns of a way, a line for each stretch: steps taken before it, and after it, with the step
that a part of one ends; when its piece of the profile begins [s]; where a part begins in its step
[s]; length of each of its steps, or of the part [s]; the first of the Place's floats."""
TWO_PI_REST = 2.4492935982947064e-16
"""2 pi less the floating-point number nearest to it."""


class Run(NamedTuple):
    """What a drive's steps are taken with, call by call: see ``kept.Kept``."""

    system: System
    """What moves."""
    place: Place
    """A pattern of those in the way: all are of one kind of segment."""
    weights: Any
    """The stepper's."""
    step: float
    """s."""
    state: np.ndarray
    """The state; holds the last good one at the end."""
    modes: np.ndarray
    """The branches in force; changed at events."""
    work: Workspace
    """Where ``trial`` holds the state that left its bounds, if one did."""
    events: int
    """``events.events_address()``; of no account where the system has none."""


class Stretch(NamedTuple):
    """A ``spindle.stretches.Stretch`` as kernels have it: where steps of one length are taken.

    Times are products of step and number, not sums, so that they do not depend on how a run is cut
    up; the offset comes last, so that a piece of microseconds keeps its digits.
    """

    place: Place
    """Along the speed profile."""
    start: float
    """When the piece of the profile begins [s]."""
    first: int
    """Steps taken before."""
    offset: float
    """Of the first into its nominal step [s]."""
    length: float
    """Of each [s]: the nominal one, or a part of it next to a breakpoint."""


@compiled
def advance(kept, way, at, first, steps, command, samples):  # type: ignore[no-untyped-def]
    """Take steps along a way, or up to its end, recording every one.

    With none, only see to the branches; or, if there is room for a sample, record the state as it
    is, without a change to anything.

    Args:
        kept: a Kept of a Run.
        way: shape (stretches, columns as above), one after the other.
        at: the stretch that the first step lies in, or the first of its parts.
        first: steps taken before.
        steps: how many to take.
        command: speed asked for [rad/s]; if it is no number, that of the profile.
        samples: shape (steps, channels), or more: see ``integrate.samples``.

    Returns:
        How many steps were taken; if the state then left its bounds -1 less as many.
    """
    run = values_of(kept)
    work, step = run.work, run.step
    looks, done, bad = steps == 0 and samples.shape[0] > 0, 0, False
    while at < way.shape[0]:
        start = way[at, START]
        if start != work.smooth[0] and not looks:
            # What a stepper remembers is of no use behind a kink.
            forget(work.memory)
            work.smooth[0] = start
        place = spread(run.place, way[at, PLACE:])
        ahead, here = way[at, END] - (first + done), steps - done
        if ahead < here:
            here = int(ahead)
        # Part by part of a step makes the same sample, and the last one stays.
        count = max(here, 1) if steps > 0 else 0
        stretch = Stretch(place, start, first + done, way[at, OFFSET], way[at, LENGTH])
        taken = march(run, stretch, samples[done:], count)
        bad = taken < count
        done += taken if bad else here
        if bad or done == steps:
            break
        at += 1
    for k in range(samples.shape[0]):
        samples[k, STEP] = first if looks else first + k + 1
        samples[k, TIME] = samples[k, STEP] * step
        if command == command:
            samples[k, COMMAND] = command
    return -1 - done if bad else done


_TABLE = types.float64[:, ::1]
_KINDS = (_TABLE, *(types.int64,) * 3, types.float64, _TABLE)


def stepping(kept: Kept) -> Callable[..., int]:
    """``advance`` for a Kept of a Run, of the other arguments; compiled if need be.

    They have to be of just their types: numba's look at each costs more than a step, and is left
    out.
    """
    kinds = (kept.kind, *_KINDS)
    if kinds not in advance.overloads:
        advance.compile(kinds)
    return functools.partial(advance.overloads[kinds].entry_point, kept)


@numba.njit(**INLINED)
def forget(memory):  # type: ignore[no-untyped-def]
    """What a stepper remembers."""
    for i in range(memory.shape[0]):
        for j in range(memory.shape[1]):
            memory[i, j] = 0.0


@numba.njit(**INLINED)
def local_time(run, stretch, done):  # type: ignore[no-untyped-def]
    """Since the piece of the profile began [s], so many nominal steps into a stretch."""
    return ((stretch.first + done) * run.step - stretch.start) + stretch.offset


@numba.njit(**INLINED)
def step_by_step(run, stretch, rows, steps):  # type: ignore[no-untyped-def]
    """Take steps along one stretch, with a stepper whose steps are the scene's.

    Args:
        run: the Run.
        stretch: the Stretch.
        rows: samples, of which the rows are recorded: see ``integrate.samples``.
        steps: how many; with none, rows may have room for the state as it is.

    Returns:
        How many were taken; fewer than asked for if the state left its bounds.
    """
    system, weights, state, work, events = run.system, run.weights, run.state, run.work, run.events
    place, start, first, length = stretch.place, stretch.start, stretch.first, stretch.length
    nominal, trial, looks = run.step, work.trial, steps == 0 and rows.shape[0] > 0
    plant = Plant(system, place, run.modes, room_kept(system, work))
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
        begin = local_time(run, stretch, k)
        if k > 0 and length != nominal:
            begin = local_time(run, stretch, k - 1) + length
        # The slope at the end of a step is the first stage of the next.
        if known:
            look_back(plant, work)
        else:
            inlined_evaluate(plant, begin, state, work.slopes[0])
            if not looks:
                enter(plant, calls, work, events, begin, state)
        if k > 0:
            end = (first + k) * nominal - start
            record(plant, along(place, end), begin, state, rows[k - 1, ANGLE:])
        elif looks:
            record(plant, along(place, begin), begin, state, rows[0, ANGLE:])
        if k == steps:
            break
        end = local_time(run, stretch, k + 1) if length == nominal else begin + length
        known = step_over_events(plant, weights, calls, work, events, begin, length, end, state)
        if not within_bounds(trial, work.bounds):
            return k
        for j in range(state_size(system, state)):
            state[j] = trial[j]
        known = not unwind(plant, state) and known
    return steps


def march(run: Any, stretch: Any, rows: Any, steps: int) -> int:
    """Steps along one stretch as the stepper takes them: see ``step_by_step``."""
    raise TypeError("is called by compiled code only")


@overload(march, jit_options=INLINED, strict=False)
def _march(run, stretch, rows, steps):  # type: ignore[no-untyped-def]
    own = getattr(effect_class(part_of(run, "weights")), "march", None)
    return own or step_by_step.py_func


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
def has_turns_to_unwind(system, state):  # type: ignore[no-untyped-def]
    """Whether ``unwind`` would count a turn apart."""
    found = False
    for i in range(ball_count(system)):
        found = found or is_beyond_a_turn(state[angle_at(system, i)])
    if has_motor(system.effects):
        found = found or is_beyond_a_turn(state[spindle_angle_at(system)])
    return found


@numba.njit(**INLINED)
def is_beyond_a_turn(angle):  # type: ignore[no-untyped-def]
    """Whether an angle [rad] has a whole turn in it that is to be counted apart."""
    return abs(angle) > 2.0 * pi


@numba.njit(**INLINED)
def take_out_turns(state, at, modes, i):  # type: ignore[no-untyped-def]
    """Bring one angle back into -2 pi .. 2 pi; whether it was not there."""
    turned = False
    while is_beyond_a_turn(state[at]):
        turn = 1.0 if state[at] > 0.0 else -1.0
        state[at] = (state[at] - turn * 2.0 * pi) - turn * TWO_PI_REST
        modes[i, TURNS] += int(turn)
        turned = True
    return turned
