"""Which balls balance an unbalance, and whether they fit a race: closed forms.

Balls that roll on a wall of radius r have their centres at R = r - a. They just balance U where all
of them are opposite it, n m R = U; balls have a width, and side by side in a row they reach only

    m R sin(n d / 2) / sin(d / 2),    sin(d / 2) = a / R,

d being the angle from a ball to the next.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from ab_sim.design.sizing.specification import DriveSpecification

LIGHTEST = 1e-9
"""Share of the largest ball's mass from which balls are looked for."""
LOOKS = 400
"""Masses at which it is looked for them."""


@dataclass(frozen=True)
class FittingBalls:
    """Equal balls on a race."""

    count: int
    mass: float
    """m of one [kg]."""
    radius: float
    """a [m]."""
    path_radius: float
    """R, of the circle of their centres [m]."""

    @property
    def moment(self) -> float:
        """n m R [kg m]: what balls without a width could balance."""
        return self.count * self.mass * self.path_radius

    @property
    def in_a_row(self) -> float:
        """Unbalance that they balance side by side, the largest that they can [kg m]."""
        half = math.asin(min(self.radius / self.path_radius, 1.0))
        return self.mass * self.path_radius * math.sin(self.count * half) / math.sin(half)

    @property
    def rolling_mass(self) -> float:
        """m + I/a^2 [kg] of a solid ball that rolls."""
        return 1.4 * self.mass


def balls_of(count: int, mass: float, specification: DriveSpecification) -> FittingBalls:
    """So many balls of a mass [kg] on the race; whether they fit is not looked at."""
    radius = ball_radius(mass, specification.density)
    return FittingBalls(count, mass, radius, specification.race_radius - radius)


def ball_radius(mass: float, density: float) -> float:
    """Of a ball [m], from its mass [kg] and density [kg/m^3]."""
    return (3.0 * mass / (4.0 * math.pi * density)) ** (1.0 / 3.0)


def largest_ball(count: int, specification: DriveSpecification) -> float:
    """Mass of the largest balls that fit [kg]: by the width, and all side by side once around."""
    sine = math.sin(math.pi / count)
    around = specification.race_radius * sine / (1.0 + sine)
    radius = min(0.5 * specification.race_width, around)
    return 4.0 / 3.0 * math.pi * specification.density * radius**3


def least_mass(count: int, unbalance: float, specification: DriveSpecification) -> float | None:
    """Of the lightest balls that balance an unbalance side by side [kg]; None if none fit.

    Args:
        count: n.
        unbalance: U [kg m].
        specification: has race and density.
    """
    most = largest_ball(count, specification)

    def missed(mass: float) -> float:
        return balls_of(count, mass, specification).in_a_row / unbalance - 1.0

    # It rises with the mass, and may fall again where a row of large balls goes half around.
    masses = np.geomspace(LIGHTEST * most, most, LOOKS)
    enough = [k for k, mass in enumerate(masses.tolist()) if missed(mass) >= 0.0]
    if not enough:
        return None
    if enough[0] == 0:
        return float(masses[0])
    low, high = float(masses[enough[0] - 1]), float(masses[enough[0]])
    return float(brentq(missed, low, high, xtol=1e-14 * most, rtol=1e-13))
