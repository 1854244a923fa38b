"""Schedule of the spindle speed: successive segments with exact breakpoints.

Speed laws (``Ramp``, ``RaisedCosine``) are named tuples with plain methods: formulas that are
compiled to machine code, and that also take arrays of times.
"""

import bisect
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ab_sim.base.errors import SceneError

if TYPE_CHECKING:
    from ab_sim.scene import Scene
    from ab_sim.scene.profiles import AnyProfile
    from ab_sim.scene.segments import Segment


Times = Any
"""One time or an array of times [s]."""


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
    def of(cls, law: Ramp | RaisedCosine) -> "RampAndCosine":
        """Return a ramp or raised cosine in the form of this class."""
        if isinstance(law, Ramp):
            return cls(law.start_speed, law.slope, 0.0, 1.0)
        return cls(law.start_speed, 0.0, law.change, law.duration)

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


SpeedLaw = Ramp | RaisedCosine


class ScheduledSegment(NamedTuple):
    """Segment of a schedule: start and end time, start angle, and the law of the speed."""

    start: float
    """Start time [s]."""
    end: float
    """End time [s]; infinite for the last segment."""
    start_angle: float
    """Angle psi at the start [rad]."""
    law: SpeedLaw
    """Speed, acceleration and angle as functions of the time since ``start``."""


class SpeedSchedule:
    """Spindle speed and angle over time, segment by segment; the last speed is held without end.

    Parameters
    ----------
    segments
        Pairs of a duration [s] and its speed law.
    final_speed
        Speed [rad/s] held after the last segment.
    start
        Time at which the first segment begins [s].
    start_angle
        Angle psi at that time [rad].
    variable_speed_period
        Start of the variable-speed period [s]; None without one.
    """

    def __init__(
        self,
        segments: Sequence[tuple[float, SpeedLaw]],
        final_speed: float,
        start: float = 0.0,
        start_angle: float = 0.0,
        variable_speed_period: float | None = None,
    ) -> None:
        scheduled_segments = []
        for duration, law in segments:
            scheduled_segments.append(ScheduledSegment(start, start + duration, start_angle, law))
            start += duration
            start_angle += law.angle(duration)
        scheduled_segments.append(
            ScheduledSegment(start, math.inf, start_angle, Ramp(final_speed, 0.0))
        )
        self.segments = tuple(scheduled_segments)
        self.variable_speed_period = variable_speed_period
        self._starts = [scheduled.start for scheduled in scheduled_segments]

    @property
    def end(self) -> float:
        """Time at which the final speed is reached [s]."""
        return self.segments[-1].start

    @property
    def top_speed(self) -> float:
        """Largest magnitude of the speed [rad/s]; it is monotonic within every segment."""
        return max(
            abs(scheduled.law.speed(local))
            for scheduled in self.segments
            for local in (0.0, scheduled.end - scheduled.start if scheduled.end < math.inf else 0.0)
        )

    @property
    def steepest(self) -> float:
        """Largest magnitude of the acceleration [rad/s^2].

        The acceleration is evaluated in the middle of each segment, where ramps and raised cosines
        are steepest.
        """
        return max(
            (
                abs(float(scheduled.law.acceleration(0.5 * (scheduled.end - scheduled.start))))
                for scheduled in self.segments[:-1]
            ),
            default=0.0,
        )

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Times [s] at which the acceleration may jump."""
        return tuple(scheduled.end for scheduled in self.segments[:-1])

    def number_at(self, time: float) -> int:
        """Return the index of the segment in force at ``time`` [s] and just after it."""
        return max(bisect.bisect_right(self._starts, time) - 1, 0)

    def segment_at(self, time: float) -> ScheduledSegment:
        """Return the segment in force at ``time`` [s] and just after it."""
        return self.segments[self.number_at(time)]

    def speed(self, time: float) -> float:
        """Return the spindle speed w at a time [rad/s]."""
        scheduled = self.segment_at(time)
        return scheduled.law.speed(time - scheduled.start)

    def angle(self, time: float) -> float:
        """Return the spindle angle psi at a time [rad], unwrapped."""
        scheduled = self.segment_at(time)
        return scheduled.start_angle + scheduled.law.angle(time - scheduled.start)

    def angles(self, times: np.ndarray) -> np.ndarray:
        """Return the spindle angles psi at several times [rad]."""
        return np.array([self.angle(time) for time in times.tolist()])

    def moved(self, by: float, turned: float = 0.0) -> "SpeedSchedule":
        """Return a copy of the schedule that takes place at another time.

        Parameters
        ----------
        by
            Delay of all times [s].
        turned
            Increase of all angles [rad].
        """
        begins = self.variable_speed_period
        return SpeedSchedule.of_scheduled(
            [
                ScheduledSegment(
                    scheduled.start + by,
                    scheduled.end + by,
                    scheduled.start_angle + turned,
                    scheduled.law,
                )
                for scheduled in self.segments
            ],
            None if begins is None else begins + by,
        )

    @classmethod
    def of_scheduled(
        cls,
        scheduled_segments: Sequence[ScheduledSegment],
        variable_speed_period: float | None = None,
    ) -> "SpeedSchedule":
        """Return a schedule from segments that follow each other without gaps."""
        schedule = cls((), 0.0, variable_speed_period=variable_speed_period)
        schedule.segments = tuple(scheduled_segments)
        schedule._starts = [scheduled.start for scheduled in scheduled_segments]
        return schedule

    @classmethod
    def constant(cls, speed: float, start_angle: float = 0.0) -> "SpeedSchedule":
        """Return the schedule of a constant speed [rad/s]; ``start_angle`` [rad] is that at 0 s."""
        return cls((), speed, start_angle=start_angle)

    @classmethod
    def start_up(
        cls,
        start_speed: float,
        acceleration: float,
        target_speed: float,
        period: tuple[float, float, float] | None = None,
        period_start: float | None = None,
        start_angle: float = 0.0,
    ) -> "SpeedSchedule":
        """Return the schedule of a start-up, with or without a variable-speed period.

        Source: thesis 3.1.

        Parameters
        ----------
        start_speed
            Initial speed [rad/s]; above the target the spindle decelerates, at the target it holds.
        acceleration
            Magnitude before and after the period [rad/s^2].
        target_speed
            Speed held at the end [rad/s].
        period
            Start speed [rad/s], duration [s] and acceleration [rad/s^2] of the period.
        period_start
            Start time of the period [s]; None to compute it from the start speed.
        start_angle
            Psi at t = 0 [rad].
        """
        legs: list[tuple[float, float, float, float | None]]
        way = math.copysign(acceleration, target_speed - start_speed)
        legs = [(start_speed, target_speed, way, None)]
        begins = None
        if period is not None:
            at, duration, slope = period
            after = at + slope * duration
            begins = (at - start_speed) / acceleration if period_start is None else period_start
            legs = [
                (start_speed, at, acceleration, begins),
                (at, after, slope, duration),
                (after, target_speed, acceleration, None),
            ]
        segments: list[tuple[float, SpeedLaw]] = [
            (duration if duration is not None else (to - begin) / slope, Ramp(begin, slope))
            for begin, to, slope, duration in legs
        ]
        return cls(segments, target_speed, start_angle=start_angle, variable_speed_period=begins)

    @classmethod
    def speed_change(
        cls,
        start_speed: float,
        to_speed: float,
        start_time: float,
        duration: float,
        start_angle: float = 0.0,
    ) -> "SpeedSchedule":
        """Return the schedule of a raised-cosine change of speed (relative-stability (25)).

        Parameters
        ----------
        start_speed
            Speed until ``start_time`` [rad/s].
        to_speed
            Speed after the change [rad/s].
        start_time
            Start of the change [s].
        duration
            Duration of the change [s].
        start_angle
            Psi at t = 0 [rad].
        """
        change = RaisedCosine(start_speed, to_speed - start_speed, duration)
        segments: list[tuple[float, SpeedLaw]]
        segments = [(start_time, Ramp(start_speed, 0.0)), (duration, change)]
        return cls(segments, to_speed, start_angle=start_angle)

    @classmethod
    def of_segments(
        cls,
        segments: Sequence["Segment"],
        speed: float,
        start: float = 0.0,
        start_angle: float = 0.0,
    ) -> "SpeedSchedule":
        """Return the schedule of successive accelerations and holds, with a segment for each.

        Parameters
        ----------
        segments
            Segments; those that end on a condition get their longest duration.
        speed
            Speed at which the first begins [rad/s].
        start
            Time at which it begins [s].
        start_angle
            Psi at that time [rad].
        """
        ramps: list[tuple[float, SpeedLaw]] = []
        for segment in segments:
            duration, slope = segment.ramp(speed)
            ramps.append((duration, Ramp(speed, slope)))
            speed = segment.end(speed)
        return cls(ramps, speed, start, start_angle)

    @classmethod
    def at_start(cls, scene: "Scene") -> "SpeedSchedule":
        """Return the schedule that holds a scene's start speed."""
        return cls.constant(scene.start.speed, scene.start.angle)

    @classmethod
    def of_scene(cls, scene: "Scene") -> "SpeedSchedule":
        """Return the schedule of a scene's profile; without a profile, the start speed is held.

        Raises
        ------
        SceneError
            Measurements decide the speed during the run: in an adaptive start-up, or in a segment
            that ends on a condition.
        """
        profile = scene.profile
        if profile is None:
            return cls.at_start(scene)
        if profile.kind == "segments" and (key := profile.condition) is not None:
            raise SceneError(
                f"{scene.name}: {key}: this segment ends on a condition that is measured during "
                "the run, so its end is not known in advance; give its length instead (hold or "
                "duration instead of until)"
            )
        return cls.of_profile(profile, scene.start.speed, scene.start.angle)

    @classmethod
    def of_profile(cls, profile: "AnyProfile", first: float, angle: float = 0.0) -> "SpeedSchedule":
        """Return the schedule of a profile; segments with a condition get their longest duration.

        Parameters
        ----------
        profile
            Profile of a scene, or a profile without a scene.
        first
            Speed at t = 0 [rad/s].
        angle
            Psi at t = 0 [rad].

        Raises
        ------
        SceneError
            The profile is an adaptive start-up.
        """
        if profile.kind == "adaptive":
            raise SceneError(
                "profile.kind = adaptive: a controller decides the speed during the run, so it is "
                "not known in advance; use another kind, e.g. start_up with its acceleration and "
                "target_speed, or leave it out (--set profile=)"
            )
        if profile.kind == "segments":
            return cls.of_segments(profile.segments, first, start_angle=angle)
        if profile.kind == "speed_change":
            return cls.speed_change(
                first, profile.to_speed, profile.start_time, profile.duration, angle
            )
        period = start = None
        p, at = profile.variable_speed_period, profile.period_begins(first)
        if p is not None and at is not None:
            period, start = (at, p.duration, p.acceleration), p.start_time
        return cls.start_up(first, profile.acceleration, profile.target_speed, period, start, angle)


def top_speed_of(scene: "Scene") -> float:
    """Return the largest magnitude that the speed may have along a scene's profile [rad/s].

    Segments that end on a condition and adaptive start-ups are included.
    """
    if scene.profile is not None and scene.profile.kind == "segments":
        return scene.profile.top_speed(scene.start.speed)
    if scene.profile is not None and scene.profile.kind == "adaptive":
        return scene.profile.target_speed
    return SpeedSchedule.of_scene(scene).top_speed
