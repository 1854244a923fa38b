"""Driving force of the thesis on the balls: a derived quantity, not a term of the equations."""

from typing import NamedTuple

import numpy as np

from ab_sim.base.ordered_sum import ordered_dot
from ab_sim.drive.trajectory import Trajectory
from ab_sim.model.equations.motion import Ball
from ab_sim.model.equations.sums import over_effects
from ab_sim.scene.model import Scene


class DrivenBalls(NamedTuple):
    """Parameters of balls and race on which the driving force depends."""

    masses: tuple[float, ...]
    """Ball masses m_i [kg]."""
    friction: tuple[float, ...]
    """Friction coefficients mu of the balls; beta_b/a if they roll (beta_b is a length)."""
    heights: tuple[float, ...]
    """Heights of the balls' races above C [m]; unused in the plane."""
    race_radius: float
    """Race radius R [m]."""

    @classmethod
    def of(cls, scene: Scene) -> "DrivenBalls":
        """Return the parameters of a scene."""
        effects, balls = tuple(scene.effects.values()), scene.balls
        ball_list = map(Ball, balls.masses, balls.radii)
        return cls(
            balls.masses,
            tuple(
                float(over_effects(effects, "friction_coefficient", 0.0, ball))
                for ball in ball_list
            ),
            tuple(scene.race.heights[race] for race in balls.races),
            scene.race.radius,
        )

    def forces(self, trajectory: Trajectory) -> np.ndarray:
        """Return the driving force on each ball [N], shape (samples, balls): thesis (2-15), signed.

        For a deck in space, the displacement is that of the centre of the ball's race, on deck
        axes.
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
        """Return the driving force on balls [N], shape (samples, balls); arguments broadcast to it.

        Positive is the thesis' forward direction, towards -180 deg, of *decreasing* theta. As a
        force along the race in the direction of increasing theta it is -f_d,i.

        f_d,i = m psi_i'^2 (W sin gamma_i - mu (R - W cos gamma_i)) with gamma_i = pi + phi -
        theta_i (thesis (2-15), (2-16), whose phi is the lag, -phi here), *signed*. The thesis
        prints abs(sin gamma), but the values in its figures are those of the first forward peak of
        the signed form.

        Args:
            x, y: displacement of the race's centre [m]; in the plane, of the deck on inertial axes.
            angle: angles psi_i of the balls on the same axes [rad].
            speed: absolute speeds psi_i' of the balls [rad/s].
        """
        # sin gamma = sin(psi_i - delta), cos gamma = -cos(psi_i - delta), delta the whirl's
        # direction.
        sine, cosine = np.sin(angle), np.cos(angle)
        across, along = x * sine - y * cosine, x * cosine + y * sine
        masses, friction = np.array(self.masses), np.array(self.friction)
        return np.asarray(masses * speed**2 * (across - friction * (self.race_radius + along)))


def driving_forces(trajectory: Trajectory, scene: Scene) -> np.ndarray:
    """Return the driving force on each ball of a scene's run [N], shape (samples, balls)."""
    return DrivenBalls.of(scene).forces(trajectory)


def _race_centres(trajectory: Trajectory, heights: tuple[float, ...]) -> np.ndarray:
    """Return the displacement of each ball's race [m], shape (samples, balls, 2 or 3)."""
    place = trajectory.position[:, None, :]
    if not trajectory.tilts:
        return place
    lift = np.zeros((len(heights), 3))
    lift[:, 2] = heights
    # The transposed matrix turns from inertial axes to deck axes.
    to_deck = trajectory.turned.swapaxes(1, 2)[:, None]
    return ordered_dot(to_deck, (place - lift)[:, :, None]) + lift
