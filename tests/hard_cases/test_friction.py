"""Friction coefficients from 1e-9 to 1, from rest: the first 13 ms, and slow stick-slip after.

At the start of a run-up one ball's normal force is negative for milliseconds, so that the friction
law has no force to be proportional to; sign functions smoothed by a velocity either creep or are
stiff. Asserted: the first 13 ms agree with the independent simulator; over 3 s energy balances at
every coefficient, losses are positive, no step has unresolved events, and large friction ends in
sticking.
"""

import numpy as np
import pytest

from ab_sim.scene import Scene
from tests.hard_cases.extremes import APART, RUBBING, errors, imbalance, run, scene_of


def rubbing(coefficient: float, **start: float) -> Scene:
    effects = {**RUBBING, "rolling_friction": {"arm": coefficient * 1e-3}}
    return scene_of(effects=effects, start={"ball_angles": list(APART), **start})


@pytest.mark.parametrize("coefficient", [0.0, 1e-9, 1e-6, 1e-3, 0.03, 0.3, 1.0])
def test_start_from_rest(coefficient: float) -> None:
    drive = run(rubbing(coefficient), 0.013)
    assert imbalance(drive) < 1e-9
    balls, deck = errors(drive)
    assert balls < 1e-11 and deck < 1e-7
    later = run(rubbing(coefficient), 3.0)
    assert imbalance(later) < 1e-9 and later.energy().dissipated > 0


@pytest.mark.parametrize("coefficient", [0.3, 1.0])
def test_large_friction_ends_in_sticking(coefficient: float) -> None:
    now = run(rubbing(coefficient), 3.0).observe()
    assert now.stuck.all()
    np.testing.assert_array_equal(now.theta_rate, 0.0)
