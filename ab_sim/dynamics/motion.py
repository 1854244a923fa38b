"""What an effect sees: the constants of the bodies and their motion, in SI units.

Plain named tuples of floats: they cost nothing in compiled code and read the same in Python.
Symbols as in EQUATIONS.md section 1; axis 1 of the rotating frame points at the unbalance.
"""

from typing import NamedTuple


class Body(NamedTuple):
    """Constants of deck, rotor and race."""

    total_mass: float
    """M [kg], balls included."""
    unbalance: float
    """M0 e [kg m]."""
    eccentricity: float
    """e [m]."""
    race_radius: float
    """R [m]."""


class Ball(NamedTuple):
    """Constants of one ball."""

    mass: float
    """m [kg]."""
    radius: float
    """a [m]; NaN in a scene whose effects do not use it."""


class Deck(NamedTuple):
    """Motion of the deck on the rotating axes, and of the spindle."""

    u1: float
    u2: float
    """u [m], displacement."""
    v1: float
    v2: float
    """v [m/s], inertial velocity."""
    speed: float
    """w [rad/s], spindle speed."""
    acceleration: float
    """al [rad/s^2], spindle acceleration as far as the scene calls for it."""


class BallMotion(NamedTuple):
    """Motion of one ball."""

    cos: float
    sin: float
    """of theta, the angle from the unbalance."""
    rate: float
    """Om = theta' [rad/s], along the race."""
    speed: float
    """p = w + Om [rad/s], absolute."""


class Reaction(NamedTuple):
    """What the solved equations of motion say of one ball."""

    acceleration: float
    """q = al + theta'' [rad/s^2], absolute."""
    normal_force: float
    """N [N], of the race on the ball; negative where the race would have to pull."""
