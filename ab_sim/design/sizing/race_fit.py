"""Closed forms for balls that balance an unbalance and fit into a race.

Balls that roll on a wall of radius r have their centres at R = r - a. Point masses opposite U would
just balance it with n m R = U. Balls have a width, and side by side in a row they only reach

    m R sin(n d / 2) / sin(d / 2),    sin(d / 2) = a / R,

where d is the angle from a ball to the next.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from ab_sim.design.sizing.specification import DriveSpecification

LIGHTEST = 1e-9
"""Lightest ball in the search, relative to the largest ball's mass."""
LOOKS = 400
"""Number of masses in the search."""


@dataclass(frozen=True)
class FittingBalls:
    """Equal balls on a race."""

    count: int
    mass: float
    """Mass m of one ball [kg]."""
    radius: float
    """Ball radius a [m]."""
    path_radius: float
    """Radius R of the circle of the balls' centres [m]."""

    @property
    def moment(self) -> float:
        """Moment n m R [kg m]: the unbalance that point masses could balance."""
        return self.count * self.mass * self.path_radius

    @property
    def in_a_row(self) -> float:
        """Largest unbalance that the balls balance, side by side [kg m]."""
        half = math.asin(min(self.radius / self.path_radius, 1.0))
        return self.mass * self.path_radius * math.sin(self.count * half) / math.sin(half)

    @property
    def rolling_mass(self) -> float:
        """Effective mass m + I/a^2 of a rolling solid ball [kg]."""
        return 1.4 * self.mass


def balls_of(count: int, mass: float, specification: DriveSpecification) -> FittingBalls:
    """Return balls of a mass [kg] on the race, without a check that they fit."""
    radius = ball_radius(mass, specification.density)
    return FittingBalls(count, mass, radius, specification.race_radius - radius)


def ball_radius(mass: float, density: float) -> float:
    """Return the radius of a ball [m] from its mass [kg] and density [kg/m^3]."""
    return (3.0 * mass / (4.0 * math.pi * density)) ** (1.0 / 3.0)


def largest_ball(count: int, specification: DriveSpecification) -> float:
    """Return the mass of the largest balls that fit the race's width and circumference [kg]."""
    sine = math.sin(math.pi / count)
    around = specification.race_radius * sine / (1.0 + sine)
    radius = min(0.5 * specification.race_width, around)
    return 4.0 / 3.0 * math.pi * specification.density * radius**3


def least_mass(count: int, unbalance: float, specification: DriveSpecification) -> float | None:
    """Return the least ball mass [kg] that balances an unbalance side by side, or None.

    None if no such balls fit.

    Args:
        count: number of balls n.
        unbalance: unbalance U [kg m].
        specification: specification with race and density.
    """
    most = largest_ball(count, specification)

    def missed(mass: float) -> float:
        return balls_of(count, mass, specification).in_a_row / unbalance - 1.0

    # The moment rises with the mass, but may fall again when a row of large balls covers half the
    # race: take the first crossing.
    masses = np.geomspace(LIGHTEST * most, most, LOOKS)
    enough = [k for k, mass in enumerate(masses.tolist()) if missed(mass) >= 0.0]
    if not enough:
        return None
    if enough[0] == 0:
        return float(masses[0])
    low, high = float(masses[enough[0] - 1]), float(masses[enough[0]])
    return float(brentq(missed, low, high, xtol=1e-14 * most, rtol=1e-13))
