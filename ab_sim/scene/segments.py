"""Profile as a list of segments that accelerate or hold up to a speed, a time or a condition."""

import math
from collections.abc import Iterator
from typing import Any, Literal

from pydantic import Field, model_validator

from ab_sim.base.errors import exact
from ab_sim.scene.quantities import Number, Section, quantity

_MOST_SEGMENTS = 1000
KIND: Any = Field(description="kind of the profile, which decides its other keys")
Speeds = tuple[float, float]
"""Lowest and highest possible speed [rad/s]."""


class Until(Section):
    """A condition on the measured vibration.

    The condition refers to the root mean square of the acceleration about its mean, over successive
    windows, so that gravity and a sensor's offset do not count. With several sensors, the largest
    value counts.
    """

    vibration_rms_below: Number | None = quantity(
        "the segment ends when the rms is below this (give this or vibration_rms_above)",
        "m/s^2",
        gt=0,
        le=1e6,
        default=None,
    )
    vibration_rms_above: Number | None = quantity(
        "the segment ends when the rms is above this (give this or vibration_rms_below)",
        "m/s^2",
        gt=0,
        le=1e6,
        default=None,
    )
    over: Number = quantity(
        "length of the window over which the rms is taken", "s", ge=1e-3, le=1e4
    )
    at_most: Number = quantity("longest duration of the segment", "s", ge=1e-3, le=1e4)
    otherwise: Literal["continue", "abort"] = Field(
        default="continue", description="reaction if the segment reaches at_most: continue or abort"
    )

    @model_validator(mode="after")
    def _reachable(self) -> "Until":
        if (self.vibration_rms_below is None) == (self.vibration_rms_above is None):
            raise ValueError("give exactly one of vibration_rms_below and vibration_rms_above")
        if self.at_most <= self.over:
            raise ValueError(
                f"at_most = {exact(self.at_most)} s: must be more than over = {exact(self.over)} "
                "s, or the vibration is never judged"
            )
        return self

    @property
    def words(self) -> str:
        """Return the condition in words."""
        if self.vibration_rms_below is not None:
            return f"vibration below {self.vibration_rms_below:g} m/s^2"
        return f"vibration above {self.vibration_rms_above:g} m/s^2"


class Segment(Section):
    """One acceleration, or one hold."""

    to: Number | None = quantity(
        "speed at which the segment ends; acceleration is its rate, upwards or downwards",
        "rad/s",
        ge=-1e5,
        le=1e5,
        default=None,
    )
    hold: Number | None = quantity(
        "time for which the speed is held", "s", ge=1e-6, le=1e4, default=None
    )
    duration: Number | None = quantity(
        "time for which the spindle accelerates", "s", ge=1e-6, le=1e4, default=None
    )
    until: Until | None = None
    """Condition that ends the segment, while it holds a speed or accelerates."""
    acceleration: Number | None = quantity(
        "acceleration; with to: its magnitude; with duration and until: negative to decelerate",
        "rad/s^2",
        ge=-1e6,
        le=1e6,
        default=None,
    )

    @model_validator(mode="after")
    def _one_end(self) -> "Segment":
        ends = {"to": self.to, "hold": self.hold, "duration": self.duration, "until": self.until}
        names = [name for name, end in ends.items() if end is not None]
        if len(names) != 1:
            raise ValueError(
                "give exactly one of to, hold, duration and until, e.g. "
                "{to: 100, acceleration: 40} or {hold: 0.5}"
            )
        if names == ["hold"] and self.acceleration is not None:
            raise ValueError(
                "hold keeps the speed and takes no acceleration; write {duration: ..., "
                "acceleration: ...} to change it"
            )
        if self.acceleration is None and names in (["to"], ["duration"]):
            raise ValueError(f"acceleration: is missing; {names[0]} needs one [rad/s^2]")
        if names == ["to"] and not self._slope >= 1e-6:
            raise ValueError(
                f"acceleration = {exact(self._slope)} rad/s^2: must be at least 1e-06; the "
                "direction follows from `to`"
            )
        return self

    @property
    def _slope(self) -> float:
        return 0.0 if self.acceleration is None else self.acceleration

    def ramp(self, speed: float) -> tuple[float, float]:
        """Return the segment's longest duration [s] and its acceleration [rad/s^2].

        Parameters
        ----------
        speed
            Speed at which the segment begins [rad/s].
        """
        if self.to is not None:
            slope = math.copysign(self._slope, self.to - speed)
            return (self.to - speed) / slope, slope
        lasts = self.until.at_most if self.until is not None else self.duration or self.hold
        assert lasts is not None
        return lasts, self._slope

    def end(self, speed: float) -> float:
        """Return the speed after the longest duration [rad/s]; ``speed`` is that at the start."""
        if self.to is not None:
            return self.to
        duration, slope = self.ramp(speed)
        return speed + slope * duration

    def ends(self, speeds: Speeds) -> Speeds:
        """Return the range of final speeds for a range of initial speeds [rad/s]."""
        low, high = (self.end(speed) for speed in speeds)
        if self.until is None:
            return low, high
        return min(speeds[0], low), max(speeds[1], high)


class SegmentsProfile(Section):
    """Successive accelerations and holds; the speed may rise, fall and change its sign."""

    kind: Literal["segments"] = KIND
    segments: tuple[Segment, ...] = Field(
        description="segments in order, each with one of to, hold, duration, until",
        min_length=1,
        max_length=_MOST_SEGMENTS,
    )

    def speeds(self, first: float) -> Iterator[Speeds]:
        """Yield the range of possible speeds [rad/s] at the start, then at the end of each segment.

        Within a segment, the speed stays between its values at both ends.

        Parameters
        ----------
        first
            Speed at which the profile begins [rad/s].
        """
        speeds = first, first
        yield speeds
        for segment in self.segments:
            speeds = segment.ends(speeds)
            yield speeds

    def top_speed(self, first: float) -> float:
        """Return the largest possible magnitude of the speed [rad/s] after a start at ``first``."""
        return max(max(-low, high) for low, high in self.speeds(first))

    @property
    def lasting(self) -> "SegmentsProfile":
        """Return the profile without conditions; each segment has its longest duration."""
        held_segments = [
            segment
            if segment.until is None
            else Segment(duration=segment.until.at_most, acceleration=segment.acceleration or 0.0)
            for segment in self.segments
        ]
        return SegmentsProfile(kind=self.kind, segments=tuple(held_segments))

    @property
    def condition(self) -> str | None:
        """Return the key of the first segment that ends on a condition, if there is one."""
        for index, segment in enumerate(self.segments):
            if segment.until is not None:
                return f"profile.segments.{index}.until"
        return None
