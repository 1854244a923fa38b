"""Drives for tests of equilibria; few sets of effects, because each needs a compiled kernel."""

from typing import Any

import numpy as np

from ab_sim.analysis.equilibria.resting import resting_system
from ab_sim.model.dynamics.system import (
    MASS,
    MOBILITY,
    MOMENT,
    RACE_CURVATURE,
    RACE_RADIUS,
    ROLLING_MASS,
    System,
)
from ab_sim.model.equations.effects import HardeningSuspension, Suspension
from ab_sim.scene import Scene, check_scene

ROLLING = 1.4
"""m + I/a^2 of a rolling ball, in units of m."""


def drive(
    *,
    M: float = 0.1,
    me: float = 9.8e-6,
    k: float = 1000.0,
    c: float = 0.2,
    k3: float = 0.0,
    R: float = 0.01,
    m: Any = (1e-3, 1e-3),
    cb: float = 1.0,
    rolls: bool = True,
    **more: Any,
) -> Scene:
    """Return a scene from the symbols of the equations; M0 and e enter only as the product M0 e.

    Rolling balls always have the cubic spring's kernel, also with k3 = 0; point masses do not.
    """
    rest = M - sum(m)
    effects: dict[str, Any] = {
        "suspension": {"stiffness": k, "damping": c},
        "viscous_drag": {"coefficient": cb},
        "spindle_acceleration": {},
    }
    balls: dict[str, Any] = {"count": len(m), "mass": list(m)}
    if rolls:
        effects |= {"ball_spin": {}, "hardening_suspension": {"cubic_stiffness": k3}}
        balls["radius"] = 0.1 * R
    return check_scene(
        {
            "rotor": {"total_mass": M, "eccentric_mass": rest, "eccentricity": me / rest},
            "race": {"radius": R},
            "balls": balls,
            "effects": effects | more.pop("effects", {}),
            "spindle": {"max_speed": 300.0, "max_acceleration": 100.0},
            "duration": 1.0,
            **more,
        },
        "test",
    )


def of_oracle(p: dict[str, Any], **more: Any) -> Scene:
    """Return a scene from the parameters of an oracle case."""
    assert p["kappa"] in (0.0, 0.4)
    return drive(
        M=p["M"], me=p["me"], k=p["kx"], c=p["c"], R=p["R"], m=p["m"], cb=p["cb"],
        rolls=p["kappa"] > 0.0, k3=p.get("k3", 0.0), **more,
    )  # fmt: skip


def altered(system: System, draw: np.random.Generator) -> System:
    """Return a system with rolling balls and random numbers, for the same kernel.

    The balls' moments are 0.5 to 3 times the unbalance; every other system has equal balls.
    """
    n, M, R = int(draw.integers(1, 7)), 10.0 ** draw.uniform(-2, 1), 10.0 ** draw.uniform(-2.5, 0)
    e, k = R * 10.0 ** draw.uniform(-4, -1), M * 10.0 ** draw.uniform(2, 6)
    ratio = draw.uniform(0.5, 3.0)
    shares = np.ones(n) if draw.random() < 0.5 else draw.uniform(0.2, 1.0, n)
    masses = ratio * M * e / R * shares / shares.sum()
    balls = np.repeat(system.balls[:1], n, axis=0)
    balls[:, MASS], balls[:, ROLLING_MASS] = masses, ROLLING * masses
    balls[:, MOBILITY], balls[:, MOMENT] = 1.0 / (ROLLING * masses), masses * R
    balls[:, RACE_RADIUS], balls[:, RACE_CURVATURE] = R, 1.0 / R
    c = 2.0 * (M * k) ** 0.5 * 10.0 ** draw.uniform(-3, 0)
    k3 = 0.0 if draw.random() < 0.5 else k / (e * 10.0 ** draw.uniform(0, 2)) ** 2
    own = {"Suspension": Suspension(k, c), "HardeningSuspension": HardeningSuspension(k3)}
    effects = tuple(own.get(type(effect).__name__, effect) for effect in system.effects)
    deck_model = system.deck_model._replace(total_mass=M, unbalance=M * e, eccentricity=e)
    return system._replace(deck_model=deck_model, balls=balls, effects=effects)


def base() -> System:
    """Return the system whose numbers ``altered`` replaces."""
    return resting_system(drive())
