"""Execution of a profile whose segments may end on conditions."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from ab_sim.base.numbers import MOST_TIME, finite, whole
from ab_sim.model.spindle.schedule import Ramp, ScheduledSegment, SpeedSchedule
from ab_sim.scene.load import RequestedProfile
from ab_sim.scene.segments import Until


def _speed(scheduled: ScheduledSegment) -> float:
    return _rounded(scheduled.law.speed(0.0))


def _rounded(speed: float) -> float:
    return round(float(speed), 9) + 0.0  # + 0.0 turns -0 into 0


def _words(scheduled: ScheduledSegment) -> str:
    """Describe a segment that ends at a known time."""
    lasts = scheduled.end - scheduled.start
    begin, end = _speed(scheduled), _rounded(scheduled.law.speed(lasts))
    if not isinstance(scheduled.law, Ramp):
        return f"from {begin:g} to {end:g} rad/s along a raised cosine in {lasts:g} s"
    if scheduled.law.slope == 0.0 or lasts == 0.0:
        return f"hold {begin:g} rad/s for {lasts:g} s"
    return f"from {begin:g} to {end:g} rad/s at {scheduled.law.slope:g} rad/s^2"


LEAST_SAMPLES = 8
"""Least number of samples in a window of vibration; a window with fewer is extended."""

AXES = 3
"""Number of axes of a vibration vector."""


class _Sensor:
    """One sensor's present window of samples, and the rms of the last complete window."""

    def __init__(self) -> None:
        self.rms: float | None = None
        """Root mean square of the last complete window [m/s^2]; None before its end."""
        self.newest: int | None = None
        """Stamp of the newest sample [ns]."""
        self._begin(0)

    def _begin(self, stamp: int) -> None:
        self._since, self._count, self._spread = stamp, 0, 0.0
        self._mean = [0.0] * AXES

    def state(self) -> list[Any]:
        return [self.rms, self.newest, self._since, self._count, self._spread, *self._mean]

    def restore(self, state: Sequence[Any]) -> None:
        rms, newest, since, count, spread, *mean = state
        self.rms = None if rms is None else finite(rms, 0.0)
        self.newest = None if newest is None else whole(newest)
        self._since, self._count, self._spread = whole(since), whole(count, 0), finite(spread, 0.0)
        self._mean[:] = map(finite, mean)
        if len(self._mean) != AXES:
            raise ValueError(f"its mean has {len(self._mean)} numbers; must have {AXES}")

    def receive(self, stamp: int, vector: Sequence[float], over: float) -> None:
        """Add a sample; a window ends when it is ``over`` [s] long and has enough samples."""
        if self.newest is None or stamp < self.newest:
            self.rms = None  # the first sample, or the drive was reset
            self._begin(stamp)
        elif (stamp - self._since) * 1e-9 >= over and self._count >= LEAST_SAMPLES:
            self.rms = math.sqrt(self._spread / self._count)
            self._begin(stamp)
        self.newest = stamp
        self._count += 1
        # Welford's algorithm (Technometrics 4 (1962)). The difference of two sums of squares would
        # cancel if gravity makes the mean much larger than the vibration.
        for axis, value in enumerate(vector):
            off = value - self._mean[axis]
            self._mean[axis] += off / self._count
            self._spread += off * (value - self._mean[axis])


class VibrationCondition:
    """Evaluation of a condition on the measured vibration, from now on.

    Parameters
    ----------
    until
        The condition.
    now
        The time by the caller's clock [s].
    """

    def __init__(self, until: Until, now: float) -> None:
        self._until = until
        self._sensors: dict[str, _Sensor] = {}
        self._heard: dict[str, float] = {}
        self._began = now

    def receive(self, now: float, sensor: str, stamp: int, vector: Sequence[float]) -> None:
        """Process a sample; one that is not finite, or repeats the last stamp, is ignored.

        Parameters
        ----------
        now
            Time by the caller's clock [s].
        sensor
            Frame of the sensor.
        stamp
            Time by the drive's clock [ns], of which only differences matter.
        vector
            Acceleration along three axes [m/s^2].
        """
        sensor_ = self._sensors.setdefault(sensor, _Sensor())
        if not all(map(math.isfinite, vector)) or stamp == sensor_.newest:
            return
        sensor_.receive(stamp, vector, self._until.over)
        self._heard[sensor] = now

    @property
    def rms(self) -> float | None:
        """Largest root mean square of the sensors [m/s^2].

        None until each has a complete window.
        """
        values = [sensor.rms for sensor in self._sensors.values()]
        return (
            None if not values or None in values else max(rms for rms in values if rms is not None)
        )

    @property
    def met(self) -> bool:
        """True if the vibration of the last complete windows satisfies the condition."""
        below, above, rms = (
            self._until.vibration_rms_below,
            self._until.vibration_rms_above,
            self.rms,
        )
        if rms is None:
            return False
        return rms < below if below is not None else above is not None and rms > above

    def silence(self, now: float) -> float:
        """Return the longest time for which a sensor has been silent [s]."""
        times = [self._heard.get(sensor, self._began) for sensor in self._sensors]
        return now - min(times, default=self._began)

    def state(self) -> dict[str, Any]:
        """Return the complete state as JSON-able values."""
        sensors = {name: sensor.state() for name, sensor in self._sensors.items()}
        return {"sensors": sensors, "heard": self._heard, "began": self._began}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from a result of ``state``."""
        self._began = finite(state["began"], 0.0, MOST_TIME)
        self._heard = {
            str(name): finite(heard, 0.0, MOST_TIME) for name, heard in state["heard"].items()
        }
        self._sensors = {str(name): _Sensor() for name in state["sensors"]}
        for name, sensor in self._sensors.items():
            sensor.restore(state["sensors"][name])


PERIOD, SILENCE = 0.005, 1.0
"""Defaults [s]: time between two commands, and time for which the vibration may be missing."""


def waits_for_vibration(requested: RequestedProfile) -> bool:
    """Return whether a condition of a profile depends on the vibration."""
    profile = requested.profile
    return profile.kind == "segments" and profile.condition is not None


class SegmentsExecution:
    """Execution of a profile that is known in advance, except for the ends set by conditions.

    Parameters
    ----------
    requested
        The profile and the speed at which it begins.
    ahead
        Lead of the commands [s]: a drive approaches a command until the next one.
    silence
        Time for which the vibration may be missing while a condition needs it [s].
    """

    def __init__(self, requested: RequestedProfile, ahead: float, silence: float) -> None:
        profile, self.first = requested.profile, requested.first
        self._ahead, self._silence = ahead, silence
        self._segments = profile.segments if profile.kind == "segments" else ()
        self._schedule = SpeedSchedule.of_profile(profile, self.first)
        """Speed schedule from segment ``_passed`` on, as far as decided; later segments with
        conditions have their longest duration."""
        self._passed = 0
        self._count = len(self._schedule.segments) - 1
        self._left: list[float] = []
        self._condition: VibrationCondition | None = None
        self.words = self.failure = self.why = ""
        self.begin(0.0)

    @property
    def segment(self) -> tuple[int, int]:
        """Number of the present segment and of segments; see ``ProfileExecution``."""
        return min(max(self._number, 0) + 1, self._count), self._count

    @property
    def ended(self) -> bool:
        """True if the final speed is held; see ``ProfileExecution``."""
        return self._number >= self._count

    @property
    def reached(self) -> bool:
        """True if the final speed is held; see ``ProfileExecution``."""
        return self.ended

    @property
    def vibration(self) -> float | None:
        """Present rms of the vibration for the condition [m/s^2]."""
        return None if self._condition is None else self._condition.rms

    @property
    def values(self) -> Mapping[str, str]:
        """Numbers for the diagnostics; see ``ProfileExecution``."""
        rms = self.vibration
        return {} if rms is None else {"vibration, rms [m/s^2]": f"{rms:.6g}"}

    def begin(self, now: float) -> None:
        """Begin the profile; see ``ProfileExecution``."""
        self._began = now
        self._number = -1

    def receive(self, now: float, sensor: str, stamp: int, vector: Sequence[float]) -> None:
        """Process a sample of the vibration: see ``VibrationCondition.receive``."""
        if self._condition is not None:
            self._condition.receive(now, sensor, stamp, vector)

    def command(self, now: float) -> float:
        """Return the speed to command; see ``ProfileExecution``."""
        elapsed, passed = max(now - self._began, 0.0), max(self._number, 0)
        # If the condition is met, the present segment ends now, and all later ones move forwards.
        # The segment may just have reached its longest duration; then it has ended already.
        condition, still = self._condition, self._number_at(elapsed) == self._number
        if condition is not None and condition.met:
            if still:
                self._leave(elapsed)
                self._left.append(elapsed)
            passed += 1
        elif condition is not None and still and (silent := condition.silence(now)) > self._silence:
            where = f"segment {self._number + 1} waits for the vibration"
            self.failure = f"{where}, and no valid sample of it has come for {silent:.3g} s"
        number = self._number_at(elapsed)
        missed = self._missed(passed, number)
        if number != self._number and not self.failure:
            self._enter(number, now, missed)
        return float(self._schedule.speed(elapsed + self._ahead))

    def state(self) -> dict[str, Any]:
        """Return the state; see ``ProfileExecution``."""
        return {
            "began": self._began,
            "left": self._left,
            "number": self._number,
            "condition": None if self._condition is None else self._condition.state(),
            "texts": [self.words, self.why],
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore a state; see ``ProfileExecution``."""
        self._began = finite(state["began"], 0.0, MOST_TIME)
        self._number = whole(state["number"], -1, self._count)
        self._left = [finite(time, 0.0, MOST_TIME) for time in state["left"]]
        if sorted(self._left) != self._left or len(self._left) > self._count:
            raise ValueError("the times at which its segments ended are not in order")
        for time in self._left:
            self._leave(time)
        until = self._until(max(self._number, 0))
        self._condition = None
        if until is not None and state["condition"] is not None:
            self._condition = VibrationCondition(until, self._began)
            self._condition.restore(state["condition"])
        self.words, self.why = map(str, state["texts"])

    def _number_at(self, elapsed: float) -> int:
        """Return the number of the segment at a time [s], from 0; the count after the last one."""
        return self._passed + self._schedule.number_at(elapsed)

    def _until(self, number: int) -> Until | None:
        """Return the condition that ends a segment; None if the segment has none."""
        return self._segments[number].until if number < len(self._segments) else None

    def _leave(self, elapsed: float) -> None:
        """End the present segment at a time [s]; the next one begins at the speed reached."""
        self._passed, speed = self._number_at(elapsed) + 1, float(self._schedule.speed(elapsed))
        rest = self._segments[self._passed :]
        self._schedule = SpeedSchedule.of_segments(rest, speed, start=elapsed)

    def _describe(self, number: int) -> str:
        """Return a description of a present or future segment, for the status."""
        scheduled, until = self._schedule.segments[number - self._passed], self._until(number)
        if until is None:
            return _words(scheduled)
        slope = scheduled.law.acceleration(0.0)
        how = f"accelerate at {slope:g} rad/s^2" if slope else f"hold {_speed(scheduled):g} rad/s"
        return f"{how} until {until.words}, at most {until.at_most:g} s"

    def _missed(self, passed: int, number: int) -> str:
        """Report unmet conditions of passed segments, and fail if one of them requires an abort.

        Parameters
        ----------
        passed
            First segment to check.
        number
            Present segment; those before it are checked.

        Returns
        -------
        str
            Text for the status, beginning with a semicolon; empty if there is nothing to report.
        """
        missed = ""
        for unmet in range(passed, number):
            if self.failure or (until := self._until(unmet)) is None:
                continue
            self.why = f"segment {unmet + 1}: no {until.words} within {until.at_most:g} s"
            missed = f"; {self.why}"
            if until.otherwise == "abort":
                self.failure = self.why
        return missed

    def _enter(self, number: int, now: float, missed: str) -> None:
        """Begin a segment, and set the status text; ``missed``: its part on conditions not met."""
        self._number, until = number, self._until(number)
        self._condition = None if until is None else VibrationCondition(until, now)
        if number < self._count:
            self.words = f"segment {number + 1} of {self._count}, {self._describe(number)}{missed}"
        else:
            self.words = missed.removeprefix("; ")
