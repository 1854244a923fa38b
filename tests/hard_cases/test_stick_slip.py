"""Stick-slip for minutes: gravity pulls each ball loose once a revolution, friction holds it again.

With sign() friction every reversal chatters, with tanh() balls creep; errors add up. Asserted over
two minutes, tilted by 18 deg: a thousand events and more, none left unlocated, the energy balance,
and that half the step gives the same motion.
"""

import numpy as np

from ab_sim.drive import Drive
from tests.hard_cases.extremes import RUBBING, imbalance, scene_of
from tests.overlap import assert_apart


def stick_slip(step: float) -> Drive:
    effects = {
        **RUBBING,
        "rolling_friction": {"arm": 3e-4},
        "gravity": {"tilt": 0.32},
        "viscous_drag": {"coefficient": 0.05},
    }
    scene = scene_of(
        effects=effects,
        start={"speed": 30.0, "ball_angles": [0.5, 2.5]},
        profile=None,
        solver={"step": step},
    )
    return Drive(scene, energy_balance=True)


def test_two_minutes() -> None:
    drive = stick_slip(1e-3)
    stuck = 0
    for _ in range(1200):
        assert_apart(drive, drive.advance(100))
        stuck += int(drive.observe().stuck.sum())
    assert drive.events > 1000
    assert drive.steps_with_unresolved_events == 0
    assert 0 < stuck < 2400, "it sticks, and it slips"
    assert imbalance(drive) < 1e-8


def test_half_the_step_moves_the_same() -> None:
    coarse, fine = stick_slip(1e-3), stick_slip(5e-4)
    one, other = coarse.advance(3000), fine.advance(6000)
    assert coarse.events > 20
    np.testing.assert_allclose(one.ball_angles, other.ball_angles[1::2], atol=1e-8)
