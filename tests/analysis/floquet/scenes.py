"""Scenes for Floquet tests: one set of effects in the plane and one in space, to save kernels."""

from typing import Any

from ab_sim.scene import Scene, check_scene, load_scene
from tests.conftest import merge

PLANE: dict[str, Any] = {
    "rotor": {"total_mass": 0.1, "eccentricity": 1e-4},
    "race": {"radius": 0.01},
    "balls": {"count": 2, "mass": 7e-4, "radius": 1e-3},
    "effects": {
        "unequal_suspension": {
            "stiffness_1": 1000.0,
            "stiffness_2": 1300.0,
            "damping_1": 0.2,
            "damping_2": 0.3,
            "axis_angle": 0.4,
        },
        "gravity": {"tilt": 0.0},
        "viscous_drag": {"coefficient": 1.0},
        "spindle_acceleration": {},
        "ball_spin": {},
    },
    "start": {"speed": 70.0, "ball_angles": [0.4, -0.3]},
    "spindle": {"max_speed": 1000.0, "max_acceleration": 1000.0},
    "solver": {"stepper": "rk8", "step": 0.0005},
    "duration": 1.0,
}
ECCENTRICITY = 3.1648941318699605e-4
"""Eccentricity of the oracle's set deck-3d [m]; the scene's file has only six digits of it."""


def plane(**changes: Any) -> Scene:
    return check_scene(merge(PLANE, changes), "test")


def equal(stiffness: float, damping: float) -> dict[str, float]:
    """Return the parameters of unequal_suspension that make it isotropic."""
    return {
        "stiffness_1": stiffness,
        "stiffness_2": stiffness,
        "damping_1": damping,
        "damping_2": damping,
    }


def deck(*changes: str) -> Scene:
    """Return the feeding deck with the oracle's eccentricity, and changes."""
    return load_scene("feeding-deck", [f"rotor.eccentricity={ECCENTRICITY!r}", *changes])
