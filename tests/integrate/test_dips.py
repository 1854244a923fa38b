"""A force that dips below zero and rises again within one step is an event, too."""

import numpy as np

from ab_sim.drive import Drive
from ab_sim.drive.trajectory import Trajectory
from tests.effects.parts import Changes, scene_of

SPEED, RACE, G = 60.0, 0.01, 9.80665
HARDEST = G / np.sqrt((RACE * SPEED**2) ** 2 - G**2)
"""Largest ratio of weight along the race to normal force in a turn, on a deck that stands still."""


DIPS: Changes = {
    "rotor": {"total_mass": 1e3, "eccentricity": 0.0},
    "effects": {
        "suspension": {"stiffness": 1e9, "damping": 1e5},
        "gravity": {"tilt": np.pi / 2},
        "race_friction": {"coefficient": HARDEST / 1.0002},
    },
    "start": {"speed": SPEED, "ball_angles": [0.0, 2.0]},
    "profile": None,
}


def turning(step: float) -> tuple[Drive, Trajectory]:
    """Two balls on edge that friction holds but for 0.7 ms of each half turn, 1.0002 times over."""
    drive = Drive(scene_of("friction", DIPS, {"solver": {"step": step}}))
    return drive, drive.advance(round(1.0 / step))


def test_friction_that_gives_way_within_a_step() -> None:
    (coarse, one), (fine, other) = turning(1e-3), turning(2e-5)
    assert fine.events >= 4 * 2 * 9, "each ball lets go and sticks, twice in each of nine turns"
    assert coarse.events == fine.events
    assert np.abs(one.ball_angles - one.ball_angles[0]).max() > 1e-8
    np.testing.assert_allclose(one.ball_angles, other.ball_angles[49::50], rtol=0.0, atol=1e-11)
