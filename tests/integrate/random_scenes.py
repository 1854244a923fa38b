"""Random smooth scenes of both plants with all effects, and with sizes over decades.

Two sets of effects, so that two kernels suffice.
"""

from typing import Any

import numpy as np

from ab_sim.scene import Scene, check_scene
from tests.conftest import THESIS, merge
from tests.deck.scenes import odd

PLANTS = ("planar", "in space")


def scene_at_random(plant: str, seed: int, **solver: Any) -> Scene:
    """Return a random scene; the same seed gives the same scene."""
    rng = np.random.default_rng(seed)
    changes: dict[str, Any] = {"solver": solver, **_motion(rng)}
    if plant == "planar":
        return check_scene(merge(merge(THESIS, changes), _planar(rng)), f"random {seed}")
    return odd("smooth", changes, _in_space(rng))


def _factor(rng: np.random.Generator, least: float, most: float) -> float:
    return float(np.exp(rng.uniform(np.log(least), np.log(most))))


def _motion(rng: np.random.Generator) -> dict[str, Any]:
    """Return a ramp to another speed, and balls in motion."""
    speed = float(rng.uniform(30.0, 300.0))
    return {
        "start": {
            "speed": speed,
            "angle": float(rng.uniform(-3.0, 3.0)),
            "ball_angles": rng.uniform(-3.0, 3.0, 2).tolist(),
            "ball_rates": rng.uniform(-5.0, 5.0, 2).tolist(),
        },
        "profile": {
            "kind": "start_up",
            "acceleration": _factor(rng, 10.0, 500.0),
            "target_speed": speed + float(rng.uniform(10.0, 100.0)),
        },
        "spindle": {"max_speed": 500.0, "max_acceleration": 1e4},
        "effects": {
            "viscous_drag": {"coefficient": _factor(rng, 1e-5, 10.0)},
            "gravity": {"tilt": float(rng.uniform(-1.5, 1.5)), "acceleration": 9.80665},
        },
    }


def _planar(rng: np.random.Generator) -> dict[str, Any]:
    stiffness, mass = _factor(rng, 300.0, 1e4), _factor(rng, 0.03, 0.3)
    damping = 2.0 * _factor(rng, 1e-3, 0.3) * float(np.sqrt(stiffness * mass))
    other = _factor(rng, 0.6, 1.6)
    return {
        "rotor": {"total_mass": mass, "eccentricity": _factor(rng, 1e-6, 2e-4)},
        "balls": {"mass": rng.uniform(2e-4, 2e-3, 2).tolist()},
        "effects": {
            "suspension": None,
            "unequal_suspension": {
                "stiffness_1": stiffness,
                "stiffness_2": other * stiffness,
                "damping_1": damping,
                "damping_2": other * damping,
                "axis_angle": float(rng.uniform(-1.5, 1.5)),
            },
            "hardening_suspension": {"cubic_stiffness": _factor(rng, 1e5, 1e7)},
            "race_runout": {
                "offset_1": float(rng.uniform(-2e-4, 2e-4)),
                "offset_2": float(rng.uniform(-2e-4, 2e-4)),
                "lobe": float(rng.uniform(0.0, 2e-4)),
                "lobe_angle": float(rng.uniform(-1.5, 1.5)),
            },
        },
    }


def _in_space(rng: np.random.Generator) -> dict[str, Any]:
    mounts = [
        {
            "position": [x, y, float(rng.uniform(-5e-3, 5e-3))],
            "stiffness": (rng.uniform(0.7, 1.4, 3) * _factor(rng, 500.0, 5000.0)).tolist(),
            "damping": (rng.uniform(0.5, 1.5, 3) * _factor(rng, 0.05, 1.0)).tolist(),
            "turned": rng.uniform(-0.5, 0.5, 3).tolist(),
        }
        for x in (-0.055, 0.06)
        for y in (-0.09, 0.04)
    ]
    return {
        "rotor": {"eccentricity": _factor(rng, 1e-5, 3e-4), "height": float(rng.uniform(0, 0.01))},
        "race": {"height": rng.uniform(-8e-3, 8e-3, 2).tolist()},
        "mounts": mounts,
        "effects": {
            "hardening_suspension": {"cubic_stiffness": _factor(rng, 1e5, 1e8)},
            "race_runout": {
                "offset_1": float(rng.uniform(-3e-4, 3e-4)),
                "offset_2": float(rng.uniform(-3e-4, 3e-4)),
                "lobe": float(rng.uniform(0.0, 3e-4)),
                "lobe_angle": 0.2,
            },
        },
        "start": {
            "deck": {
                "position": rng.uniform(-3e-4, 3e-4, 3).tolist(),
                "tilt": rng.uniform(-0.03, 0.03, 3).tolist(),
                "velocity": rng.uniform(-0.05, 0.05, 3).tolist(),
                "tilt_rate": rng.uniform(-2.0, 2.0, 3).tolist(),
            }
        },
    }
