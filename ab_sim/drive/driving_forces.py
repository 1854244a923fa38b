"""The thesis' driving force on the balls: a figure of merit, not a term of the equations."""

from typing import NamedTuple

import numpy as np

from ab_sim.drive.trajectory import Trajectory
from ab_sim.equations.motion import Ball
from ab_sim.equations.sums import over_effects
from ab_sim.scene.model import Scene


class DrivenBalls(NamedTuple):
    """What the driving force depends on of balls and race."""

    masses: tuple[float, ...]
    """m_i [kg]."""
    friction: tuple[float, ...]
    """mu, coefficient of friction of each ball: beta_b/a where it rolls (beta_b is a length)."""
    heights: tuple[float, ...]
    """Of each ball's race above C [m]; without meaning in the plane."""
    race_radius: float
    """R [m]."""

    @classmethod
    def of(cls, scene: Scene) -> "DrivenBalls":
        """Those of a scene."""
        effects, balls = tuple(scene.effects.values()), scene.balls
        each = map(Ball, balls.masses, balls.radii)
        return cls(
            balls.masses,
            tuple(float(over_effects(effects, "friction_coefficient", 0.0, ball)) for ball in each),
            tuple(scene.race.heights[race] for race in balls.races),
            scene.race.radius,
        )

    def forces(self, trajectory: Trajectory) -> np.ndarray:
        """Driving force on each ball [N], shape (samples, balls): thesis (2-15), signed.

        Of a deck in space: with the displacement of the centre of the ball's race, on deck axes.
        """
        centre = _race_centres(trajectory, self.heights)
        return self.force(
            centre[..., 0],
            centre[..., 1],
            trajectory["angle"][:, None] + trajectory.ball_angles,
            trajectory["speed"][:, None] + trajectory.ball_rates,
        )

    def force(
        self, x: np.ndarray, y: np.ndarray, angle: np.ndarray, speed: np.ndarray
    ) -> np.ndarray:
        """Driving force on balls [N], shape (samples, balls). Arguments broadcast to that.

        Positive is the thesis' forward: the way to -180 deg, of *falling* theta. As a force along
        the race in the direction of growing theta it is -f_d,i.

        f_d,i = m psi_i'^2 (W sin gamma_i - mu (R - W cos gamma_i)) with gamma_i = pi + phi -
        theta_i (thesis (2-15), (2-16), whose phi is the lag, -phi here), *signed*: the print has
        abs(sin gamma), but its figures'
        values are the signed form's first forward peak.

        Args:
            x, y: displacement of the race's centre [m]: in the plane the deck's on inertial axes.
            angle: the balls' angles psi_i on the same axes [rad].
            speed: their absolute speeds psi_i' [rad/s].
        """
        # sin gamma = sin(psi_i - delta), cos gamma = -cos(psi_i - delta), delta the whirl's
        # direction.
        sine, cosine = np.sin(angle), np.cos(angle)
        across, along = x * sine - y * cosine, x * cosine + y * sine
        masses, friction = np.array(self.masses), np.array(self.friction)
        return np.asarray(masses * speed**2 * (across - friction * (self.race_radius + along)))


def driving_forces(trajectory: Trajectory, scene: Scene) -> np.ndarray:
    """Driving force on each ball of a scene's run [N], shape (samples, balls)."""
    return DrivenBalls.of(scene).forces(trajectory)


def _race_centres(trajectory: Trajectory, heights: tuple[float, ...]) -> np.ndarray:
    """How far each ball's race has moved [m], shape (samples, balls, 2 or 3)."""
    place = trajectory.position[:, None, :]
    if not trajectory.tilts:
        return place
    lift = np.zeros((len(heights), 3))
    lift[:, 2] = heights
    # A row times the matrix that turns to the ground's axes is a column turned the other way.
    return (place - lift) @ trajectory.turned + lift
