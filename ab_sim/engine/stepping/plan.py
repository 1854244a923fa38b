"""Ranges of equal steps between a schedule's breakpoints, and the times of these steps."""

from typing import Any, NamedTuple

from ab_sim.engine.compiling.kinds import Cube, Floats
from ab_sim.model.equations.motion import ActiveSegment
from ab_sim.model.spindle.step_ranges import StepRange

FIRST, END, START, OFFSET, LENGTH, PLACE = range(6)
"""Columns of a step plan, with one line per step range:

- FIRST: steps taken before the range.
- END: steps taken after it, including a step that its part completes.
- START: beginning of its profile segment [s].
- OFFSET: offset of a part within its step [s].
- LENGTH: length of each step, or of the part [s].
- PLACE: first of the numbers of the active profile segment, in the order of ``SceneFunctions.c``.
"""
_PLACE_UNTIL = 2
"""Position, counted from the last column, of the local time at which the segment ends."""


def plan_line(step_range: StepRange, end: int, segment: ActiveSegment) -> list[Any]:
    """Return the plan's line for a step range; ``end``: the run's number of steps at its end."""
    first, start = step_range.first, step_range.scheduled.start
    return [first, end, start, step_range.offset, step_range.length, *segment.numbers]


class EqualSteps(NamedTuple):
    """Consecutive steps of one length, or part of a step, within one profile segment.

    *Local* times count from the beginning of the segment. They are products of step and number, not
    sums, so that they do not depend on how a run is divided into calls. The offset is added last,
    so that a part of microseconds keeps its digits.
    """

    first: float
    """Number of steps of the run before the first of these steps."""
    start: float
    """Beginning of the profile segment [s]."""
    offset: float
    """Time from the nominal step's beginning to the first of these steps [s]; 0 for whole steps."""
    length: float
    """Length of each step [s]: the nominal length, or part of it next to a breakpoint."""
    until: float
    """Local time at which the segment ends [s]."""
    nominal: float
    """Nominal length of a step [s]."""

    def profile_time(self, done: int) -> float:
        """Return the local time at which the profile is evaluated after ``done`` steps [s].

        Part of a step shares the sample of the whole step, and so the time at its end.
        """
        return (self.first + done) * self.nominal - self.start

    def time_after(self, done: int) -> float:
        """Return the local time at the beginning, or at the end of the ``done``-th step [s]."""
        if done > 0 and self.length != self.nominal:
            return self.profile_time(done - 1) + self.offset + self.length
        return self.profile_time(done) + self.offset


def equal_steps(line: Floats, first: float, nominal: float) -> EqualSteps:
    """Return the steps in a line of a step plan after the first ``first`` steps of the run."""
    until = line[line.size - _PLACE_UNTIL]
    return EqualSteps(first, line[START], line[OFFSET], line[LENGTH], until, nominal)


class LanePlan(NamedTuple):
    """Step plan of eight runs, cut at the breakpoints of each run's schedule."""

    lines: Cube
    """Step ranges of each run, shape (rows, 8, columns as above). FIRST and END of a row are those
    of all runs. LENGTH is 0 where a run has no further part of a step."""

    def steps_of(self, s: int, lane: int, nominal: float) -> EqualSteps:
        """Return one run's steps in row s; ``nominal`` is the nominal length of a step [s]."""
        line = self.lines[s, lane]
        return equal_steps(line, line[FIRST], nominal)

    def count(self, s: int) -> int:
        """Return the number of steps in row s, 1 for part of a step."""
        return max(int(self.lines[s, 0, END] - self.lines[s, 0, FIRST]), 1)

    def is_part(self, s: int) -> bool:
        """Return whether row s is part of a step that another row completes."""
        return self.lines[s, 0, END] == self.lines[s, 0, FIRST]
