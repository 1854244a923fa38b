"""Fixed steps of eight runs at once, each in a lane of its own."""

from math import pi
from typing import NamedTuple

import numpy as np

from ab_sim.compiling.kinds import Cube, Floats, IntegerTable, Table, call

LANES = 8
"""Runs side by side: numbers that fill a vector of AVX-512, or two of AVX2."""
TWO_PI_REST = 2.4492935982947064e-16
"""2 pi less the floating-point number nearest to it."""
FIRST, STEPS, FINISHES = 0, 1, 2
"""Columns of a plan's rows: steps taken before; steps, or 1 for the part of one; whether its
last part ends a step, which is then recorded."""
START, OFFSET, LENGTH = 0, 1, 2
"""Lines of the times of a row [s]: when its segment of the schedule begins, where it begins in its
step, and the length of each of its steps or parts."""


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
    """slope(c, b, t, y, k)."""
    step: int
    """step(c, b, t, y, k, trial); begin and length behind t."""
    finish: int
    """finish(c, b, t, y, k, row); time and the profile's time behind t."""
    c: Table
    """Constants, shape (constants, 8)."""
    b: Floats
    """Branches: none."""
    place: int
    """Where in c the place on the speed profile begins."""
    first_angle: int
    """Where in the state theta_0 lies."""
    balls: int
    """n."""
    ball_column: int
    """Where in a row the first ball's angle is."""
    step_length: float
    """s."""
    every: int
    """Steps from one recorded sample to the next."""
    bounds: Table
    """Magnitudes that no sound run reaches, shape (states, 8)."""
    state: Table
    """Shape (states, 8)."""
    turns: Table
    """Taken out of the balls' angles, shape (n, 8)."""
    sound: Table
    """1 while a run is within its bounds, and how many steps it was: shape (2, 8)."""
    slopes: Table
    """Shape (states, 8)."""
    trial: Table
    """Shape (states, 8)."""
    row: Table
    """Of the sample at hand, shape (numbers, 8)."""
    times: Table
    """Shape (2, 8)."""


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
    """Take the steps of a plan with eight runs, recording every so many.

    Args:
        runs: without events; state and turns are the last at the end.
        plan: where they go.
        samples: of each run; their channels are those of ``fixed_step.record``.
    """
    c, b, times, state, turns = runs.c, runs.b, runs.times, runs.state, runs.turns
    for s in range(plan.rows.shape[0]):
        first, finishes = plan.rows[s, FIRST], plan.rows[s, FINISHES]
        for j in range(plan.places.shape[1]):
            for lane in range(LANES):
                c[runs.place + j, lane] = plan.places[s, j, lane]
        call(runs.prepare, c)
        for lane in range(LANES):
            times[0, lane] = local_time(runs, plan, s, first, lane)
        call(runs.slope, c, b, times, state, runs.slopes)
        for k in range(plan.rows[s, STEPS]):
            for lane in range(LANES):
                times[0, lane] = local_time(runs, plan, s, first + k, lane)
                times[1, lane] = plan.times[s, LENGTH, lane]
            call(runs.step, c, b, times, state, runs.slopes, runs.trial)
            take_over(runs)
            take_out_turns(runs)
            for lane in range(LANES):
                # To the bit what a single run has.
                if times[1, lane] == runs.step_length:
                    times[0, lane] = local_time(runs, plan, s, first + k + 1, lane)
                else:
                    times[0, lane] += times[1, lane]
                start = plan.times[s, START, lane]
                times[1, lane] = (first + k + 1) * runs.step_length - start
            if finishes != 0:
                for lane in range(LANES):
                    runs.sound[1, lane] += runs.sound[0, lane]
            if finishes != 0 and (first + k + 1) % runs.every == 0:
                call(runs.finish, c, b, times, state, runs.slopes, runs.row)
                for i in range(runs.balls):
                    for lane in range(LANES):
                        at = runs.ball_column + 2 * i
                        runs.row[at, lane] += 2.0 * pi * turns[i, lane]
                put_sample(runs, samples, first + k + 1)
            else:
                call(runs.slope, c, b, times, state, runs.slopes)


def local_time(runs: LaneRuns, plan: LanePlan, s: int, steps: int, lane: int) -> float:
    """Since the piece of the profile began [s], after so many steps."""
    since = steps * runs.step_length - plan.times[s, START, lane]
    return since + plan.times[s, OFFSET, lane]


def take_over(runs: LaneRuns) -> None:
    """The trial states become the states; see whether they are sound."""
    for j in range(runs.state.shape[0]):
        for lane in range(LANES):
            value = runs.trial[j, lane]
            runs.state[j, lane] = value
            # Written so that a NaN is not within bounds.
            inside = 1.0 if abs(value) < runs.bounds[j, lane] else 0.0
            runs.sound[0, lane] = runs.sound[0, lane] * inside


def take_out_turns(runs: LaneRuns) -> None:
    """Count whole turns of balls apart; a ball makes at most one in a step."""
    for i in range(runs.balls):
        for lane in range(LANES):
            angle = runs.state[runs.first_angle + i, lane]
            turn = 0.0
            if abs(angle) > 2.0 * pi:
                turn = 1.0 if angle > 0.0 else -1.0
            within = (angle - turn * (2.0 * pi)) - turn * TWO_PI_REST
            runs.state[runs.first_angle + i, lane] = within
            runs.turns[i, lane] += turn


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
    raw = np.empty(found.size + 8)
    first = -raw.ctypes.data % 64 // 8
    array = raw[first : first + found.size].reshape(found.shape)
    array[:] = found
    return array
