"""Balls in contact never overlap: an invariant of every run, measured as the reference does."""

import numpy as np

from ab_sim.drive import Drive
from ab_sim.dynamics.neighbours import start_angles
from ab_sim.trajectory import Trajectory
from tests.reference.contact import chain_of
from tests.reference.model import Model
from tests.reference.of_scene import params_of


def assert_apart(drive: Drive, run: Trajectory, within: float = 1e-9) -> None:
    """No two balls overlap by more than a part ``within`` of their distance, at any sample."""
    scene = drive.scene
    if "ball_contact" not in scene.effects or scene.balls.count < 2:
        return
    angles = np.asarray(start_angles(scene))
    chain = chain_of(Model(params_of(scene)), angles)
    free = np.array([chain.gaps(each) for each in run.ball_angles]) / chain.closest
    worst = np.unravel_index(free.argmin(), free.shape)
    assert free[worst] >= -within, (
        f"at {run['time'][worst[0]]} s, contact {worst[1]}: {free[worst]}"
    )
