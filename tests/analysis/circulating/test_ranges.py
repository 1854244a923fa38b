"""Where balls cannot circulate any more: borders, with long runs on either side."""

import dataclasses
import json
import math
from typing import Any

import numpy as np
import pytest

from ab_sim.analysis.circulating import (
    BunchRange,
    CirculatingBunch,
    drag_ranges,
    drive_of,
    speed_ranges,
    stalled,
)
from ab_sim.analysis.circulating.bunch import MOST_SWING, BunchDrive
from ab_sim.analysis.circulating.ranges import FOLD, LARGE_SWING, SEARCH_END, UNSTABLE
from tests.analysis.circulating.runs import AT, mean_speeds, stalling

APART = 0.006
"""From a border, of the value there: nearer to it its small disturbance is large."""


def numbers_of(**changes: Any) -> BunchDrive:
    found = drive_of(stalling(**changes))
    assert found is not None
    return found


def only(found: list[BunchRange]) -> BunchRange:
    assert len(found) == 1
    return found[0]


def stays(scene: Any, speed: float, begin: CirculatingBunch) -> bool:
    """Whether the bunch is still there at the end of a run; otherwise all balls are at rest."""
    run = mean_speeds(scene, speed, dataclasses.replace(begin, spindle_speed=speed))[: begin.count]
    if (np.abs(run - begin.speed) < 0.03 * begin.speed).all():
        return True
    assert (np.abs(run - speed) < 1e-3 * speed).all()
    return False


@pytest.mark.parametrize("count", [1, 2, 4, 6])
def test_beyond_the_highest_speed_the_bunch_comes_to_rest(count: int) -> None:
    scene, numbers = stalling(), numbers_of()
    reach = only(speed_ranges(numbers, count))
    assert reach.high_end == (FOLD if count == 1 else UNSTABLE)
    begin = stalled(numbers, reach.high, count)
    assert begin is not None and begin.speed == reach.high_speed
    assert stays(scene, (1.0 - APART) * reach.high, begin)
    assert not stays(scene, (1.0 + APART) * reach.high, begin)


@pytest.mark.parametrize("count", [2, 6])
def test_beyond_the_largest_drag_the_bunch_comes_to_rest(count: int) -> None:
    numbers = numbers_of()
    reach = only(drag_ranges(numbers, AT, count))
    begin = stalled(numbers._replace(drag=reach.high), AT, count)
    assert begin is not None
    for share, expected in ((1.0 - APART, True), (1.0 + APART, False)):
        assert stays(stalling(cb=share * reach.high), AT, begin) == expected


@pytest.mark.parametrize("count", [2, 6])
def test_balls_that_are_too_light_do_not_circulate(count: int) -> None:
    """n m^2 decides at the critical speed; mass that balls lose, the rotor gains."""

    def at(mass: float) -> Any:
        return stalling(m=(mass,) * count, me=5e-5 * count / 6)

    low, high = 1e-4, 4e-3
    while high - low > 1e-9:
        middle = 0.5 * (low + high)
        numbers = drive_of(at(middle))
        assert numbers is not None
        low, high = (low, middle) if stalled(numbers, AT, count) else (middle, high)
    numbers = drive_of(at(high))
    assert numbers is not None
    begin = stalled(numbers, AT, count)
    assert begin is not None
    assert stays(at((1.0 + APART) * high), AT, begin)
    assert not stays(at((1.0 - APART) * high), AT, begin)


def test_the_highest_speed_of_all_balls_in_a_formula() -> None:
    """They part where the bunch turns at the critical speed; a fold is just beyond."""
    reach = only(speed_ranges(numbers_of(), 6))
    critical = math.sqrt(58800.0 / 0.524)
    assert reach.high_speed == pytest.approx(critical, rel=1e-9)
    lost = 6 * (4e-3) ** 2 * critical**3 / (20.0 * 0.05)
    assert reach.high == pytest.approx(critical + lost, rel=1e-9)
    drags = only(drag_ranges(numbers_of(), AT, 6))
    assert drags.high == pytest.approx(0.05 * lost / (AT - critical), rel=1e-9)


def test_a_single_balls_fold_is_where_speed_has_no_slope() -> None:
    """w(s), explicit for q = 0, has its largest value there."""
    numbers = numbers_of(m=(8e-3,), me=1e-4)
    reach = only(speed_ranges(numbers, 1))
    s = np.linspace(0.9, 1.1, 2_000_001) * reach.high_speed
    square = (58800.0 - 0.524 * s * s) ** 2 + (20.0 * s) ** 2
    w = s + 20.0 * (8e-3) ** 2 * s**5 / (0.05 * square)
    inside = (w[1:-1] > w[:-2]) & (w[1:-1] > w[2:])
    assert reach.high_end == FOLD
    assert reach.high == pytest.approx(float(w[1:-1][inside][0]), rel=1e-9)


def test_below_the_range_swings_are_too_large_to_know() -> None:
    numbers = numbers_of()
    reach = only(speed_ranges(numbers, 6, also=(AT, 0.0)))
    assert reach.low_end == LARGE_SWING
    assert numbers.stiffness / numbers.mass < reach.low**2
    at_end = stalled(numbers, reach.low, 6)
    assert at_end is not None and at_end.bunch_swing == pytest.approx(MOST_SWING, rel=1e-6)
    assert only(drag_ranges(numbers, -AT, 6)).low_end == SEARCH_END
    assert json.loads(json.dumps(reach.report()))["low_end"] == "swings"
