"""Interface of a plant for friction, contact, motor and runs: the planar rotor, or the deck.

A plant's coordinates are those of its deck, then the spindle angle psi, then for every ball
psi_i = psi + theta_i. Its equations of motion without friction, contact and motor are
``mass @ accelerations = known``.
"""

from abc import ABC, abstractmethod
from typing import Any, NamedTuple

import numpy as np

Array = np.ndarray


class Curve(NamedTuple):
    """Races of the balls, as arrays with one entry for each ball.

    Ball centres at X(theta) = d + h n + h' t on the rotating axes, with n = (cos theta, sin theta),
    t = dn/dtheta and h = R + oval cos(2 (theta - oval_angle)).
    """

    radius: Array
    oval: Array
    oval_angle: Array

    def of(self, balls: Array) -> "Curve":
        """Return the races of some balls, for a row of angles each."""
        return Curve(*(part[balls][:, None] for part in self))

    def at(self, theta: Array) -> tuple[Array, Array, Array, Array]:
        """Return h, h', g = h + h'' = ds/dtheta and g' at the angles ``theta``."""
        twice = 2.0 * (theta - self.oval_angle)
        swell, tilt = self.oval * np.cos(twice), self.oval * np.sin(twice)
        return self.radius + swell, -2.0 * tilt, self.radius - 3.0 * swell, 6.0 * tilt


class System(NamedTuple):
    """Equations of motion at one state, and quantities that the laws need."""

    mass: Array
    known: Array
    """Generalised forces that do not depend on the accelerations."""
    normal_rows: Array
    """Rows of N = normal_rows @ accelerations + normal_known, one for each ball."""
    normal_known: Array
    path: Array
    """ds/dtheta of each ball."""
    damping: float
    """Power that the suspension dissipates [W]."""


class Plant(ABC):
    """Carrier of a spindle with balls."""

    p: Any
    """Parameters, of which ``contact``, ``motor`` and ``spindle`` are used."""
    psi: int
    """Index of the spindle angle among the coordinates; the balls follow."""
    count: int
    """Number of balls n."""
    races: tuple[Array, ...]
    """Indices of the balls on each race."""
    curve: Curve
    radii: Array
    """Radius of each ball [m]."""
    drag: Array
    """Drag coefficient c_b of each ball [N s/m]."""
    coefficients: Array
    """Friction coefficient f of each ball."""
    scales: tuple[tuple[float, ...], tuple[float, ...]]
    """Scales of the deck's coordinates and of their rates, to which the tolerance is relative."""

    @property
    def size(self) -> int:
        """Return the number of coordinates."""
        return self.psi + 1 + self.count

    def theta(self, v: Array) -> Array:
        """Return theta_i from coordinates, theta_i' from rates, or theta_i'' from accelerations."""
        return v[..., self.psi + 1 :] - v[..., self.psi, None]

    @abstractmethod
    def system(self, q: Array, rates: Array) -> System:
        """Return the equations of motion."""

    @abstractmethod
    def energy(self, q: Array, rates: Array) -> float:
        """Return the energy of motion, springs and gravity [J]."""
