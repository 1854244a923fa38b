"""Invariant of every run: balls in contact never overlap, measured as by the reference."""

import numpy as np

from ab_sim.drive import Drive
from ab_sim.drive.trajectory import Trajectory
from ab_sim.model.equations.neighbours import start_angles
from tests.reference.contact import chain_of
from tests.reference.of_scene import plant_of


def least_gap(drive: Drive, run: Trajectory) -> float:
    """Return the smallest gap of all samples, relative to the balls' distance in contact.

    It is infinite if balls can pass each other.
    """
    scene = drive.scene
    if "ball_contact" not in scene.effects or scene.balls.count < 2 or not len(run):
        return np.inf
    chain = chain_of(plant_of(scene), np.asarray(start_angles(scene)))
    if "race_runout" in scene.effects:
        gaps = np.array([chain.gaps(each) for each in run.ball_angles])
    else:
        gaps = run.ball_angles[:, chain.ahead] - run.ball_angles[:, chain.behind]
        gaps += chain.turns - chain.closest
    return float((gaps / chain.closest).min())


def assert_apart(drive: Drive, run: Trajectory, within: float = 1e-9) -> None:
    """Assert that no balls overlap by more than ``within`` times their distance in any sample."""
    assert least_gap(drive, run) >= -within
