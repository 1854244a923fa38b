"""The way of a drive's steps along its speed profile, as tables that its kernel walks along."""

from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator
from itertools import groupby, pairwise
from typing import NamedTuple

import numpy as np

from ab_sim.compiling import KeptArray
from ab_sim.dynamics.assemble import place_on
from ab_sim.spindle import Ramp, ScheduledSegment, SpeedSchedule
from ab_sim.spindle.schedule import Segment
from ab_sim.spindle.step_ranges import StepGrid, StepRange, step_ranges

FOREVER = 2**52
"""Steps after which nobody asks any more; their numbers are exact as floats."""


class StepPlanPart(NamedTuple):
    """Step ranges along segments of one kind: what one call of the driver can take."""

    kind: type
    """Of the segments."""
    table: np.ndarray
    """A line for each step range, columns as of ``stepping.fixed_step.FIRST``."""
    first: int
    """Step ranges of the plan before it."""


DriverOf = Callable[[StepPlanPart], Callable[..., int]]


class StepPlan:
    """Made once for all steps ahead, so that a call has nothing to find out but where it begins.

    Args:
        ahead: the step ranges, at least one, whole steps with all their parts.
    """

    def __init__(self, ahead: Iterable[StepRange]) -> None:
        taken = list(ahead)
        self.begin = taken[0].first
        """Steps taken before it."""
        self._firsts = [step_range.first for step_range in taken]
        self._parts: list[StepPlanPart] = []
        self._places: list[tuple[StepPlanPart, int]] = []
        """Of each step range its part, and which of the part's it is."""
        lines = [_line(*pair) for pair in pairwise([*taken, _END])]
        alike = groupby(
            zip(taken, lines, strict=True), lambda pair: type(pair[0].scheduled.segment)
        )
        for kind, pairs in alike:
            table = np.array([line for _, line in pairs], float)
            part = StepPlanPart(kind, table, len(self._places))
            self._parts.append(part)
            self._places += [(part, at) for at in range(len(table))]

    @classmethod
    def along(cls, profile: SpeedSchedule, grid: StepGrid, first: int) -> "StepPlan":
        """Of all steps along a profile, after so many."""
        return cls(step_ranges(profile, grid, first, FOREVER))

    @property
    def kinds(self) -> set[type[Segment]]:
        """Of its segments: there is a kernel for each."""
        return {part.kind for part in self._parts}

    def after(self, steps: int) -> Iterator[tuple[StepPlanPart, int]]:
        """The parts after so many steps, and at which of its step ranges each is begun."""
        at = self._at(steps)
        for part in self._parts:
            if at < part.first + len(part.table):
                yield part, max(at - part.first, 0)

    def _at(self, steps: int) -> int:
        """Which step range comes first after so many steps; the first one before it begins."""
        at = bisect_left(self._firsts, steps)
        return at if at < len(self._firsts) and self._firsts[at] == steps else max(at - 1, 0)

    def walk(
        self,
        driver: DriverOf,
        first: int,
        steps: int,
        command: float,
        samples: np.ndarray | KeptArray,
    ) -> int:
        """Take steps after so many; arguments and what is returned as of ``fixed_step.advance``.

        Args:
            driver: as ``drive.steps.Steps.along``: of a part, what takes steps along it.
            samples: a KeptArray has room for one step at most.
        """
        at, done = self._at(first), 0
        while True:
            part, begun = self._places[at]
            left = samples[done:] if done and isinstance(samples, np.ndarray) else samples
            taken = driver(part)(begun, first + done, steps - done, command, left)
            if taken < 0:
                return taken - done
            done += taken
            at = part.first + len(part.table)
            if done == steps or at == len(self._places):
                return done


_END = StepRange(ScheduledSegment(0.0, 0.0, 0.0, Ramp(0.0, 0.0)), -1, 0, 0.0, 0.0)
"""Behind the last step range."""


def _line(step_range: StepRange, next_: StepRange) -> list[float]:
    # The last part of a step ends it.
    ended = step_range.steps or int(next_.first != step_range.first)
    place, first, start = (
        place_on(step_range.scheduled),
        step_range.first,
        step_range.scheduled.start,
    )
    times = first, first + ended, start, step_range.offset, step_range.length
    return [*times, *place.segment, place.phase, place.until, place.angle]
