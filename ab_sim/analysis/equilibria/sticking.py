"""Intervals of ball angles in which friction holds balls, around frictionless states.

A ball that rests on the race needs a tangential force T: m R times the angular acceleration that it
would have without friction. Friction holds it if |T| <= f N, with f the coefficient and N the
race's normal force. One ball at a time is moved along the race. The other balls stay, and the deck
moves to its equilibrium. The interval ends where friction no longer holds all balls. More resting
places exist if several balls move at once: the intervals are a section along each ball's angle
through that set, not its extent.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from ab_sim.analysis.equilibria.resting import (
    LEFT_OUT,
    ClosedFormRotor,
    may_move_rest,
    resting_system,
    rotor_of,
)
from ab_sim.analysis.equilibria.states import RestingState
from ab_sim.base.errors import SceneError
from ab_sim.model.dynamics.system import MASS, RACE_RADIUS, RADIUS
from ab_sim.model.equations.motion import Ball
from ab_sim.model.equations.sums import over_effects
from ab_sim.scene.model import Scene

_LOOKS = 720
"""Number of angles in half a turn at which the friction limit is tested."""


class Sticking(NamedTuple):
    """Interval of angles in which friction holds one ball."""

    ball: int
    """Index of the ball, counted from 0."""
    low: float
    """Lower end theta [rad], at most the state's angle."""
    high: float
    """Upper end theta [rad], at least the state's angle; ``low`` + 2 pi if held all around."""


def sticking(scene: Scene, speed: float, state: RestingState) -> tuple[Sticking, ...]:
    """Return each ball's interval of resting angles around a frictionless state.

    For a ball without friction, low = high.

    Parameters
    ----------
    scene
        Scene with rolling_friction, race_friction or both.
    speed
        Spindle speed w [rad/s].
    state
        State from ``equilibria_of``.

    Raises
    ------
    SceneError
        As ``equilibria_of``; or an effect (a runout, a user-defined one) moves resting states,
        which this method does not cover.
    """
    system = resting_system(scene)
    rotor = rotor_of(system)
    if rotor is None:
        names = (name for name, effect in scene.effects.items() if may_move_rest(effect))
        deciding = ", ".join(f"effects.{name}" for name in names if name not in LEFT_OUT)
        raise SceneError(
            f"{deciding}: the angles at which friction holds balls are computed for resting states "
            "in closed form only, and there are none with this effect; remove it, or simulate "
            "(ab-sim run)"
        )
    effects = tuple(scene.effects.values())
    balls = [Ball(m, a) for m, a in system.balls[:, [MASS, RADIUS]]]
    coefficients = [over_effects(effects, "friction_coefficient", 0.0, ball) for ball in balls]
    friction = np.array(coefficients)

    def slack(theta: np.ndarray) -> float:
        """Return the smallest margin f N - |T| of all balls, per m R w^2."""
        x, y = _deck(rotor, speed, theta, state.u) / system.balls[0, RACE_RADIUS]
        c, s = np.cos(theta), np.sin(theta)
        normal = np.maximum(1.0 + x * c + y * s, 0.0)
        return float((friction * normal - np.abs(y * c - x * s)).min())

    return tuple(_interval(slack, state.theta, i) for i in range(len(balls)))


def _interval(slack: Callable[[np.ndarray], float], theta: np.ndarray, ball: int) -> Sticking:
    """Return the interval of a ball's angle around ``theta`` in which ``slack`` is positive.

    Parameters
    ----------
    slack
        Function of all ball angles [rad]; negative if friction does not hold some ball.
    theta
        Ball angles at the frictionless state [rad], shape (n,).
    ball
        Index of the ball that is moved.
    """
    ends = []
    for sense in (-1.0, 1.0):

        def margin(far: float, sense: float = sense) -> float:
            return slack(theta + sense * far * (np.arange(len(theta)) == ball))

        far = np.linspace(0.0, math.pi, _LOOKS + 1)
        slips = next((k for k, x in enumerate(far) if k and margin(float(x)) < 0.0), None)
        if margin(0.0) <= 0.0:
            extent = 0.0
        elif slips is None:
            extent = math.pi
        else:
            extent = float(brentq(margin, far[slips - 1], far[slips], xtol=1e-12))
        ends.append(theta[ball] + sense * extent)
    return Sticking(ball, float(ends[0]), float(ends[1]))


def _deck(rotor: ClosedFormRotor, speed: float, theta: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Return the displacement u of a deck at rest with fixed balls [m], shape (2,).

    It solves D z = w^2 (M0 e + sum m R exp(i theta)), D as in ``patterns``.

    Parameters
    ----------
    rotor
        Closed-form parameters.
    speed
        Spindle speed w [rad/s].
    theta
        Ball angles [rad], shape (n,).
    near
        Displacement from which Newton's method starts with a cubic spring [m], shape (2,).
    """
    w2 = speed * speed
    pull = w2 * (rotor.unbalance + complex(np.array(rotor.moments) @ np.exp(1j * theta)))
    rest = complex(rotor.stiffness - rotor.mass * w2, rotor.damping * speed)
    z = pull / rest if rest and not rotor.cubic_stiffness else complex(near[0], near[1])
    for _ in range(100 if rotor.cubic_stiffness else 0):
        # Newton's method for the cubic spring, in real and imaginary part.
        k3, W2 = rotor.cubic_stiffness, abs(z) ** 2
        residual = (rest + k3 * W2) * z - pull
        along = rest + k3 * (W2 + 2.0 * z.real * z)
        across = 1j * (rest + k3 * W2) + 2.0 * k3 * z.imag * z
        jacobian = np.array([[along.real, across.real], [along.imag, across.imag]])
        step = np.linalg.solve(jacobian, [residual.real, residual.imag])
        z -= complex(step[0], step[1])
        if np.abs(step).max() <= 1e-14 * abs(z):
            break
    return np.array([z.real, z.imag])
