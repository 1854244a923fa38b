"""Where friction holds balls: intervals of angle about the states without friction.

A ball that rests on the race is asked for the tangential force T = m R times what its angle would
accelerate by, as |T| <= f N with f the coefficient and N the race's normal force. Around a state
without friction, one ball at a time is moved along the race, the others staying where they are and
the deck going to where it is in balance with that; the interval is as far as friction holds the
moved ball *and* all others. With all balls moved at once there are more resting places: the
intervals are a cut along each ball's angle through that set, not its extent.
"""

import math
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
from ab_sim.dynamics.system import MASS, RACE_RADIUS, RADIUS
from ab_sim.equations.motion import Ball
from ab_sim.equations.sums import over_effects
from ab_sim.errors import SceneError
from ab_sim.scene.model import Scene

LOOKS = 720
"""Angles in half a turn at which it is looked whether balls are held."""


class Sticking(NamedTuple):
    """Where one ball can rest beside a state without friction."""

    ball: int
    low: float
    """theta [rad], not more than the state's."""
    high: float
    """theta [rad], not less; 2 pi more than ``low`` where it is held all around."""


def sticking(scene: Scene, speed: float, state: RestingState) -> tuple[Sticking, ...]:
    """Each ball's interval of resting angles about a state without friction.

    No interval (low = high) without friction.

    Args:
        scene: with rolling_friction, race_friction or both.
        speed: w [rad/s].
        state: of ``equilibria_of``.

    Raises:
        SceneError: as ``equilibria_of``; or an effect moves resting states (a runout, one of a
            program's own), for which this is not derived.
    """
    system = resting_system(scene)
    rotor = rotor_of(system)
    if rotor is None:
        names = (name for name, effect in scene.effects.items() if may_move_rest(effect))
        deciding = ", ".join(f"effects.{name}" for name in names if name not in LEFT_OUT)
        raise SceneError(
            f"{deciding}: where friction holds balls is known for resting states in closed form "
            "only, which are not known with this; take it out, or simulate (ab-sim run)"
        )
    effects = tuple(scene.effects.values())
    balls = [Ball(m, a) for m, a in system.balls[:, [MASS, RADIUS]]]
    each = [over_effects(effects, "friction_coefficient", 0.0, ball) for ball in balls]
    held = np.array(each)

    def slack(theta: np.ndarray) -> float:
        """How much of f N is left, per m R w^2, at the ball where it is least."""
        x, y = _deck(rotor, speed, theta, state.u) / system.balls[0, RACE_RADIUS]
        c, s = np.cos(theta), np.sin(theta)
        normal = np.maximum(1.0 + x * c + y * s, 0.0)
        return float((held * normal - np.abs(y * c - x * s)).min())

    return tuple(_interval(slack, state.theta, i) for i in range(len(balls)))


def _interval(slack, theta: np.ndarray, ball: int) -> Sticking:  # type: ignore[no-untyped-def]
    ends = []
    for sense in (-1.0, 1.0):

        def left(far: float, sense: float = sense) -> float:
            return slack(theta + sense * far * (np.arange(len(theta)) == ball))

        far = np.linspace(0.0, math.pi, LOOKS + 1)
        bad = next((k for k, x in enumerate(far) if k and left(float(x)) < 0.0), None)
        if left(0.0) <= 0.0:
            reach = 0.0
        elif bad is None:
            reach = math.pi
        else:
            reach = float(brentq(left, far[bad - 1], far[bad], xtol=1e-12))
        ends.append(theta[ball] + sense * reach)
    return Sticking(ball, float(ends[0]), float(ends[1]))


def _deck(rotor: ClosedFormRotor, speed: float, theta: np.ndarray, near: np.ndarray) -> np.ndarray:
    """u [m] of a deck at rest with balls that are held: D z = w^2 (M0 e + sum m R exp(i theta))."""
    w2 = speed * speed
    pull = w2 * (rotor.unbalance + complex(np.array(rotor.moments) @ np.exp(1j * theta)))
    rest = complex(rotor.stiffness - rotor.mass * w2, rotor.damping * speed)
    z = pull / rest if rest and not rotor.cubic_stiffness else complex(near[0], near[1])
    for _ in range(100 if rotor.cubic_stiffness else 0):
        # Newton's method, by real and imaginary part.
        k3, W2 = rotor.cubic_stiffness, abs(z) ** 2
        off = (rest + k3 * W2) * z - pull
        along = rest + k3 * (W2 + 2.0 * z.real * z)
        across = 1j * (rest + k3 * W2) + 2.0 * k3 * z.imag * z
        ways = np.array([[along.real, across.real], [along.imag, across.imag]])
        step = np.linalg.solve(ways, [off.real, off.imag])
        z -= complex(step[0], step[1])
        if np.abs(step).max() <= 1e-14 * abs(z):
            break
    return np.array([z.real, z.imag])
