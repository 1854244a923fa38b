"""A profile that is known in advance except for segments that end on a condition; no ROS."""

from collections.abc import Mapping, Sequence
from typing import Any

from ab_sim.base.stored_numbers import MOST_TIME, finite, whole
from ab_sim.model.spindle.course import Believed
from ab_sim.model.spindle.schedule_in_progress import ScheduleInProgress
from ab_sim.model.spindle.vibration_watch import VibrationWatch
from ab_sim.scene.profile_file import AskedProfile

PERIOD, SILENCE = 0.005, 1.0
"""Defaults [s]: time between two commands, and time for which the vibration may be missing."""


def waits_for_vibration(asked: AskedProfile) -> bool:
    """Return whether a condition of a profile depends on the vibration."""
    course = ScheduleInProgress(asked.profile, asked.first)
    return any(course.until(number) for number in range(course.count))


class SegmentsCourse:
    """A profile in progress.

    Args:
        asked: the profile.
        ahead: lead of the commands [s]: a drive approaches a command until the next one.
        silence: time for which the vibration may be missing while a condition needs it [s].
    """

    def __init__(self, asked: AskedProfile, ahead: float, silence: float) -> None:
        self.first = asked.first
        self._ahead, self._silence = ahead, silence
        self._course = ScheduleInProgress(asked.profile, asked.first)
        self._left: list[float] = []
        self._watch: VibrationWatch | None = None
        self.words = self.failure = self.why = ""
        self.begin(0.0)

    @property
    def segment(self) -> tuple[int, int]:
        """Number of the present segment and of segments; see ``Course``."""
        return min(max(self._number, 0) + 1, self._course.count), self._course.count

    @property
    def ended(self) -> bool:
        """True if the final speed is held; see ``Course``."""
        return self._number >= self._course.count

    @property
    def reached(self) -> bool:
        """True if the profile has reached its aim; see ``Course``."""
        return self.ended

    @property
    def vibration(self) -> float | None:
        """Present rms of the vibration for the condition [m/s^2]."""
        return None if self._watch is None else self._watch.rms

    @property
    def values(self) -> Mapping[str, str]:
        """Numbers for the diagnostics; see ``Course``."""
        rms = self.vibration
        return {} if rms is None else {"vibration, rms [m/s^2]": f"{rms:.6g}"}

    @property
    def believed(self) -> Believed:
        """No estimates; see ``Course``."""
        return Believed()

    def begin(self, now: float) -> None:
        """Begin the profile; see ``Course``."""
        self._began = now
        self._number = -1

    def receive(self, now: float, sensor: str, stamp: int, vector: Sequence[float]) -> None:
        """Process a sample of the vibration: see ``VibrationWatch.receive``."""
        if self._watch is not None:
            self._watch.receive(now, sensor, stamp, vector)

    def command(self, now: float) -> float:
        """Return the speed to command; see ``Course``."""
        course, elapsed, passed = self._course, max(now - self._began, 0.0), max(self._number, 0)
        watch, still = self._watch, course.number(elapsed) == self._number
        if watch is not None and watch.met:
            if still:
                course.leave(elapsed)
                self._left.append(elapsed)
            passed += 1
        elif watch is not None and still and (silent := watch.silence(now)) > self._silence:
            where = f"segment {self._number + 1} waits for the vibration"
            self.failure = f"{where}, and no good sample of it has come for {silent:.3g} s"
        number = course.number(elapsed)
        missed = self._missed(passed, number)
        if number != self._number and not self.failure:
            self._enter(number, now, missed)
        return float(course.profile.speed(elapsed + self._ahead))

    def state(self) -> dict[str, Any]:
        """Return the state; see ``Course``."""
        return {
            "began": self._began,
            "left": self._left,
            "number": self._number,
            "watch": None if self._watch is None else self._watch.state(),
            "texts": [self.words, self.why],
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore a state; see ``Course``."""
        self._began = finite(state["began"], 0.0, MOST_TIME)
        self._number = whole(state["number"], -1, self._course.count)
        self._left = [finite(time, 0.0, MOST_TIME) for time in state["left"]]
        if sorted(self._left) != self._left or len(self._left) > self._course.count:
            raise ValueError("its conditions were not met one after the other")
        for time in self._left:
            self._course.leave(time)
        until = self._course.until(max(self._number, 0))
        self._watch = None
        if until is not None and state["watch"] is not None:
            self._watch = VibrationWatch(until, self._began)
            self._watch.restore(state["watch"])
        self.words, self.why = map(str, state["texts"])

    def _missed(self, passed: int, number: int) -> str:
        """Return a text on conditions of earlier segments that were not met in time."""
        missed = ""
        for unmet in range(passed, number):
            if self.failure or (until := self._course.until(unmet)) is None:
                continue
            self.why = f"segment {unmet + 1}: no {until.words} within {until.at_most:g} s"
            missed = f"; {self.why}"
            if until.otherwise == "abort":
                self.failure = self.why
        return missed

    def _enter(self, number: int, now: float, missed: str) -> None:
        self._number, until = number, self._course.until(number)
        self._watch = None if until is None else VibrationWatch(until, now)
        if number < self._course.count:
            words = f"segment {number + 1} of {self._course.count}, {self._course.words(number)}"
            self.words = words + missed
        else:
            self.words = missed.removeprefix("; ")
