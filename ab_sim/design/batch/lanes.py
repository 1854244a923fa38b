"""Step plans of eight runs, merged into one plan for all lanes."""

import bisect
import itertools
from collections.abc import Iterator, Sequence

import numpy as np

from ab_sim.engine.stepping.side_by_side import LANES, LanePlan
from ab_sim.model.dynamics.assemble import place_on
from ab_sim.model.dynamics.system import ActiveSegment
from ab_sim.model.spindle.speed_laws import RampAndCosine
from ab_sim.model.spindle.step_ranges import StepRange


def merged(step_plans: Sequence[Sequence[StepRange]], step: float) -> tuple[type, LanePlan]:
    """Return one plan for eight runs, cut at the breakpoints of each of them.

    A run that divides a step into fewer parts than another gets additional parts of zero length,
    which do not change its state.

    Args:
        step_plans: step ranges of each run, all over the same steps.
        step: length of a step [s].

    Returns:
        The type of all segments, and the plan.
    """
    rows = [row for ranges in _ranges_between_cuts(step_plans) for row in _plan_rows(ranges, step)]
    same_type = (
        len({type(step_range.scheduled.segment) for _, _, lanes in rows for step_range in lanes})
        == 1
    )
    numbers = [(lanes[0].first, steps, finishes) for steps, finishes, lanes in rows]
    places = [[_place(step_range, same_type) for step_range in lanes] for _, _, lanes in rows]
    times = [
        [(step_range.scheduled.start, step_range.offset, step_range.length) for step_range in lanes]
        for _, _, lanes in rows
    ]
    constants = [[[*place.segment, *place[1:]] for place in row] for row in places]
    return type(places[0][0].segment), LanePlan(
        np.array(numbers, np.int64), _by_lane(constants), _by_lane(times)
    )


def _place(step_range: StepRange, same_type: bool) -> ActiveSegment:
    place = place_on(step_range.scheduled)
    return place if same_type else place._replace(segment=RampAndCosine.of(place.segment))


def _ranges_between_cuts(
    step_plans: Sequence[Sequence[StepRange]],
) -> Iterator[list[list[StepRange]]]:
    """Yield, for each interval between cuts, the step ranges of each run.

    These are whole steps, or parts of one step.
    """
    grouped = [
        [
            list(group)
            for _, group in itertools.groupby(step_plan, key=lambda step_range: step_range.first)
        ]
        for step_plan in step_plans
    ]
    firsts = [[group[0].first for group in groups] for groups in grouped]
    cuts = sorted(set().union(*firsts))
    last = step_plans[0][-1]
    for first, end in itertools.pairwise([*cuts, last.first + max(last.steps, 1)]):
        ranges = []
        for starts, groups in zip(firsts, grouped, strict=True):
            parts = groups[bisect.bisect_right(starts, first) - 1]
            if parts[0].steps:
                parts = [parts[0]._replace(first=first, steps=end - first)]
            ranges.append(parts)
        yield ranges


def _plan_rows(
    ranges: list[list[StepRange]], step: float
) -> Iterator[tuple[int, bool, list[StepRange]]]:
    """Yield rows of a plan.

    Each row has the number of steps, whether they end in this row, and the step range of each run.
    """
    most = max(len(parts) for parts in ranges)
    for k in range(most):
        lanes = [
            parts[k] if k < len(parts) else parts[-1]._replace(offset=step, length=0.0)
            for parts in ranges
        ]
        yield max(1, *(step_range.steps for step_range in lanes)), k + 1 == most, lanes


def _by_lane(values: Sequence[Sequence[Sequence[float]]]) -> np.ndarray:
    """Return an array of shape (rows, floats, lanes) from one of shape (rows, lanes, floats)."""
    table = np.array(values, float).transpose(0, 2, 1)
    assert table.shape[-1] == LANES
    return np.ascontiguousarray(table)
