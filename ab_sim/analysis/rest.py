"""Rest position of the deck, and runs relative to it.

A planar deck is measured from its rest position. A deck in space is measured from the position of
its unloaded mounts, so its weight shows in the displacement. That static part is removed before a
whirl is evaluated.
"""

from typing import NamedTuple

import numpy as np

from ab_sim.drive.trajectory import NONE, Trajectory, column_of, matrix_of, tilt_of
from ab_sim.model.dynamics.assemble import start_state, system_of
from ab_sim.model.dynamics.system import layout_of
from ab_sim.scene.model import Scene
from ab_sim.scene.sections import StartDeck


class Rest(NamedTuple):
    """Rest pose of a deck in space."""

    place: np.ndarray
    """Position X, Y, Z of C [m]."""
    turn: np.ndarray
    """Quaternion (w, x, y, z) from deck axes to ground axes."""

    @property
    def tilt(self) -> np.ndarray:
        """Tilt angles alpha, beta, gamma [rad]."""
        return tilt_of(self.turn)

    def counted_from(self, trajectory: Trajectory) -> Trajectory:
        """Return the run with displacements relative to the rest position."""
        if not self.place.any():
            return trajectory
        samples = trajectory.samples.copy()
        for axis, offset in zip("xyz", self.place, strict=True):
            samples[:, column_of(axis, trajectory.channels)] -= offset
        return Trajectory(trajectory.channels, samples)

    def tilt_from(self, trajectory: Trajectory) -> np.ndarray:
        """Return the angle of the shaft from its rest direction [rad], shape (samples,)."""
        upright = matrix_of(self.turn)[:, 2]
        across = np.cross(trajectory.turned[:, :, 2], upright)
        return np.arctan2(np.linalg.norm(across, axis=1), trajectory.turned[:, :, 2] @ upright)


def rest_of(scene: Scene) -> Rest:
    """Return the rest pose of a scene's deck.

    Raises
    ------
    SceneError
        No position is found in which the mounts carry the weight.
    """
    if scene.deck is None or "gravity" not in scene.effects:
        return Rest(np.zeros(3), np.array(NONE))
    unpushed = scene.model_copy(
        update={"start": scene.start.model_copy(update={"deck": StartDeck()})}
    )
    system = system_of(unpushed)
    place, turn, _ = np.split(start_state(unpushed, system)[layout_of(system).deck], [3, 7])
    return Rest(place, turn)


def from_rest(trajectory: Trajectory, scene: Scene) -> Trajectory:
    """Return the run with displacements relative to the scene's rest position of the deck."""
    return rest_of(scene).counted_from(trajectory)
