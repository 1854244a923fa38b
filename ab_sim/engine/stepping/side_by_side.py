"""Fixed steps of eight runs at once, one run per SIMD lane."""

from typing import NamedTuple

import numpy as np

from ab_sim.engine.compiling.kinds import Cube, Floats, IntegerTable, Table, aligned, call
from ab_sim.engine.stepping.emitted import SOUND

LANES = 8
"""Number of runs side by side: doubles in one AVX-512 vector, or in two of AVX2."""
FIRST, STEPS, FINISHES = 0, 1, 2
"""Columns of a plan's rows: steps taken before; number of steps, or 1 for part of a step; 1 if the
last part completes a step, which is then recorded, else 0."""
START, OFFSET, LENGTH = 0, 1, 2
"""Lines of the times of a row [s]: beginning of its segment of the schedule; its own beginning
within its step; length of each of its steps or parts, 0 where a run has no further part."""
BEGIN, TAKEN, END, _ON_PROFILE = 0, 1, 2, 3
"""Lines of ``LaneRuns.times`` [s]: beginning, length and end of a step, and the time at which the
profile is evaluated for its sample."""


class LanePlan(NamedTuple):
    """Step plan of eight runs; see ``batch.lanes.merged``."""

    rows: IntegerTable
    """Steps, shape (rows, 3), columns as above."""
    places: Cube
    """Numbers of each run's ActiveSegment, shape (rows, numbers, 8)."""
    times: Cube
    """Times [s], shape (rows, 3, 8), lines as above."""


class LaneRuns(NamedTuple):
    """Eight runs of one kind of scene; the last axis of each array runs over them.

    Functions are addresses of machine code that works on all lanes.
    """

    prepare: int
    """Function prepare(c), which computes derived constants."""
    slope: int
    """Function slope(c, b, t, y, k); used without events."""
    step: int
    """Function step(c, b, t, y, k, trial); t is followed by begin and length."""
    settle: int
    """Function settle(t, y, trial, bounds, turns, status): see ``settle``; the length follows t."""
    finish: int
    """Function finish(c, b, t, y, k, turns, row), which writes slopes to k and samples to row; t is
    followed by time and profile time."""
    c: Table
    """Constants, shape (constants, 8)."""
    b: Table
    """Branches, shape (numbers, 8)."""
    place: int
    """Index in c of the first number of the active profile segment."""
    step_length: float
    """Nominal step length [s]."""
    every: int
    """Steps from one recorded sample to the next."""
    bounds: Table
    """Magnitudes of the states beyond which a run counts as diverged, shape (states, 8)."""
    state: Table
    """States, shape (states, 8)."""
    turns: Table
    """Turns removed from the angles of balls and of a motor's spindle, shape (n or n + 1, 8)."""
    status: Table
    """Flags of each run, shape (2, 8), lines as in ``settle``."""
    sound: Floats
    """Number of steps at whose end each run was within its bounds, shape (8,)."""
    slopes: Table
    """Slopes at the states, shape (states, 8)."""
    trial: Table
    """States at the end of the current step, shape (states, 8)."""
    row: Table
    """Row of the current sample, shape (numbers, 8)."""
    times: Table
    """Times of the current step, shape (4, 8), lines as above."""


class LaneSamples(NamedTuple):
    """Memory for the samples of eight runs, with its strides in numbers."""

    numbers: Floats
    run: int
    """Stride from run to run."""
    sample: int
    """Stride from sample to sample."""
    channel: int
    """Stride from channel to channel."""

    @classmethod
    def by_sample(cls, samples: np.ndarray) -> "LaneSamples":
        """Return the memory of an array of shape (8, samples, channels), C-contiguous."""
        _, count, channels = samples.shape
        return cls(samples.reshape(-1), count * channels, channels, 1)

    @classmethod
    def by_channel(cls, samples: np.ndarray) -> "LaneSamples":
        """Return the memory of an array of shape (8, channels, samples or more), C-contiguous."""
        _, channels, room = samples.shape
        return cls(samples.reshape(-1), channels * room, 1, room)


def advance_side_by_side(runs: LaneRuns, plan: LanePlan, samples: LaneSamples) -> None:
    """Take the steps of a plan with eight runs without events; record every ``every``-th.

    Parameters
    ----------
    runs
        Runs; state and turns are those after the last step at the end.
    plan
        Step plan.
    samples
        Samples of each run; their channels are those of ``fixed_step.record``.
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
    """Begin row s of a plan: set the segment of each run, and the time at which the row begins."""
    for j in range(plan.places.shape[1]):
        for lane in range(LANES):
            runs.c[runs.place + j, lane] = plan.places[s, j, lane]
    call(runs.prepare, runs.c)
    for lane in range(LANES):
        runs.times[TAKEN, lane] = plan.times[s, LENGTH, lane]
        runs.times[BEGIN, lane] = local_time(runs, plan, s, 0, lane)


def put_times(runs: LaneRuns, plan: LanePlan, s: int, k: int) -> None:
    """Compute the times of a row's k-th step, bit for bit those of a single run.

    A run that takes no part in the row keeps the end of its last step.
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
            times[_ON_PROFILE, lane] = first * runs.step_length - plan.times[s, START, lane]


def settle(runs: LaneRuns) -> None:
    """Accept the trial states of the runs that take the step."""
    length, state, trial = runs.times[TAKEN:], runs.state, runs.trial
    call(runs.settle, length, state, trial, runs.bounds, runs.turns, runs.status)


def local_time(runs: LaneRuns, plan: LanePlan, s: int, k: int, lane: int) -> float:
    """Return the time since the profile segment began [s], after k steps of a row."""
    since = (plan.rows[s, FIRST] + k) * runs.step_length - plan.times[s, START, lane]
    return since + plan.times[s, OFFSET, lane]


def recorded(runs: LaneRuns, plan: LanePlan, samples: LaneSamples, s: int, k: int) -> bool:
    """Record the sample after a row's k-th step if it is due; return whether it was.

    A sample is due at the end of every ``every``-th whole step. Recording also computes the slopes
    there. If no sample is due, the caller computes them.
    """
    if plan.rows[s, FINISHES] == 0:
        return False
    for lane in range(LANES):
        runs.sound[lane] += runs.status[SOUND, lane]
    steps = plan.rows[s, FIRST] + k + 1
    if steps % runs.every != 0:
        return False
    at, turns = runs.times[END:], runs.turns
    call(runs.finish, runs.c, runs.b, at, runs.state, runs.slopes, turns, runs.row)
    _put_sample(runs, samples, steps)
    return True


def _put_sample(runs: LaneRuns, samples: LaneSamples, steps: int) -> None:
    """Write the current row as each run's sample after ``steps`` steps."""
    first = (steps // runs.every - 1) * samples.sample
    for lane in range(LANES):
        at = first + lane * samples.run
        samples.numbers[at] = steps
        samples.numbers[at + samples.channel] = steps * runs.step_length
        for j in range(runs.row.shape[0]):
            samples.numbers[at + (2 + j) * samples.channel] = runs.row[j, lane]


def stacked(values: list[np.ndarray]) -> np.ndarray:
    """Return the values of all lanes, stacked along a last axis and aligned to a vector."""
    stack = np.stack([np.asarray(value, float) for value in values], axis=-1)
    array = aligned(stack.shape)
    array[:] = stack
    return array
