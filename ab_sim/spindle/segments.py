"""Pieces of a speed profile: speed, acceleration and angle as exact functions of local time.

Named tuples with plain methods: numba compiles the methods of the kind that a kernel is given,
and in Python they take arrays of times as well.
"""

from typing import Any, NamedTuple

import numpy as np

Times = Any
"""A float, or an array of them."""


class Ramp(NamedTuple):
    """Constant acceleration; zero acceleration holds the speed."""

    start_speed: float
    """rad/s, at local time 0."""
    slope: float
    """rad/s^2."""

    def speed(self, time: Times) -> Times:
        """w [rad/s] at local ``time`` [s]."""
        return self.start_speed + self.slope * time

    def acceleration(self, time: Times) -> Times:
        """al [rad/s^2] at local ``time`` [s]."""
        return self.slope

    def angle(self, time: Times) -> Times:
        """Angle [rad] turned since local time 0."""
        return (self.start_speed + 0.5 * self.slope * time) * time


class RaisedCosine(NamedTuple):
    """Change of speed along half a cosine (relative-stability (25), on [t_b, t_b + t_r])."""

    start_speed: float
    """rad/s, at local time 0."""
    change: float
    """rad/s, what has been added at the end."""
    duration: float
    """s."""

    def speed(self, time: Times) -> Times:
        """w [rad/s] at local ``time`` [s]."""
        phase = np.pi * time / self.duration
        return self.start_speed + 0.5 * self.change * (1.0 - np.cos(phase))

    def acceleration(self, time: Times) -> Times:
        """al [rad/s^2] at local ``time`` [s]."""
        phase = np.pi * time / self.duration
        return 0.5 * self.change * np.pi / self.duration * np.sin(phase)

    def angle(self, time: Times) -> Times:
        """Angle [rad] turned since local time 0."""
        phase = np.pi * time / self.duration
        lag = self.duration / np.pi * np.sin(phase)
        return self.start_speed * time + 0.5 * self.change * (time - lag)
