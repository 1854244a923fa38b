"""Fixed steps of eight runs at once, one run per SIMD lane."""

from typing import NamedTuple

import numpy as np

from ab_sim.engine.compiling.kinds import Floats, Table, aligned, call
from ab_sim.engine.stepping.emitted import SOUND
from ab_sim.engine.stepping.plan import FIRST, PLACE, LanePlan

LANES = 8
"""Number of runs side by side: doubles in one AVX-512 vector, or in two of AVX2."""
BEGIN, TAKEN, END, _ON_PROFILE = 0, 1, 2, 3
"""Lines of ``LaneRuns.times`` [s]: beginning, length and end of a step, and the time at which the
profile is evaluated for its sample."""


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
    """Number of steps of each run after which the state was within bounds, shape (8,)."""
    slopes: Table
    """Slopes at the states, shape (states, 8)."""
    trial: Table
    """States at the end of the current step, shape (states, 8)."""
    row: Table
    """Row of the current sample, shape (numbers, 8)."""
    times: Table
    """Times of the current step, shape (4, 8), lines as above."""

    def enter(self, plan: LanePlan, s: int) -> None:
        """Begin row s of a plan, and evaluate the slope there: see ``advance.Lanes``."""
        enter_row(self, plan, s)
        call(self.slope, self.c, self.b, self.times, self.state, self.slopes)

    def take(self, plan: LanePlan, s: int, k: int) -> bool:
        """Take the k-th step of row s together: see ``advance.Lanes``."""
        if k == plan.count(s):
            return False
        try_step(self, plan, s, k)
        settle(self)
        return True

    def record(self, plan: LanePlan, samples: "LaneSamples", s: int, k: int) -> None:
        """Record the samples after step k of row s if due: see ``advance.Lanes``."""
        if not recorded(self, plan, samples, s, k):
            call(self.slope, self.c, self.b, self.times[END:], self.state, self.slopes)


class LaneSamples(NamedTuple):
    """Memory for the samples of eight runs, with strides counted in numbers."""

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


def enter_row(runs: LaneRuns, plan: LanePlan, s: int) -> None:
    """Begin row s of a plan: set the segment of each run, and the time at which the row begins."""
    times = runs.times
    for lane in range(LANES):
        put_segment(runs.c, runs.place, lane, plan.lines[s, lane])
        steps = plan.steps_of(s, lane, runs.step_length)
        times[BEGIN, lane], times[TAKEN, lane] = steps.time_after(0), steps.length
        # Branches are checked at the time END, which is the row's begin at first.
        if steps.length > 0.0:
            times[END, lane] = times[BEGIN, lane]
    call(runs.prepare, runs.c)


def put_segment(c: Table, place: int, lane: int, line: Floats) -> None:
    """Make the profile segment of a plan's line the active one of the run in a lane."""
    for j in range(PLACE, line.size):
        c[place + j - PLACE, lane] = line[j]


def try_step(runs: LaneRuns, plan: LanePlan, s: int, k: int) -> None:
    """Try the k-th step of a row with all runs.

    Its times are those of a single run, bit for bit. A run that takes no part in the row keeps the
    end of its last step.
    """
    times = runs.times
    for lane in range(LANES):
        if times[TAKEN, lane] > 0.0:
            steps = plan.steps_of(s, lane, runs.step_length)
            times[BEGIN, lane], times[END, lane] = steps.time_after(k), steps.time_after(k + 1)
            times[_ON_PROFILE, lane] = steps.profile_time(k + 1)
    call(runs.step, runs.c, runs.b, times, runs.state, runs.slopes, runs.trial)


def settle(runs: LaneRuns) -> None:
    """Accept the trial states of the runs that take the step."""
    length, state, trial = runs.times[TAKEN:], runs.state, runs.trial
    call(runs.settle, length, state, trial, runs.bounds, runs.turns, runs.status)


def recorded(runs: LaneRuns, plan: LanePlan, samples: LaneSamples, s: int, k: int) -> bool:
    """Record the sample after a row's k-th step if it is due; return whether it was.

    A sample is due at the end of every ``every``-th whole step. Recording also computes the slopes
    there. If no sample is due, the caller computes them.
    """
    if plan.is_part(s):
        return False
    for lane in range(LANES):
        runs.sound[lane] += runs.status[SOUND, lane]
    steps = int(plan.lines[s, 0, FIRST]) + k + 1
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
