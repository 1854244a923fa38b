"""Divide steps along a speed schedule, so that they cross no breakpoint and resolve short curves.

Steppers resolve a ramp of any length, because its speed is a polynomial in local time. They do not
resolve a curve that lies within one step, because they evaluate it at a few stages only. So a curve
that is shorter than the cycle of the fastest resolved motion takes as many steps as such a cycle,
each shorter in the same ratio. Half the step also halves these shorter steps.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

from ab_sim.model.spindle.schedule import Ramp, ScheduledSegment, SpeedSchedule


class StepResolution(NamedTuple):
    """Length of the steps, and period of the fastest motion that the steps must resolve."""

    step: float
    """Step [s]."""
    cycle: float
    """Period of the fastest motion that steps resolve [s]: see ``integrate.choose.Choice``."""


class StepRange(NamedTuple):
    """Equal steps within one scheduled segment, or the part of a step within the segment."""

    scheduled: ScheduledSegment
    first: int
    """Number of steps of the run before this range."""
    steps: int
    """Number of whole steps; 0 for a part of a step."""
    offset: float
    """Time from the beginning of the step to the part's start [s]; 0 for whole steps."""
    length: float
    """Length of each step, or of the part [s]."""


def same_instant(time: float, step: float) -> float:
    """Return the difference [s] below which times near ``time`` count as the same instant.

    Times of steps are products and ends of segments are sums, so equal times differ by rounding.
    """
    return max(1e-9 * step, 4.0 * math.ulp(time))


def segment_after(schedule: SpeedSchedule, time: float, step: float) -> ScheduledSegment:
    """Return the segment in force just after ``time`` [s], at the precision of a step [s]."""
    return schedule.segment_at(time + same_instant(time, step))


def step_ranges(
    schedule: SpeedSchedule, resolution: StepResolution, first: int, steps: int
) -> Iterator[StepRange]:
    """Yield the ranges of ``steps`` steps, after ``first`` steps have been taken.

    A step that contains breakpoints or runs along a short curve is divided into successive parts.
    """
    step, done = resolution.step, 0
    while done < steps:
        at = first + done
        scheduled = segment_after(schedule, at * step, step)
        whole = 0
        if _longest(scheduled, resolution) == step:
            whole = _whole_steps(scheduled.end, step, at, steps - done)
        if whole:
            yield StepRange(scheduled, at, whole, 0.0, step)
        else:
            yield from parts(schedule, resolution, at, (at + 1) * step)
        done += max(whole, 1)


def parts(
    schedule: SpeedSchedule, resolution: StepResolution, first: int, end: float
) -> Iterator[StepRange]:
    """Yield the parts of one step, from the step's beginning to the time ``end`` [s].

    Parameters
    ----------
    schedule
        Schedule of the speed.
    resolution
        Length of the step, and period of motions that it must resolve.
    first
        Number of steps before this one.
    end
        Time at which the last part ends [s].
    """
    begin = now = first * resolution.step
    while True:
        scheduled = segment_after(schedule, now, resolution.step)
        until = scheduled.end if scheduled.end < end - same_instant(end, resolution.step) else end
        # Less 1e-9, so that rounding of the quotient does not add a part.
        count = max(1, math.ceil((until - now) / _longest(scheduled, resolution) - 1e-9))
        length = (until - now) / count
        for k in range(count):
            yield StepRange(scheduled, first, 0, (now - begin) + k * length, length)
        if until == end:
            return
        now = until


def _longest(scheduled: ScheduledSegment, resolution: StepResolution) -> float:
    """Return the longest allowed step along a segment [s]."""
    if isinstance(scheduled.law, Ramp):
        return resolution.step
    return resolution.step * min(1.0, (scheduled.end - scheduled.start) / resolution.cycle)


def _whole_steps(end: float, step: float, first: int, most: int) -> int:
    """Return the number of whole steps that end at or before ``end`` [s], at most ``most``."""
    ahead = (end - first * step) / step
    if ahead > most + 1:
        return most
    # The quotient is rounded, so the last steps are counted with the comparison of times that
    # ``parts`` uses. Otherwise a step could be in both results, or in none.
    count = max(math.floor(ahead) - 1, 0)
    while count < most and (first + count + 1) * step <= end + same_instant(end, step):
        count += 1
    return count
