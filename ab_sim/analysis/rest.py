"""Where the deck hangs at rest, and a run as seen from there.

A deck in the plane counts from there anyway; one in space from where its mounts are relaxed, so
that its weight shows in the displacement, and is to be taken out before a whirl is judged.
"""

from typing import NamedTuple

import numpy as np

from ab_sim.drive.orientation import NONE, matrix_of, tilt_of
from ab_sim.drive.trajectory import Trajectory, column_of
from ab_sim.dynamics.assemble import start_state, system_of
from ab_sim.dynamics.layout import layout_of
from ab_sim.scene.model import Scene
from ab_sim.scene.sections import StartDeck


class Rest(NamedTuple):
    """A deck in space, at rest."""

    place: np.ndarray
    """X, Y, Z of C [m]."""
    turn: np.ndarray
    """Quaternion (w, x, y, z) from deck axes to the ground's."""

    @property
    def tilt(self) -> np.ndarray:
        """Angles alpha, beta, gamma [rad]."""
        return tilt_of(self.turn)

    def counted_from(self, trajectory: Trajectory) -> Trajectory:
        """The same run, with displacements that count from here."""
        if not self.place.any():
            return trajectory
        samples = trajectory.samples.copy()
        for axis, hangs in zip("xyz", self.place, strict=True):
            samples[:, column_of(axis, trajectory.channels)] -= hangs
        return Trajectory(trajectory.channels, samples)

    def tilt_from(self, trajectory: Trajectory) -> np.ndarray:
        """Angle between the shaft and where it points here [rad], shape (samples,)."""
        upright = matrix_of(self.turn)[:, 2]
        across = np.cross(trajectory.turned[:, :, 2], upright)
        return np.arctan2(np.linalg.norm(across, axis=1), trajectory.turned[:, :, 2] @ upright)


def rest_of(scene: Scene) -> Rest:
    """Where the deck of a scene hangs.

    Raises:
        SceneError: no place is found where its mounts hold its weight.
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
    """The same run, with displacements that count from where the deck hangs."""
    return rest_of(scene).counted_from(trajectory)
