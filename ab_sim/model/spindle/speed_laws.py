"""Segments of a speed profile: speed, acceleration and angle as exact functions of local time.

They are named tuples with plain methods: formulas that are compiled to machine code, and that also
take arrays of times.
"""

from typing import Any, NamedTuple

import numpy as np

Times = Any
"""A float, or an array of them."""


class Ramp(NamedTuple):
    """Constant acceleration; zero acceleration holds the speed."""

    start_speed: float
    """Speed at local time 0 [rad/s]."""
    slope: float
    """Acceleration [rad/s^2]."""

    def speed(self, time: Times) -> Times:
        """Return the speed w [rad/s] at local ``time`` [s]."""
        return self.start_speed + self.slope * time

    def acceleration(self, time: Times) -> Times:
        """Return the acceleration al [rad/s^2] at local ``time`` [s]."""
        return self.slope

    def angle(self, time: Times) -> Times:
        """Return the angle [rad] turned since local time 0."""
        return (self.start_speed + 0.5 * self.slope * time) * time


class RaisedCosine(NamedTuple):
    """Change of speed along half a cosine (relative-stability (25), on [t_b, t_b + t_r])."""

    start_speed: float
    """Speed at local time 0 [rad/s]."""
    change: float
    """Change of speed over the duration [rad/s]."""
    duration: float
    """Duration [s]."""

    def speed(self, time: Times) -> Times:
        """Return the speed w [rad/s] at local ``time`` [s]."""
        phase = np.pi * time / self.duration
        return self.start_speed + 0.5 * self.change * (1.0 - np.cos(phase))

    def acceleration(self, time: Times) -> Times:
        """Return the acceleration al [rad/s^2] at local ``time`` [s]."""
        phase = np.pi * time / self.duration
        return 0.5 * self.change * np.pi / self.duration * np.sin(phase)

    def angle(self, time: Times) -> Times:
        """Return the angle [rad] turned since local time 0."""
        phase = np.pi * time / self.duration
        lag = self.duration / np.pi * np.sin(phase)
        return self.start_speed * time + 0.5 * self.change * (time - lag)


class RampAndCosine(NamedTuple):
    """Sum of a ramp and a raised cosine, for vectorised runs that have one or the other."""

    start_speed: float
    """Speed at local time 0 [rad/s]."""
    slope: float
    """Acceleration of the ramp [rad/s^2]; 0 for a raised cosine."""
    change: float
    """Change of speed of the raised cosine [rad/s]; 0 for a ramp."""
    duration: float
    """Duration of the raised cosine [s]; 1 for a ramp."""

    @classmethod
    def of(cls, segment: Ramp | RaisedCosine) -> "RampAndCosine":
        """Return the sum that equals this segment."""
        if isinstance(segment, Ramp):
            return cls(segment.start_speed, segment.slope, 0.0, 1.0)
        return cls(segment.start_speed, 0.0, segment.change, segment.duration)

    def speed(self, time: Times) -> Times:
        """Return the speed w [rad/s] at local ``time`` [s]."""
        phase = np.pi * time / self.duration
        return self.start_speed + self.slope * time + 0.5 * self.change * (1.0 - np.cos(phase))

    def acceleration(self, time: Times) -> Times:
        """Return the acceleration al [rad/s^2] at local ``time`` [s]."""
        phase = np.pi * time / self.duration
        return self.slope + 0.5 * self.change * np.pi / self.duration * np.sin(phase)

    def angle(self, time: Times) -> Times:
        """Return the angle [rad] turned since local time 0."""
        phase = np.pi * time / self.duration
        lag = self.duration / np.pi * np.sin(phase)
        ramp = (self.start_speed + 0.5 * self.slope * time) * time
        return ramp + 0.5 * self.change * (time - lag)
