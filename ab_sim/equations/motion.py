"""What an effect sees: the constants of the bodies and their motion, in SI units.

Plain named tuples of floats: they cost nothing in compiled code and read the same in Python.
Symbols as in docs/equations.md, 1; axis 1 of the rotating frame points at the unbalance.
"""

from typing import NamedTuple


class Ball(NamedTuple):
    """Constants of one ball."""

    mass: float
    """m [kg]."""
    radius: float
    """a [m]; NaN in a scene whose effects do not use it."""


class DeckMotion(NamedTuple):
    """Motion of the deck, on the rotating axes or on axes fixed in space, as is said there."""

    x: float
    y: float
    """[m], displacement from the unloaded suspension."""
    vx: float
    vy: float
    """[m/s], inertial velocity."""


class SpindleMotion(NamedTuple):
    """Motion of the spindle."""

    speed: float
    """w [rad/s]."""
    acceleration: float
    """al [rad/s^2]; 0 without the effect spindle_acceleration, and with a motor, whose equation of
    motion gives it."""
    cos: float
    sin: float
    """of psi; 1 and 0 in a scene whose effects do not need it."""
    torque: float
    """Motor torque [N m]; 0 where the speed is prescribed."""
    integral_rate: float
    """Rate of change of the speed loop's integral [rad/s]; 0 where the speed is prescribed."""
