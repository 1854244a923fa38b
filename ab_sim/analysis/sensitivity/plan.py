"""How the steps along a speed profile change when its numbers do.

Steps lie where they lie; where the profile has a breakpoint within one, that is cut there, and its
parts change their length. A breakpoint that lies just where a step ends is cut at, too: the step
before gets longer by as much as the step behind it gets shorter.
"""

from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import NamedTuple

import numpy as np

from ab_sim.drive.step_plan import FOREVER, StepPlan, StepPlanPart
from ab_sim.spindle import SpeedSchedule
from ab_sim.spindle.step_ranges import StepGrid, StepRange, step_ranges
from ab_sim.stepping.tangent_steps import BEGIN, LATER, LEAVE, LENGTH, PLACE_CHANGE

START, ENDS, ANGLE, OWN = range(4)
"""Of a segment's change: see ``SceneChange.segments``."""


class PlanPart(NamedTuple):
    """Step ranges along segments of one kind."""

    part: StepPlanPart
    changes: np.ndarray
    """Shape (ranges, lines of ``tangent_steps.BEGIN``, keys)."""


def plan_of(
    profile: SpeedSchedule, grid: StepGrid, changes: Sequence[np.ndarray]
) -> tuple[StepPlan, list[PlanPart]]:
    """The plan of all steps along a profile, with its changes.

    Args:
        profile: of the scene.
        grid: of its steps.
        changes: of each segment, shape (3 + its numbers, keys).
    """
    ranges = list(step_ranges(profile, grid, 0, FOREVER))
    plan = StepPlan(ranges)
    lines = list(_changes(ranges, [_number(profile, each) for each in ranges], changes))
    found = []
    for part, _ in plan.after(0):
        own = lines[part.first : part.first + len(part.table)]
        found.append(PlanPart(part, np.array(own)))
    return plan, found


def _number(profile: SpeedSchedule, step_range: StepRange) -> int:
    """Which of the profile's segments it lies in."""
    which = (segment is step_range.scheduled for segment in profile.segments)
    return list(which).index(True)


def _changes(
    ranges: Sequence[StepRange], segments: Sequence[int], changes: Sequence[np.ndarray]
) -> Iterator[np.ndarray]:
    """Of each range, shape (4 + numbers of its place, keys)."""
    starts = [changes[number][START] for number in segments]
    still = np.zeros_like(starts[0])
    groups = groupby(range(len(ranges)), key=lambda k: _group(ranges, segments, k))
    for group in (list(each) for _, each in groups):
        first, last = group[0], group[-1]
        start, parted = starts[first], ranges[first].steps == 0
        # A segment begins where the one before ends, at a breakpoint that moves.
        moves = first > 0 and segments[first - 1] != segments[first]
        begins = start if moves else still
        behind = last + 1 if last + 1 < len(ranges) else None
        breaks = behind is not None and segments[behind] != segments[last]
        cut = breaks and parted and ranges[behind or 0].first == ranges[last].first
        ends = starts[behind or 0] if breaks else still
        own = changes[segments[first]]
        place = [*own[OWN:], own[ANGLE], own[ENDS] - own[START], own[ANGLE]]
        count = len(group)
        longer = ((ends if cut else still) - begins) / count
        for q in range(count):
            found = np.zeros((PLACE_CHANGE + len(place), len(start)))
            found[BEGIN] = begins + q * longer - start
            found[LENGTH], found[LATER] = longer, -start
            if breaks and not cut and q == count - 1:
                found[LEAVE] = ends
            found[PLACE_CHANGE:] = place
            yield found


def _group(
    ranges: Sequence[StepRange], segments: Sequence[int], k: int
) -> tuple[int, int, bool, int]:
    """What belongs together: parts of one step along one segment; whole steps are by themselves."""
    own = ranges[k]
    return (own.first, segments[k], own.steps == 0, 0 if own.steps == 0 else k)
