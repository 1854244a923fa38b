"""Where steps go along a profile: short curves are passed in steps of their own."""

import math
from collections.abc import Sequence

import numpy as np
import pytest

from ab_sim.model.spindle import SpeedSchedule
from ab_sim.model.spindle.step_ranges import StepRange, StepResolution, parts, step_ranges

STEP, CYCLE = 1e-3, 12e-3
GRID = StepResolution(STEP, CYCLE)


def curve(start: float, duration: float) -> SpeedSchedule:
    return SpeedSchedule.speed_change(100.0, 300.0, start, duration)


def within(taken: Sequence[StepRange], start: float, duration: float) -> list[StepRange]:
    return [
        one for one in taken if one.scheduled.start == start and math.isfinite(one.scheduled.end)
    ]


@pytest.mark.parametrize("start", [0.1, 0.1003])
@pytest.mark.parametrize("duration", [1e-6, 1e-4, 1e-3, 3.7e-3, 11.9e-3])
@pytest.mark.parametrize("step", [2e-3, 1e-3, 1e-4])
def test_a_short_curve_takes_as_many_steps_as_a_cycle(
    start: float, duration: float, step: float
) -> None:
    profile = curve(start, duration)
    taken = list(step_ranges(profile, StepResolution(step, CYCLE), 0, round(0.2 / step)))
    along = within(taken, start, duration)
    cut = 2 + math.ceil(duration / step)  # each step that it lies in rounds up
    assert CYCLE / step * (1 - 1e-9) <= len(along) <= CYCLE / step + cut
    longest = max(one.length for one in along)
    assert longest <= step * duration / CYCLE * (1 + 1e-9)
    assert sum(one.length for one in along) == pytest.approx(duration, rel=1e-9)
    local = [(one.first * step - start) + one.offset for one in along]
    ends = np.append(local[1:], duration)
    np.testing.assert_allclose(np.add(local, [one.length for one in along]), ends, rtol=1e-9)


def test_half_the_step_halves_them_too() -> None:
    counts = [
        len(
            within(
                list(step_ranges(curve(0.01, 1e-4), StepResolution(step, CYCLE), 0, 80)), 0.01, 1e-4
            )
        )
        for step in (1e-3, 5e-4, 2.5e-4)
    ]
    assert counts == [12, 24, 48]


def test_ramps_and_long_curves_take_whole_steps() -> None:
    """They cost what they did."""
    ramp = SpeedSchedule.start_up(100.0, 1e6, 300.0)
    assert [(one.steps, one.length) for one in step_ranges(ramp, GRID, 0, 5)] == [
        (0, pytest.approx(2e-4)), (0, pytest.approx(8e-4)), (4, STEP),
    ]  # fmt: skip
    long = list(step_ranges(curve(0.01, 15e-3), GRID, 0, 40))
    assert [(one.first, one.steps) for one in long] == [(0, 10), (10, 15), (25, 15)]


@pytest.mark.parametrize("count", [1, 3, 7])
def test_they_do_not_depend_on_how_steps_are_grouped(count: int) -> None:
    profile = curve(0.0053, 3.7e-3)

    def cut(count: int) -> list[tuple[int, float, float]]:
        groups = [step_ranges(profile, GRID, first, count) for first in range(0, 21, count)]
        taken = [one for group in groups for one in group]
        return [
            (one.first + k, one.offset, one.length) for one in taken for k in range(one.steps or 1)
        ]

    assert cut(count) == cut(21)


def test_parts_end_where_they_are_told_to() -> None:
    along = list(parts(curve(0.1, 1e-3), GRID, 100, 0.1004))
    assert len(along) == 5 and sum(one.length for one in along) == pytest.approx(4e-4)


@pytest.mark.parametrize("asked", range(1, 14))
def test_no_more_steps_are_taken_than_are_asked_for(asked: int) -> None:
    """Also just before a breakpoint, here after eleven of them."""
    hold = SpeedSchedule.start_up(0.0, 10.0, 0.11)
    assert hold.end == pytest.approx(11 * STEP)
    taken = list(step_ranges(hold, GRID, 0, asked))
    assert sum(one.steps for one in taken) == asked and not any(one.offset for one in taken)
