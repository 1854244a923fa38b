"""Fixed steps of eight runs at once, each in a lane of its own; see dynamics.numbers.lanes."""

import functools
from math import pi
from typing import Any, NamedTuple

import numba
import numpy as np
from numba.core.errors import TypingError

from ab_sim.dynamics.dispatch import INLINED
from ab_sim.dynamics.layout import angle_at, state_size
from ab_sim.dynamics.numbers.lanes import as_lanes, spread, where_less
from ab_sim.dynamics.slope import inlined_evaluate
from ab_sim.dynamics.system import TURNS, Plant, Room, System, ball_count
from ab_sim.integrate.compile_cache import compiled
from ab_sim.integrate.fixed_step import TWO_PI_REST
from ab_sim.integrate.on_stack import room_of
from ab_sim.integrate.samples import along, record
from ab_sim.integrate.stepper import step as take_step

FIRST, STEPS, FINISHES = 0, 1, 2
"""Columns of a plan's stretches: steps taken before; steps, or 1 for the part of one; whether its
last part ends a step, which is then recorded."""
START, OFFSET, LENGTH = 0, 1, 2
"""Columns of the times of a stretch [s]: when its piece of the profile begins, where it begins in
its step, and the length of each of its steps or parts."""


class Plan(NamedTuple):
    """Where the steps of eight runs go; see batch.plan.merged."""

    stretches: np.ndarray
    """Integers, shape (stretches, 3), columns as above."""
    places: np.ndarray
    """The floats of each run's Place, shape (stretches, floats, 8)."""
    times: np.ndarray
    """Shape (stretches, 3, 8), columns as above."""


class Runs(NamedTuple):
    """What eight runs write to; the last axis of each array is theirs."""

    state: np.ndarray
    """Shape (states, 8)."""
    modes: np.ndarray
    """Turns taken out of the angles, in a column of their own: shape (n + 1, 4, 8)."""
    sound: np.ndarray
    """1 while a run is within its bounds, and how many steps it was: shape (2, 8)."""
    rows: np.ndarray
    """Shape (samples, row_width, 8): see integrate.samples."""
    slopes: np.ndarray
    """The stepper's stages, shape (stages, states, 8)."""
    trial: np.ndarray
    """Shape (states, 8)."""
    room: Room
    """Its arrays have the lanes as a further axis."""


class LaneArrays(NamedTuple):
    """What one step writes to, as lanes; the same names as of a Workspace."""

    slopes: Any
    trial: Any
    ahead: Any
    room: Any


@compiled
def advance_side_by_side(  # type: ignore[no-untyped-def]
    system, place, weights, constants, plan, clock, runs
):
    """Take the steps of a plan with eight runs, recording every so many.

    Args:
        system: the System of one of the runs: the pattern for all. It is compiled for its number
            of balls, and has no events.
        place: a Place, the pattern of those in ``places``.
        weights: those of a stepper that takes lanes.
        constants: (floats of carrier and effects, shape (floats, 8), see lanes.leaves; System.balls
            of each run, shape (n, BALL_CONSTANTS, 8); magnitudes that no sound run reaches, shape
            (states, 8)).
        plan: a Plan.
        clock: (step [s], how many steps from one recorded sample to the next).
        runs: a Runs; state, modes and rows are the last and all states at the end.
    """
    step, every = clock
    carrier, effects = spread((system.carrier, system.effects), as_lanes(constants[0]))
    balls, bounds = as_lanes(constants[1]), as_lanes(constants[2])
    drives = System(carrier, balls, system.contacts, effects, system.ledger, system.each)
    state, modes, sound = as_lanes(runs.state), as_lanes(runs.modes), as_lanes(runs.sound)
    room = Room(
        as_lanes(runs.room.table),
        as_lanes(runs.room.block),
        as_lanes(runs.room.reduced),
        as_lanes(runs.room.acceleration),
        as_lanes(runs.room.motor),
    )
    work = LaneArrays(as_lanes(runs.slopes), as_lanes(runs.trial), as_lanes(runs.trial), room)
    places, times, rows = as_lanes(plan.places), as_lanes(plan.times), as_lanes(runs.rows)
    slopes, states, own = work.slopes, state_size(drives, state), room_of(drives, work)
    for s in range(plan.stretches.shape[0]):
        first, finishes = plan.stretches[s, FIRST], plan.stretches[s, FINISHES]
        here = Plant(drives, spread(place, places[s]), modes, own)
        start, offset, length = times[s, START], times[s, OFFSET], times[s, LENGTH]
        begin = (first * step - start) + offset
        inlined_evaluate(here, begin, state, slopes[0])
        for k in range(plan.stretches[s, STEPS]):
            begin = ((first + k) * step - start) + offset
            take_step(weights, here, begin, length, state, work)
            still = sound[0]
            for j in range(states):
                state[j] = work.trial[j]
                still = where_less(abs(work.trial[j]), bounds[j], still, 0.0)
            sound[0] = still
            take_out_turn(drives, state, modes)
            end = begin + length
            inlined_evaluate(here, end, state, slopes[0])
            if finishes:
                sound[1] += sound[0]
                if (first + k + 1) % every == 0:
                    profile = along(here.place, (first + k + 1) * step - start)
                    record(here, profile, end, state, rows[(first + k + 1) // every - 1])


def lanes_can(*arguments: Any) -> bool:
    """Whether ``advance_side_by_side`` can take these, compiling it if need be.

    It cannot where an effect does with its numbers what lanes do not: see dynamics.numbers.lanes.
    """
    return _compiles(tuple(map(numba.typeof, arguments)))


@functools.cache
def _compiles(kinds: tuple[Any, ...]) -> bool:
    try:
        advance_side_by_side.compile(kinds)
    except TypingError:
        return False
    return True


@numba.njit(**INLINED)
def take_out_turn(system, state, modes):  # type: ignore[no-untyped-def]
    """``fixed_step.take_out_turns`` for lanes, in which a ball makes at most one turn per step."""
    for i in range(ball_count(system)):
        angle = state[angle_at(system, i)]
        turn = where_less(2.0 * pi, abs(angle), where_less(0.0, angle, 1.0, -1.0), 0.0)
        state[angle_at(system, i)] = (angle - turn * (2.0 * pi)) - turn * TWO_PI_REST
        modes[i, TURNS] += turn
