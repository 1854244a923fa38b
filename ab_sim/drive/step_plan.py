"""Plan of a drive's steps along its speed profile, as tables for the compiled kernel."""

from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator
from itertools import groupby, pairwise
from typing import NamedTuple

import numpy as np

from ab_sim.engine.compiling import KeptArray
from ab_sim.model.dynamics.assemble import place_on
from ab_sim.model.spindle import Ramp, ScheduledSegment, SpeedSchedule
from ab_sim.model.spindle.schedule import Segment
from ab_sim.model.spindle.step_ranges import StepGrid, StepRange, step_ranges

FOREVER = 2**52
"""Number of steps that no run exceeds; step numbers up to it are exact as floats."""


class StepPlanPart(NamedTuple):
    """Step ranges along segments of one kind, which one call of the driver can take."""

    kind: type
    """Kind of the segments."""
    table: np.ndarray
    """Rows of step ranges, with columns as in ``stepping.fixed_step.FIRST``."""
    first: int
    """Number of step ranges of the plan before this part."""


DriverOf = Callable[[StepPlanPart], Callable[..., int]]


class StepPlan:
    """Plan of all steps ahead, created once, so that a call only has to find its first step range.

    Args:
        ahead: the step ranges, at least one, with all parts of whole steps.
    """

    def __init__(self, ahead: Iterable[StepRange]) -> None:
        taken = list(ahead)
        self.begin = taken[0].first
        """Steps taken before the plan begins."""
        self._firsts = [step_range.first for step_range in taken]
        self._parts: list[StepPlanPart] = []
        self._places: list[tuple[StepPlanPart, int]] = []
        """Part of each step range, and its index in that part."""
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
        """Return the plan of all steps along a profile after the first ``first`` ones."""
        return cls(step_ranges(profile, grid, first, FOREVER))

    @property
    def kinds(self) -> set[type[Segment]]:
        """Return the kinds of the segments: each has its own kernel."""
        return {part.kind for part in self._parts}

    def after(self, steps: int) -> Iterator[tuple[StepPlanPart, int]]:
        """Yield the parts after ``steps`` steps, and the step range at which each is entered."""
        at = self._at(steps)
        for part in self._parts:
            if at < part.first + len(part.table):
                yield part, max(at - part.first, 0)

    def _at(self, steps: int) -> int:
        """Return the index of the first step range after ``steps`` steps, at least 0."""
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
        """Take steps after the first ``first`` ones.

        Arguments and result are those of ``fixed_step.advance``.

        Args:
            driver: function that returns the function for steps along a part; see ``Steps.along``.
            samples: receives the samples; a KeptArray has room for at most one step.
        """
        at, done = self._at(first), 0
        while True:
            part, begun = self._places[at]
            rest = samples[done:] if done and isinstance(samples, np.ndarray) else samples
            taken = driver(part)(begun, first + done, steps - done, command, rest)
            if taken < 0:
                return taken - done
            done += taken
            at = part.first + len(part.table)
            if done == steps or at == len(self._places):
                return done


_END = StepRange(ScheduledSegment(0.0, 0.0, 0.0, Ramp(0.0, 0.0)), -1, 0, 0.0, 0.0)
"""Sentinel after the last step range."""


def _line(step_range: StepRange, next_: StepRange) -> list[float]:
    # The last part of a step completes it.
    ended = step_range.steps or int(next_.first != step_range.first)
    place, first, start = (
        place_on(step_range.scheduled),
        step_range.first,
        step_range.scheduled.start,
    )
    times = first, first + ended, start, step_range.offset, step_range.length
    return [*times, *place.segment, place.phase, place.until, place.angle]
