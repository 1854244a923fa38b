"""Pieces of a speed profile: speed, acceleration and angle as exact functions of local time.

Named tuples with plain methods: formulas, of which machine code is made, and which take arrays of
times as well.
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


class RampAndCosine(NamedTuple):
    """A ramp and a raised cosine added up: either of them, for runs side by side."""

    start_speed: float
    """rad/s, at local time 0."""
    slope: float
    """rad/s^2, of the ramp; 0 for a raised cosine."""
    change: float
    """rad/s, of the raised cosine; 0 for a ramp."""
    duration: float
    """s, of the raised cosine; 1 for a ramp."""

    @classmethod
    def of(cls, segment: Ramp | RaisedCosine) -> "RampAndCosine":
        """The sum that is this segment."""
        if isinstance(segment, Ramp):
            return cls(segment.start_speed, segment.slope, 0.0, 1.0)
        return cls(segment.start_speed, 0.0, segment.change, segment.duration)

    def speed(self, time: Times) -> Times:
        """w [rad/s] at local ``time`` [s]."""
        phase = np.pi * time / self.duration
        return self.start_speed + self.slope * time + 0.5 * self.change * (1.0 - np.cos(phase))

    def acceleration(self, time: Times) -> Times:
        """al [rad/s^2] at local ``time`` [s]."""
        phase = np.pi * time / self.duration
        return self.slope + 0.5 * self.change * np.pi / self.duration * np.sin(phase)

    def angle(self, time: Times) -> Times:
        """Angle [rad] turned since local time 0."""
        phase = np.pi * time / self.duration
        lag = self.duration / np.pi * np.sin(phase)
        ramp = (self.start_speed + 0.5 * self.slope * time) * time
        return ramp + 0.5 * self.change * (time - lag)
