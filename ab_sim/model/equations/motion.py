"""Arguments of effects: constants of the bodies and their motion, in SI units.

They are plain named tuples of floats, which cost nothing in compiled code and read the same in
Python. Symbols as in docs/equations.md, 1; axis 1 of the rotating frame points at the unbalance.
"""

from typing import NamedTuple


class Ball(NamedTuple):
    """Constants of one ball."""

    mass: float
    """Mass m [kg]."""
    radius: float
    """Radius a [m]; NaN in a scene whose effects do not use it."""


class DeckMotion(NamedTuple):
    """Motion of the deck, on rotating or on fixed axes, as stated at its use."""

    x: float
    y: float
    """Displacement from the unloaded suspension [m]."""
    vx: float
    vy: float
    """Inertial velocity [m/s]."""


class SpindleMotion(NamedTuple):
    """Motion of the spindle."""

    speed: float
    """Speed w [rad/s]."""
    acceleration: float
    """Acceleration al [rad/s^2]; 0 without the effect spindle_acceleration, and with a motor, whose
    equation of motion determines it."""
    cos: float
    sin: float
    """Cosine and sine of psi; 1 and 0 in a scene whose effects do not need them."""
    torque: float
    """Motor torque [N m]; 0 with a prescribed speed."""
    integral_rate: float
    """Rate of change of the speed loop's integral [rad/s]; 0 with a prescribed speed."""
