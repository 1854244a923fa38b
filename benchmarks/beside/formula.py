"""The right-hand side of the thesis' drive while its speed rises, once for all libraries."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ab_sim.dynamics.assemble import start_discrete_state, system_of
from ab_sim.dynamics.system import MASS, MOBILITY, MOMENT, ROUND_LEVER
from ab_sim.scene import load_scene
from ab_sim.spindle import SpeedSchedule

STATES_TRIED = 1000
TIME = 0.3
"""s, since the speed began to rise."""


def slope(y: Any, p: Any, now: Any, n: int, cos: Any, sin: Any, total: Any) -> list[Any]:
    """Rates of change; what each ball has is one object, whatever a library makes of that.

    Args:
        y: u1, u2, v1, v2, then the balls' angles, and their rates.
        p: M, M0 e, R, stiffness, damping, drag, speed, acceleration, then m, 1/mu, m R, lever.
        now: time.
        n: balls.
        cos, sin, total: of the library.
    """
    u1, u2, v1, v2, theta, rate = y
    mass, unbalance, radius, k, d, drag, speed, al, m, mobility, moment, lever = p
    w = speed + al * now
    c, s = cos(theta), sin(theta)
    load = moment * (w + rate) * (w + rate)
    g0 = (-(drag * (radius * rate)) - lever * al) * mobility
    g1, g2 = m * s * mobility, -(m * c * mobility)
    f1 = unbalance * (w * w) - d * v1 - k * u1 + total(load * c + moment * al * s + m * s * g0)
    f2 = total(load * s - moment * al * c - m * c * g0) - unbalance * al - d * v2 - k * u2
    d11, d22 = mass - total(m * s * g1), mass + total(m * c * g2)
    d12, d21 = -total(m * s * g2), total(m * c * g1)
    inverse = 1.0 / (d11 * d22 - d12 * d21)
    a1, a2 = (f1 * d22 - f2 * d12) * inverse, (f2 * d11 - f1 * d21) * inverse
    turning = (g0 + g1 * a1 + g2 * a2) * (1.0 / radius)
    return [v1 + w * u2, v2 - w * u1, a1 + w * v2, a2 - w * v1, rate, turning]


class Made(NamedTuple):
    """Code, and what calls it."""

    run: Callable[[int], None]
    """Evaluates so many times."""
    outputs: Callable[[np.ndarray], np.ndarray]
    """Of a state."""
    keep: Any = None
    """What has to stay alive."""


class Case:
    """A drive with so many balls, a state and the place on its profile."""

    def __init__(self, balls: int) -> None:
        changes = ["effects.rolling_friction=", f"balls.count={balls}"]
        if balls > 2:
            changes.append(f"balls.mass={2e-3 / balls}")
        angles = np.linspace(0.0, 5.0, balls).tolist()
        scene = load_scene("thesis-hold", [*changes, f"start.ball_angles={angles}"])
        self.n, self.size = balls, 4 + 2 * balls
        self.system = system_of(scene)
        self.scheduled = SpeedSchedule.of_scene(scene).segment_at(0.0)
        own, effects, columns = self.system.deck_model, scene.effects, self.system.balls.T
        suspension = effects["suspension"]
        segment = self.scheduled.segment
        self.scalars = [
            own.total_mass,
            own.unbalance,
            scene.race.radius,
            suspension.stiffness,
            suspension.damping,
            effects["viscous_drag"].coefficient,
            segment.speed(0.0),
            segment.acceleration(0.0),
        ]
        self.columns = [columns[k] for k in (MASS, MOBILITY, MOMENT, ROUND_LEVER)]
        self.p = np.concatenate([self.scalars, *self.columns])
        self.discrete_state = start_discrete_state(scene, self.system)
        random = np.random.default_rng(1)
        scale = np.array([1e-4] * 2 + [1e-2] * 2 + [3.0] * balls + [10.0] * balls)
        self.states = random.uniform(-1.0, 1.0, (STATES_TRIED, self.size)) * scale

    def symbols(self, make: Callable[[str], Any], columns: Callable[[str], Any]) -> Any:
        """y, p and time of symbols."""
        names = "M U R k d drag speed al".split()
        y = [make(x) for x in ("u1", "u2", "v1", "v2")] + [columns("theta"), columns("rate")]
        p = [make(x) for x in names] + [columns(x) for x in ("m", "mob", "mr", "lever")]
        return y, p, make("t")

    def plain(self, state: np.ndarray) -> np.ndarray:
        """The formula by NumPy."""
        n = self.n
        y = [*state[:4], state[4 : 4 + n], state[4 + n :]]
        found = slope(y, [*self.scalars, *self.columns], TIME, n, np.cos, np.sin, np.sum)
        return np.concatenate([np.ravel(x) for x in found])
