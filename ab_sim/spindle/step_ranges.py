"""Where steps go along a speed profile: they never run across a breakpoint, nor past a shape.

A ramp is resolved however short it is: in local time its speed is a polynomial. A curve is not: one
step over the whole of it takes a few values for its shape, and takes the same few whatever the
step is. So a curve that is shorter than the cycle of the fastest motion that steps follow is passed
in as many steps as such a cycle would be, each shorter by as much as the curve is. Half the step
halves them, too.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

from ab_sim.spindle.schedule import ScheduledSegment, SpeedSchedule
from ab_sim.spindle.speed_laws import Ramp


class StepGrid(NamedTuple):
    """How fine steps are."""

    step: float
    """s."""
    cycle: float
    """Of the fastest motion that steps follow [s]: see ``integrate.choose.Choice``."""


class StepRange(NamedTuple):
    """Steps within one scheduled segment, or the part of a step that lies in it."""

    scheduled: ScheduledSegment
    first: int
    """Steps taken before."""
    steps: int
    """Whole steps; 0 for a part of one."""
    offset: float
    """Where a part begins in its step [s]; 0 for whole steps."""
    length: float
    """Of each step, or of the part [s]."""


def same_instant(time: float, step: float) -> float:
    """How far apart two times may be and still be the same instant [s]."""
    return max(1e-9 * step, 4.0 * math.ulp(time))


def segment_after(profile: SpeedSchedule, time: float, step: float) -> ScheduledSegment:
    """The segment in force just after ``time`` [s]."""
    return profile.segment_at(time + same_instant(time, step))


def step_ranges(
    profile: SpeedSchedule, grid: StepGrid, first: int, steps: int
) -> Iterator[StepRange]:
    """The stretches of so many steps, ``first`` steps having been taken before.

    A step with breakpoints in it, or along a short curve, comes in parts, one after the other.
    """
    step, done = grid.step, 0
    while done < steps:
        at = first + done
        scheduled = segment_after(profile, at * step, step)
        whole = 0
        if _longest(scheduled, grid) == step:
            whole = _whole_steps(scheduled.end, step, at, steps - done)
        if whole:
            yield StepRange(scheduled, at, whole, 0.0, step)
        else:
            yield from parts(profile, grid, at, (at + 1) * step)
        done += max(whole, 1)


def parts(profile: SpeedSchedule, grid: StepGrid, first: int, end: float) -> Iterator[StepRange]:
    """The parts from the beginning of a step to ``end`` [s], no later than the next step's."""
    begin = now = first * grid.step
    while True:
        scheduled = segment_after(profile, now, grid.step)
        until = scheduled.end if scheduled.end < end - same_instant(end, grid.step) else end
        count = max(1, math.ceil((until - now) / _longest(scheduled, grid) - 1e-9))
        length = (until - now) / count
        for k in range(count):
            yield StepRange(scheduled, first, 0, (now - begin) + k * length, length)
        if until == end:
            return
        now = until


def _longest(scheduled: ScheduledSegment, grid: StepGrid) -> float:
    """How long a step may be along a segment [s]."""
    if isinstance(scheduled.segment, Ramp):
        return grid.step
    return grid.step * min(1.0, (scheduled.end - scheduled.start) / grid.cycle)


def _whole_steps(end: float, step: float, first: int, most: int) -> int:
    """Whole steps that end at or before ``end`` [s], at most ``most``."""
    ahead = (end - first * step) / step
    if ahead > most + 1:
        return most
    count = max(math.floor(ahead) - 1, 0)
    while count < most and (first + count + 1) * step <= end + same_instant(end, step):
        count += 1
    return count
