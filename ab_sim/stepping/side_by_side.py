"""Fixed steps of eight runs at once, each in a lane of its own."""

from typing import NamedTuple

import numpy as np

from ab_sim.compiling.kinds import Cube, Floats, IntegerTable, Table, aligned, call
from ab_sim.stepping.settle import SOUND

LANES = 8
"""Runs side by side: numbers that fill a vector of AVX-512, or two of AVX2."""
FIRST, STEPS, FINISHES = 0, 1, 2
"""Columns of a plan's rows: steps taken before; steps, or 1 for the part of one; whether its
last part ends a step, which is then recorded."""
START, OFFSET, LENGTH = 0, 1, 2
"""Lines of the times of a row [s]: when its segment of the schedule begins, where it begins in its
step, and the length of each of its steps or parts; 0 where a run has no further part."""
BEGIN, TAKEN, END, ON_PROFILE = 0, 1, 2, 3
"""Lines of ``LaneRuns.times`` [s]: when a step begins, its length, when it ends, and when its
sample is on the profile."""


class LanePlan(NamedTuple):
    """Where the steps of eight runs go; see ``batch.lanes.merged``."""

    rows: IntegerTable
    """Shape (rows, 3), columns as above."""
    places: Cube
    """The numbers of each run's ActiveSegment, shape (rows, numbers, 8)."""
    times: Cube
    """Shape (rows, 3, 8), lines as above."""


class LaneRuns(NamedTuple):
    """Eight runs of a kind of scene; the last axis of each array is theirs."""

    prepare: int
    """prepare(c), in lanes, as all of these functions."""
    slope: int
    """slope(c, b, t, y, k); of runs without events."""
    step: int
    """step(c, b, t, y, k, trial); begin and length behind t."""
    settle: int
    """settle(t, y, trial, bounds, turns, said): see ``settle``; length behind t."""
    finish: int
    """finish(c, b, t, y, k, turns, row); time and the profile's time behind t."""
    c: Table
    """Constants, shape (constants, 8)."""
    b: Table
    """Branches, shape (numbers, 8)."""
    place: int
    """Where in c the place on the speed profile begins."""
    step_length: float
    """s."""
    every: int
    """Steps from one recorded sample to the next."""
    bounds: Table
    """Magnitudes that no sound run reaches, shape (states, 8)."""
    state: Table
    """Shape (states, 8)."""
    turns: Table
    """Taken out of the balls' angles and of a motor's spindle's, shape (n or n + 1, 8)."""
    said: Table
    """Shape (2, 8), lines as of ``settle``."""
    sound: Floats
    """How many steps each was within its bounds, shape (8,)."""
    slopes: Table
    """Shape (states, 8)."""
    trial: Table
    """Shape (states, 8)."""
    row: Table
    """Of the sample at hand, shape (numbers, 8)."""
    times: Table
    """Shape (4, 8), lines as above."""


class LaneSamples(NamedTuple):
    """Where the samples of eight runs go: flat memory, and how far its numbers are apart."""

    numbers: Floats
    run: int
    """From a run to the next one."""
    sample: int
    """From a sample to the next one."""
    channel: int
    """From a channel to the next one."""

    @classmethod
    def by_sample(cls, samples: np.ndarray) -> "LaneSamples":
        """In an array of shape (8, samples, channels), C-contiguous."""
        _, count, channels = samples.shape
        return cls(samples.reshape(-1), count * channels, channels, 1)

    @classmethod
    def by_channel(cls, samples: np.ndarray) -> "LaneSamples":
        """In an array of shape (8, channels, samples), C-contiguous; there may be more room."""
        _, channels, room = samples.shape
        return cls(samples.reshape(-1), channels * room, 1, room)


def advance_side_by_side(runs: LaneRuns, plan: LanePlan, samples: LaneSamples) -> None:
    """Take the steps of a plan with eight runs without events, recording every so many.

    Args:
        runs: state and turns are the last at the end.
        plan: where they go.
        samples: of each run; their channels are those of ``fixed_step.record``.
    """
    c, b, times, state = runs.c, runs.b, runs.times, runs.state
    for s in range(plan.rows.shape[0]):
        enter(runs, plan, s)
        call(runs.slope, c, b, times, state, runs.slopes)
        for k in range(plan.rows[s, STEPS]):
            put_times(runs, plan, s, k)
            call(runs.step, c, b, times, state, runs.slopes, runs.trial)
            settle(runs)
            if not recorded(runs, plan, samples, s, k):
                call(runs.slope, c, b, times[END:], state, runs.slopes)


def enter(runs: LaneRuns, plan: LanePlan, s: int) -> None:
    """Begin a row of a plan."""
    for j in range(plan.places.shape[1]):
        for lane in range(LANES):
            runs.c[runs.place + j, lane] = plan.places[s, j, lane]
    call(runs.prepare, runs.c)
    for lane in range(LANES):
        runs.times[TAKEN, lane] = plan.times[s, LENGTH, lane]
        runs.times[BEGIN, lane] = local_time(runs, plan, s, 0, lane)


def put_times(runs: LaneRuns, plan: LanePlan, s: int, k: int) -> None:
    """Times of a row's k-th step: to the bit what a single run has.

    A run whose step has ended before keeps when it did.
    """
    first, times = plan.rows[s, FIRST] + k + 1, runs.times
    for lane in range(LANES):
        length = times[TAKEN, lane]
        if length > 0.0:
            times[BEGIN, lane] = local_time(runs, plan, s, k, lane)
            if length == runs.step_length:
                times[END, lane] = local_time(runs, plan, s, k + 1, lane)
            else:
                times[END, lane] = times[BEGIN, lane] + length
            times[ON_PROFILE, lane] = first * runs.step_length - plan.times[s, START, lane]


def settle(runs: LaneRuns) -> None:
    """The trial states become the states, as far as runs take the step."""
    length, state, trial = runs.times[TAKEN:], runs.state, runs.trial
    call(runs.settle, length, state, trial, runs.bounds, runs.turns, runs.said)


def local_time(runs: LaneRuns, plan: LanePlan, s: int, k: int, lane: int) -> float:
    """Since the piece of the profile began [s], after so many steps of a row."""
    since = (plan.rows[s, FIRST] + k) * runs.step_length - plan.times[s, START, lane]
    return since + plan.times[s, OFFSET, lane]


def recorded(runs: LaneRuns, plan: LanePlan, samples: LaneSamples, s: int, k: int) -> bool:
    """Record what follows a row's k-th step, if it ends there and is to be; whether it was.

    Fills in the slopes, too.
    """
    if plan.rows[s, FINISHES] == 0:
        return False
    for lane in range(LANES):
        runs.sound[lane] += runs.said[SOUND, lane]
    steps = plan.rows[s, FIRST] + k + 1
    if steps % runs.every != 0:
        return False
    at, turns = runs.times[END:], runs.turns
    call(runs.finish, runs.c, runs.b, at, runs.state, runs.slopes, turns, runs.row)
    put_sample(runs, samples, steps)
    return True


def put_sample(runs: LaneRuns, samples: LaneSamples, steps: int) -> None:
    """The row at hand, as each run's sample after so many steps."""
    first = (steps // runs.every - 1) * samples.sample
    for lane in range(LANES):
        at = first + lane * samples.run
        samples.numbers[at] = steps
        samples.numbers[at + samples.channel] = steps * runs.step_length
        for j in range(runs.row.shape[0]):
            samples.numbers[at + (2 + j) * samples.channel] = runs.row[j, lane]


def stacked(values: list[np.ndarray]) -> np.ndarray:
    """Values of each lane, stacked along a last axis, aligned to a vector."""
    found = np.stack([np.asarray(value, float) for value in values], axis=-1)
    array = aligned(found.shape)
    array[:] = found
    return array
