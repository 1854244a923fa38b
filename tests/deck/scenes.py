"""Scenes of decks in space without any symmetry, with few sets of effects for all tests.

Each set of effects needs a compilation of some ten seconds, with and without an energy balance. So
all tests here keep an energy balance, and tests with fewer effects add ones without influence.
"""

from typing import Any

from ab_sim.scene import Scene, check_scene
from tests.conftest import merge

Changes = dict[str, Any]

_SMOOTH: Changes = {
    "ball_spin": {},
    "gravity": {"tilt": 0.0, "acceleration": 0.0},
    "hardening_suspension": {"cubic_stiffness": 0.0},
    "race_runout": {},
}
_RUBBING: Changes = {
    **_SMOOTH,
    "rolling_friction": {"arm": 0.0},
    "race_friction": {"coefficient": 0.0},
}
_TOUCHING: Changes = {**_RUBBING, "ball_contact": {"restitution_coefficient": 0.5}}
_MOTOR: Changes = {
    "motor": {
        "rotor_inertia": 3e-6,
        "torque_limit": 1e-2,
        "proportional_gain": 5e-3,
        "integral_gain": 0.05,
        "back_emf_slope": 1e-6,
    }
}
_ONE_RACE: Changes = {"balls": {"race": 0}}
COMPANIES: dict[str, Changes] = {
    "plain": {"balls": {"radius": None}},
    "smooth": {"effects": _SMOOTH},
    "rubbing": {"effects": _RUBBING},
    "touching": {"effects": _TOUCHING, **_ONE_RACE},
    "all": {"effects": {**_TOUCHING, **_MOTOR}, **_ONE_RACE},
}
"""Sets of effects in addition to drag and spindle acceleration; most have no influence."""

ODD: Changes = {
    "rotor": {
        "mass": 0.145,
        "eccentric_mass": 0.025,
        "eccentricity": 2.5e-4,
        "height": 7e-3,
        "inertia": [5.6e-6, 5.7e-6, 1.1e-5, 2e-7, 1e-7, -6e-8],
    },
    "deck": {
        "center": [6e-3, -0.025, -4e-3],
        "inertia": [1.3e-4, 1.7e-4, 2.6e-4, -1.2e-5, 6e-6, -9e-6],
    },
    "mounts": [
        {"position": [-0.055, 0.04, 1e-3], "stiffness": [900.0, 950.0, 1400.0], "damping": 0.5},
        {
            "position": [0.065, 0.03, -2e-3],
            "stiffness": [1200.0, 1100.0, 1000.0],
            "damping": [0.7, 0.5, 0.45],
            "turned": [0.2, -0.1, 0.5],
        },
        {
            "position": [-0.05, -0.09, 0.0],
            "stiffness": [800.0, 1300.0, 1250.0],
            "damping": [0.35, 0.6, 0.6],
        },
        {
            "position": [0.045, -0.1, 3e-3],
            "stiffness": [1000.0, 700.0, 1600.0],
            "damping": [0.4, 0.3, 0.9],
            "turned": [-0.3, 0.4, 0.1],
        },
    ],
    "race": {"radius": 0.028, "height": [5e-3, -3e-3]},
    "balls": {"count": 2, "mass": [2e-4, 3e-4], "radius": [1.8e-3, 2e-3], "race": [0, 1]},
    "effects": {"viscous_drag": {"coefficient": 0.015}, "spindle_acceleration": {}},
    "start": {
        "speed": 110.0,
        "angle": 0.8,
        "ball_angles": [0.5, 2.6],
        "ball_rates": [4.0, -3.0],
        "deck": {
            "position": [2e-4, -1e-4, 3e-4],
            "tilt": [0.02, -0.03, 0.01],
            "velocity": [0.05, -0.02, 0.04],
            "tilt_rate": [1.0, -2.0, 1.5],
        },
    },
    "spindle": {"max_speed": 1000.0, "max_acceleration": 1e4},
    "solver": {"stepper": "rk8", "step": 5e-4},
    "duration": 1.0,
}
"""Scene without symmetry: two races, couple unbalance, turned mounts, heights, start in motion."""


def odd(company: str, *changes: Changes) -> Scene:
    """Return ``ODD`` with a set of effects and changes."""
    return made(merge(ODD, COMPANIES[company]), *changes)


def made(base: Changes, *changes: Changes) -> Scene:
    """Return a scene with changes merged into it."""
    for change in changes:
        base = merge(base, change)
    return check_scene(base, "test")
