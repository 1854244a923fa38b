"""What friction, contact, motor and the run ask of a plant: the rotor in the plane, or the deck.

A plant's coordinates are those of its deck, then the spindle angle psi, then for every ball
psi_i = psi + theta_i. Its equations of motion without what the laws of friction, contact and motor
add are ``mass @ accelerations = known``.
"""

from abc import ABC, abstractmethod
from typing import Any, NamedTuple

import numpy as np

Array = np.ndarray


class Curve(NamedTuple):
    """The races that the balls run on: arrays with one entry for each ball.

    Ball centres at X(theta) = d + h n + h' t on the rotating axes, with n = (cos theta, sin theta),
    t = dn/dtheta and h = R + oval cos(2 (theta - oval_angle)).
    """

    radius: Array
    oval: Array
    oval_angle: Array

    def of(self, balls: Array) -> "Curve":
        """The same of some balls, for a row of angles each."""
        return Curve(*(part[balls][:, None] for part in self))

    def at(self, theta: Array) -> tuple[Array, Array, Array, Array]:
        """h, h', g = h + h'' = ds/dtheta and g' at the angles ``theta``."""
        twice = 2.0 * (theta - self.oval_angle)
        swell, tilt = self.oval * np.cos(twice), self.oval * np.sin(twice)
        return self.radius + swell, -2.0 * tilt, self.radius - 3.0 * swell, 6.0 * tilt


class System(NamedTuple):
    """The equations of motion at one state, and what the laws need of them."""

    mass: Array
    known: Array
    """Generalised forces of all that is known, less what the accelerations do not multiply."""
    normal_rows: Array
    """N = normal_rows @ accelerations + normal_known, a row for each ball."""
    normal_known: Array
    path: Array
    """ds/dtheta of each ball."""
    damping: float
    """W, what the suspension takes."""


class Plant(ABC):
    """Anything that carries a spindle with balls."""

    p: Any
    """Its parameters: ``contact``, ``motor`` and ``spindle`` are asked for."""
    psi: int
    """Which coordinate is the spindle angle; the balls follow."""
    count: int
    """Number of balls n."""
    races: tuple[Array, ...]
    """Which balls share a race."""
    curve: Curve
    radii: Array
    """Of the balls."""
    drag: Array
    """c_b [N s/m], of each ball."""
    coefficients: Array
    """f, of each ball."""
    scales: tuple[tuple[float, ...], tuple[float, ...]]
    """Of the deck's coordinates, and of their rates: to these the tolerance is relative."""

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return self.psi + 1 + self.count

    def theta(self, v: Array) -> Array:
        """theta_i of the coordinates, theta_i' of their rates, theta_i'' of the accelerations."""
        return v[..., self.psi + 1 :] - v[..., self.psi, None]

    @abstractmethod
    def system(self, q: Array, rates: Array) -> System:
        """The equations of motion."""

    @abstractmethod
    def energy(self, q: Array, rates: Array) -> float:
        """Kinetic energy, springs and gravity [J]."""
