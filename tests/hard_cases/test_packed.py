"""64 balls in a packed row, as `ball_contact` starts them: 63 contacts closed at once.

Penalty contacts make this stiff; event-driven ones can hang in endless bounces. Asserted: the row
stays a row of bodies that do not overlap, and energy balances; overlapping balls are refused with a
start that works. Without friction the row breaks up into thousands of impacts. Some steps have
too many to locate: those are counted and reported, the balls do not pass each other, and energy
balances all the same.

That a push also presses on the race, and so raises friction, is left out of the model: with it,
branches changed back and forth at one instant until the step's events were used up.
"""

import numpy as np
import pytest

from ab_sim.drive import Drive
from ab_sim.errors import SceneError
from tests.hard_cases.extremes import RUBBING, imbalance, run, scene_of

ROW = {"count": 64, "mass": 1e-4, "radius": 4e-4}
NEED = 2 * np.arcsin(0.04)


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
    assert np.diff(drive.observe().theta).min() > NEED - 1e-9
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
        ledger=True,
    )
    while drive.events < 300:
        part = drive.advance(20)
        assert np.isfinite(part.samples).all()
        assert np.diff(part.ball_angles, axis=1).min() > NEED - 1e-8
        assert drive.time < 1.0
    assert imbalance(drive) < 1e-9


def test_overlap_is_refused_with_a_start_that_works() -> None:
    with pytest.raises(SceneError, match="leave the angles out to start in a packed row"):
        scene_of(effects=RUBBING, start={"ball_angles": [0.3, 0.3]})
    run(scene_of(effects=RUBBING), 0.1)


def test_two_stuck_balls_that_touch_let_go_once() -> None:
    """At t = 2.17 s, where the one ahead pushes the one behind back."""
    run(scene_of(effects={**RUBBING, "rolling_friction": {"arm": 3e-5}}), 2.2)


def test_a_row_of_sixteen_under_gravity() -> None:
    """Coefficient 1, the drive on edge."""
    effects = {
        **RUBBING,
        "rolling_friction": {"arm": ROW["radius"]},
        "gravity": {"tilt": np.pi / 2},
        "viscous_drag": {"coefficient": 0.05},
    }
    balls, start = {**ROW, "count": 16}, {"speed": 5.0}
    run(
        scene_of(balls=balls, effects=effects, start=start, profile=None, solver={"step": 5e-4}),
        2e-3,
    )
