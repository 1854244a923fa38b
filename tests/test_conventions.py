"""Ball angles are within one turn, in tables and in pictures."""

import math

import numpy as np
import pytest

from ab_sim.analysis.metrics.wording import angles_text
from ab_sim.base.presentation import in_one_turn
from ab_sim.show.curves import in_degrees


@pytest.mark.parametrize(
    ("angle", "shown"),
    [(0.0, 0.0), (30.0, 30.0), (31.0, -329.0), (142.0, -218.0), (180.0, -180.0), (-9566.8, -206.8)],
)
def test_angles_are_shown_from_above_minus_330_to_30_deg(angle: float, shown: float) -> None:
    assert math.degrees(in_one_turn(math.radians(angle))) == pytest.approx(shown)
    (degrees,) = in_degrees(np.array([math.radians(angle)]))
    assert degrees == pytest.approx(shown), "of a picture"
    assert angles_text((math.radians(angle),), None) == f"{shown:.1f} deg", "of a table"


def test_angles_that_are_there_already_stay_to_the_bit() -> None:
    angles = np.radians(np.linspace(-329.0, 29.0, 1000))
    assert in_one_turn(angles).tobytes() == angles.tobytes()


def test_a_curve_that_leaves_the_turn_has_a_gap_there() -> None:
    shown = in_degrees(np.radians([0.0, 20.0, 40.0, 60.0]))
    np.testing.assert_allclose(shown, [0.0, 20.0, np.nan, -300.0])
