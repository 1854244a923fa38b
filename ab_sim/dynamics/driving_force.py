"""The thesis' driving force on the balls: a figure of merit, not a term of the equations."""

import numpy as np

from ab_sim.dynamics.motion import Ball
from ab_sim.dynamics.system import friction_coefficient
from ab_sim.scene.model import Scene


def driving_force(
    scene: Scene, x: np.ndarray, y: np.ndarray, angle: np.ndarray, speed: np.ndarray
) -> np.ndarray:
    """Driving force on balls [N]. Arguments broadcast.

    Positive is the thesis' forward: the way to -180 deg, of *falling* theta. As a force along
    the race in the direction of growing theta it is -f_d,i.

    f_d,i = m psi_i'^2 (W sin gamma_i - mu (R - W cos gamma_i)) with gamma_i = pi - phi - theta_i
    (thesis (2-15), (2-16)), *signed*: the print has abs(sin gamma), but its figures' values are
    the signed form's first forward peak. mu is the coefficient of
    friction, beta_b/a where the balls roll (beta_b is a length).

    Args:
        scene: what is simulated.
        x, y: deck displacement on inertial axes [m].
        angle: the balls' angles psi_i on inertial axes [rad].
        speed: their absolute speeds psi_i' [rad/s].
    """
    # sin gamma = sin(psi_i - delta), cos gamma = -cos(psi_i - delta), delta the whirl's direction.
    across = x * np.sin(angle) - y * np.cos(angle)
    along = x * np.cos(angle) + y * np.sin(angle)
    effects = tuple(scene.effects.values())
    masses = np.array(scene.balls.masses)
    balls = map(Ball, scene.balls.masses, scene.balls.radii)
    coefficient = np.array([friction_coefficient(effects, ball) for ball in balls])
    return masses * speed**2 * (across - coefficient * (scene.race.radius + along))
