"""The thesis' driving force on the balls, of samples of a run."""

import numpy as np

from ab_sim.drive.trajectory import Trajectory
from ab_sim.dynamics.driving_force import driving_force
from ab_sim.scene.model import Scene


def driving_forces(trajectory: Trajectory, scene: Scene) -> np.ndarray:
    """Driving force on each ball [N], shape (samples, balls): thesis (2-15), signed.

    Of a deck in space: with the displacement of the centre of the ball's race, on deck axes.
    """
    centre = _race_centres(trajectory, scene)
    return driving_force(
        scene,
        centre[..., 0],
        centre[..., 1],
        trajectory["angle"][:, None] + trajectory.ball_angles,
        trajectory["speed"][:, None] + trajectory.ball_rates,
    )


def _race_centres(trajectory: Trajectory, scene: Scene) -> np.ndarray:
    """How far each ball's race has moved [m], shape (samples, balls, 2 or 3)."""
    place = trajectory.position[:, None, :]
    if not trajectory.tilts:
        return place
    lift = np.zeros((scene.balls.count, 3))
    lift[:, 2] = [scene.race.heights[race] for race in scene.balls.races]
    # A row times the matrix that turns to the ground's axes is a column turned the other way.
    return (place - lift) @ trajectory.turned + lift
