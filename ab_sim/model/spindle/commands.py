"""Commands of the spindle's speed: the servo that approaches one, and trajectories of set-points.

Times of a message are whole nanoseconds, those of a schedule are floats. A ramp to a speed lasts
(v1 - v0)/a, which is hardly ever a whole number of nanoseconds. So if a point gives its
acceleration, the exact duration follows from the speeds, and the message's time only has to agree
with it to a nanosecond. A start-up that is sent as set-points therefore arrives with identical
bits.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

from ab_msgs_py.set_points import SetPoint, SetPoints
from ab_sim.base.errors import CommandError, exact, short
from ab_sim.model.spindle.schedule import Ramp, SpeedLaw, SpeedSchedule


class SpeedServo(NamedTuple):
    """Servo that drives the spindle to a speed at constant acceleration, then holds it."""

    max_speed: float
    """Largest speed [rad/s]; a command beyond this magnitude is rejected."""
    max_acceleration: float
    """Largest acceleration [rad/s^2]."""

    def accepts(self, command: float) -> bool:
        """Return whether a command [rad/s] may be followed; NaN may not."""
        return abs(command) <= self.max_speed

    def check(self, command: float, name: str = "command") -> float:
        """Return the command [rad/s] if the servo accepts it; errors call the command ``name``.

        Raises
        ------
        CommandError
            The command is not a finite number, or is beyond ``max_speed``.
        """
        command = _as_float(name, command, "rad/s")
        if not abs(command) < math.inf:
            raise CommandError(
                f"{name} = {command} rad/s: must be a finite number; the speed stays as it was"
            )
        if not self.accepts(command):
            raise CommandError(
                f"{name} = {exact(command)} rad/s: must be within +-{exact(self.max_speed)} rad/s "
                "(spindle.max_speed of the scene, or a limit set below it); the speed stays as it "
                "was"
            )
        return command

    def check_acceleration(self, acceleration: float) -> float:
        """Return a requested acceleration [rad/s^2] if it is within the servo's limit.

        Raises
        ------
        CommandError
            The acceleration is not a number, not above 0, or beyond ``max_acceleration``.
        """
        acceleration = _as_float("acceleration", acceleration, "rad/s^2")
        if not 0.0 < acceleration <= self.max_acceleration:
            raise CommandError(
                f"acceleration = {exact(acceleration)} rad/s^2: must be above 0 and at most "
                f"{exact(self.max_acceleration)} rad/s^2 (spindle.max_acceleration of the scene)"
            )
        return acceleration

    def approach(
        self, time: float, angle: float, speed: float, command: float, acceleration: float
    ) -> SpeedSchedule:
        """Return the schedule that ramps from the present speed to a commanded one and holds it.

        Parameters
        ----------
        time
            Present time [s].
        angle
            Present spindle angle [rad].
        speed
            Present speed [rad/s].
        command
            Commanded speed [rad/s].
        acceleration
            Magnitude of the ramp's acceleration [rad/s^2].

        Raises
        ------
        CommandError
            Command or acceleration is outside the servo's limits.
        """
        target = self.check(command)
        slope = math.copysign(self.check_acceleration(acceleration), target - speed)
        duration = (target - speed) / slope
        ramp = [(duration, Ramp(speed, slope))] if duration > 0 else []
        return SpeedSchedule(ramp, target, start=time, start_angle=angle)


def _as_float(name: str, value: float, unit: str) -> float:
    """Return a number as a float.

    An int beyond the range of floats is returned unchanged, so that it is reported as too large.
    """
    try:
        return float(value)
    except OverflowError:
        return value
    except (TypeError, ValueError) as error:
        raise CommandError(f"{name} = {short(value)}: must be a number [{unit}]") from error


_NANOSECOND = 1e-9
_SAME_SPEED = 1e-9
"""Relative difference below which two speeds are taken as equal apart from rounding."""
_SHAPE_POINTS, _SHAPE_STEP = 1000, 1e-3
"""Largest number of points by which a curved segment is sent, and their smallest spacing [s]."""
LATEST = 2**31 * 10**9
"""Latest time that a stamp can hold [ns]."""


class TimedSpeeds(NamedTuple):
    """A checked trajectory: successive ramps, then a speed that is held."""

    start: int | None
    """Simulated time of the start [ns]; None for the time at which the trajectory takes effect."""
    ramps: tuple[tuple[float, Ramp], ...]
    """Duration [s] and ramp, in order."""
    final_speed: float
    """Speed held at the end [rad/s]."""
    first: tuple[float, float]
    """Time after the start [s] and speed [rad/s] of the first point."""

    lasts: float
    """Time from the start to the last point [s]; stored, because the drive reads it at every
    wake-up."""

    @classmethod
    def of(
        cls,
        start: int | None,
        ramps: Sequence[tuple[float, Ramp]],
        final_speed: float,
        first: tuple[float, float],
    ) -> "TimedSpeeds":
        """Create a trajectory from its fields except the duration, which is computed."""
        lasts = first[0] + sum(duration for duration, _ in ramps)
        return cls(start, tuple(ramps), final_speed, first, lasts)

    def top_speed(self, after: float = -math.inf) -> float:
        """Return the largest magnitude of the speed [rad/s], from a time after the start [s] on."""
        speeds = (
            abs(ramp.speed(local))
            for begin, duration, ramp in self._ahead(after)
            for local in (max(after - begin, 0.0), duration)
        )
        return max(abs(self.final_speed), *speeds, 0.0)

    def steepest(self, after: float = -math.inf) -> float:
        """Return the largest magnitude of the acceleration [rad/s^2], from ``after`` [s] on."""
        return max((abs(ramp.slope) for _, _, ramp in self._ahead(after)), default=0.0)

    def _ahead(self, after: float) -> Iterator[tuple[float, float, Ramp]]:
        """Yield start [s], duration [s] and ramp, for each ramp that ends after ``after`` [s]."""
        end = self.first[0]
        for duration, ramp in self.ramps:
            begin, end = end, end + duration
            if end > after:
                yield begin, duration, ramp


def timed_speeds(wanted: SetPoints, limits: SpeedServo) -> TimedSpeeds:
    """Return the trajectory through set-points, after checking these against the limits.

    Parameters
    ----------
    wanted
        Requested start and points.
    limits
        Largest speed and acceleration.

    Raises
    ------
    CommandError
        A point is not finite, not in order, beyond the limits, or its acceleration does not lead to
        the next point; the message names the point and the allowed range.
    """
    points = wanted.points
    for number, point in enumerate(points):
        where, before = f"points[{number}]", points[number - 1].time if number else -1
        limits.check(point.speed, f"{where}.velocities[0]")
        if not before < point.time < LATEST - wanted.start:
            raise CommandError(
                f"{where}.time_from_start = {exact(point.time * _NANOSECOND)} s: must be at least "
                "0 and later than that of the point before"
            )
        if point.acceleration is not None and not math.isfinite(point.acceleration):
            raise CommandError(
                f"{where}.accelerations[0] = {point.acceleration} rad/s^2: must be a finite number"
            )
    ramps = [
        _ramp(f"points[{number}]", pair, limits) for number, pair in enumerate(pairwise(points))
    ]
    first = points[0].time / 1e9, points[0].speed
    return TimedSpeeds.of(wanted.start or None, ramps, points[-1].speed, first)


def _ramp(where: str, pair: tuple[SetPoint, SetPoint], limits: SpeedServo) -> tuple[float, Ramp]:
    """Return the duration [s] and the ramp between two points."""
    begin, end = pair
    duration, change = (end.time - begin.time) / 1e9, end.speed - begin.speed
    slope = change / duration if begin.acceleration is None else begin.acceleration
    if begin.acceleration is not None:
        reached = begin.speed + slope * duration
        if reached != end.speed:
            exactly = change / slope if slope else math.inf
            if not abs(exactly - duration) <= 1.5 * _NANOSECOND:
                raise CommandError(
                    f"{where}: {exact(slope)} rad/s^2 leads from {exact(begin.speed)} to "
                    f"{exact(reached)} rad/s by the next point, whose velocity is "
                    f"{exact(end.speed)} rad/s; accelerations hold until the next point; leave "
                    "them all out, and they follow from the velocities"
                )
            duration = exactly
    # A ramp at exactly the largest acceleration must pass, although its end time is rounded to a
    # nanosecond and may therefore be slightly early.
    if abs(change) > limits.max_acceleration * (duration + _NANOSECOND):
        raise CommandError(
            f"{where}: reaching the next point takes {exact(abs(slope))} rad/s^2, and at most "
            f"{exact(limits.max_acceleration)} rad/s^2 are allowed (spindle.max_acceleration of "
            "the scene, or a limit set below it)"
        )
    return duration, Ramp(begin.speed, slope)


def set_points_of(schedule: SpeedSchedule, start: int) -> SetPoints:
    """Return the set-points of a schedule that begins at 0 s.

    Ramps are exact. A curved segment becomes points on it, with straight lines between them.

    Parameters
    ----------
    schedule
        Speeds over time.
    start
        Simulated time at which the schedule is to begin [ns].
    """
    points, time = [], 0
    for scheduled, following in pairwise(schedule.segments):
        lasts, law = scheduled.end - scheduled.start, scheduled.law
        # Each duration is rounded by itself, so that a whole number of nanoseconds stays exact.
        rounded = round(lasts * 1e9)
        if isinstance(law, Ramp):
            if lasts > 0.0:
                points.append(SetPoint(time, law.start_speed, law.slope))
            if rounded / 1e9 != lasts and _leads(law, rounded / 1e9, following.law):
                # otherwise the receiver would take the rounded duration for the exact one
                rounded += 1
        else:
            count = math.ceil(lasts / max(_SHAPE_STEP, lasts / _SHAPE_POINTS))
            for k in range(count):
                local = lasts * k / count
                points.append(SetPoint(time + round(local * 1e9), law.speed(local)))
        time += rounded
    points.append(SetPoint(time, float(schedule.segments[-1].law.speed(0.0)), 0.0))
    return SetPoints(start, tuple(points))


def _leads(ramp: Ramp, duration: float, to: SpeedLaw) -> bool:
    """Return whether a ramp of a duration [s] ends exactly at the next segment's speed."""
    return bool(ramp.speed(duration) == to.speed(0.0))


def joined(
    schedule: SpeedSchedule, now: float, wanted: TimedSpeeds, acceleration: float
) -> SpeedSchedule:
    """Return the schedule from now on: the present one until a trajectory starts, then that one.

    If the spindle cannot be at the first point's speed in time, it approaches the trajectory at the
    largest acceleration, and follows it from where they meet.

    Parameters
    ----------
    schedule
        Schedule in force.
    now
        Time [s]; the start of the trajectory is not before it.
    wanted
        The trajectory, whose start is known.
    acceleration
        Largest acceleration up to the first point [rad/s^2].
    """
    assert wanted.start is not None
    start = max(wanted.start / 1e9, now)
    kept = [
        segment._replace(end=min(segment.end, start))
        for segment in schedule.segments
        if segment.start < start and segment.end > now and start > now
    ]
    present = schedule.speed(start)
    ramps = _from_speed(present, wanted, acceleration)
    after = SpeedSchedule(ramps, wanted.final_speed, start=start, start_angle=schedule.angle(start))
    return SpeedSchedule.of_scheduled([*kept, *after.segments])


def _from_speed(speed: float, wanted: TimedSpeeds, most: float) -> Sequence[tuple[float, Ramp]]:
    """Return the ramps of a trajectory that the spindle begins at a speed off the first point's.

    Parameters
    ----------
    speed
        Speed at the start of the trajectory [rad/s].
    wanted
        The trajectory.
    most
        Largest acceleration until the spindle follows the trajectory [rad/s^2].
    """
    ahead, first = wanted.first
    gap = first - speed
    if not ahead and abs(gap) <= _SAME_SPEED * max(abs(first), 1.0):
        return wanted.ramps
    if abs(gap) <= most * (ahead + _NANOSECOND) and ahead:
        return [(ahead, Ramp(speed, gap / ahead)), *wanted.ramps]
    # The first point cannot be reached in time. Accelerate at the limit from now on, and find the
    # first part of the trajectory whose speed this straight line meets. The time before the first
    # point counts as a part at the first point's speed.
    slope = math.copysign(most, gap)
    passed = 0.0
    ramps = [(ahead, Ramp(first, 0.0)), *wanted.ramps]
    for number, (duration, ramp) in enumerate(ramps):
        gap = ramp.start_speed - (speed + slope * passed)
        closing = slope - ramp.slope
        meets = max(gap / closing, 0.0) if closing * slope > 0.0 else math.inf
        if meets <= duration:
            rest = (duration - meets, Ramp(ramp.speed(meets), ramp.slope))
            return [(passed + meets, Ramp(speed, slope)), rest, *ramps[number + 1 :]]
        passed += duration
    # At the last point the spindle still lags: it continues to the final speed.
    return [((wanted.final_speed - speed) / slope, Ramp(speed, slope))]
