"""64 balls in a packed row, as `ball_contact` starts them: 63 contacts closed at once.

Penalty contacts make this stiff; event-driven ones can hang in endless bounces. Asserted: the row
stays a row of bodies that do not overlap, and energy balances; overlapping balls are refused with a
start that works. Without friction the row breaks up into many impacts.

That a push also presses on the race, and so raises friction, is left out of the model: with it,
branches changed back and forth at one instant until the step's events were used up.
"""

import numpy as np
import pytest

from ab_sim.base.errors import SceneError
from ab_sim.drive import Drive
from tests.hard_cases.extremes import RUBBING, imbalance, run, scene_of
from tests.overlap import assert_apart

ROW = {"count": 64, "mass": 1e-4, "radius": 4e-4}


@pytest.mark.parametrize(("tilt", "coefficient"), [(0.0, 0.03), (np.pi / 2, 1.0)])
def test_a_packed_row_stays_apart(tilt: float, coefficient: float) -> None:
    effects = {
        **RUBBING,
        "rolling_friction": {"arm": coefficient * ROW["radius"]},
        "gravity": {"tilt": tilt},
        "viscous_drag": {"coefficient": 0.05},
    }
    drive = run(
        scene_of(
            balls=ROW, effects=effects, start={"speed": 50.0}, profile=None, solver={"step": 5e-4}
        ),
        2.0,
    )
    assert imbalance(drive) < 1e-9


def test_a_row_that_nothing_holds_breaks_up_into_impacts() -> None:
    """On edge, without friction: the race turns away from under it and the balls fall about."""
    effects = {
        **RUBBING,
        "rolling_friction": {"arm": 0.0},
        "gravity": {"tilt": np.pi / 2},
        "viscous_drag": {"coefficient": 0.05},
    }
    start = {"speed": 5.0}
    drive = Drive(
        scene_of(balls=ROW, effects=effects, start=start, profile=None, solver={"step": 5e-4}),
        energy_balance=True,
    )
    while drive.events < 300:
        part = drive.advance(20)
        assert np.isfinite(part.samples).all()
        assert_apart(drive, part)
        assert drive.time < 1.0
    assert imbalance(drive) < 1e-9


def test_overlap_is_refused_with_a_start_that_works() -> None:
    with pytest.raises(SceneError, match="leave the angles out"):
        scene_of(effects=RUBBING, start={"ball_angles": [0.3, 0.3]})
    run(scene_of(effects=RUBBING), 0.1)


def test_two_stuck_balls_that_touch_let_go_once() -> None:
    """At t = 2.17 s, where the one ahead pushes the one behind back."""
    run(scene_of(effects={**RUBBING, "rolling_friction": {"arm": 3e-5}}), 2.2)


@pytest.mark.parametrize(("balls", "speed"), [(12, 0.0), (14, 10.0)])
def test_balls_that_the_race_does_not_carry_stay_apart(balls: int, speed: float) -> None:
    """On edge: where N < 0, a ball leans on one that sticks, and went through it.

    12 balls overlapped by 0.30 rad, after 2 events; 14 made 550,000 events in 1.5 s.
    """
    effects = {
        **RUBBING,
        "rolling_friction": {"arm": 0.002 * 1.5e-3},
        "gravity": {"tilt": np.pi / 2},
        "viscous_drag": {"coefficient": 0.05},
    }
    row = {"count": balls, "mass": 2e-3 / balls, "radius": 1.5e-3}
    drive = run(scene_of(balls=row, effects=effects, start={"speed": speed}, profile=None), 1.5)
    assert 10 < drive.events < 10_000
    assert imbalance(drive) < 1e-9
