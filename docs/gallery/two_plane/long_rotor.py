"""The long rotor of the papers of 2008, without dimensions: M = R = k11 = 1."""

import math
from typing import Any

from ab_sim import Scene
from gallery.two_plane.rotor import Bearing, RigidRotor, scene_of

MEASURED_AT = (1.0, -1.0)
"""Where the shaft's vibration is taken: a unit length from the midspan."""
OPPOSITE = (0.5 * math.pi, -0.5 * math.pi, 0.5 * math.pi, -0.5 * math.pi)
"""Where balls start (24)."""
STATIC = {"eccentricity": 0.01, "misalignment": 0.0, "phase": 0.0}
DYNAMIC = {"eccentricity": 0.005, "misalignment": 0.005, "phase": 1.0}


def long_rotor(**changes: Any) -> RigidRotor:
    """(18) and (20) of the paper in Int. J. Non-Linear Mech.: a cylinder six radii long."""
    usual: dict[str, Any] = {
        "mass": 1.0,
        "transverse": 3.25,
        "polar": 0.5,
        "radius": 1.0,
        "bearings": bearings(),
        "ball_mass": 0.025,
        "planes": (2.0, 2.0, -2.0, -2.0),
        **STATIC,
        **changes,
    }
    # c_b / (m Omega_1 R^2) is .01.
    return RigidRotor(drag=0.01 * usual["ball_mass"], **usual)


def bearings(
    heights: tuple[float, float] = (3.0, -3.0), across: float = 1.0, ratio: float = 0.02
) -> tuple[Bearing, ...]:
    """Two alike, of stiffness 1 together.

    Parameters
    ----------
    heights
        Where they are.
    across
        Stiffness along Y per stiffness along X.
    ratio
        Damping per stiffness.
    """
    k = 0.5, 0.5 * across
    return tuple(Bearing(height, k, (ratio * k[0], ratio * k[1])) for height in heights)


def long_scene(
    p: RigidRotor, speed: float, duration: float, starts: tuple[float, ...] = OPPOSITE
) -> Scene:
    """Its scene."""
    return scene_of(p, speed, starts, duration=duration)
