"""Execution of a profile whose segments may end on conditions; it does not need ROS."""

from collections.abc import Mapping, Sequence
from typing import Any

from ab_sim.base.numbers import MOST_TIME, finite, whole
from ab_sim.model.spindle.schedule_in_progress import ScheduleInProgress
from ab_sim.model.spindle.vibration_condition import VibrationCondition
from ab_sim.scene.load import RequestedProfile

PERIOD, SILENCE = 0.005, 1.0
"""Defaults [s]: time between two commands, and time for which the vibration may be missing."""


def waits_for_vibration(requested: RequestedProfile) -> bool:
    """Return whether a condition of a profile depends on the vibration."""
    schedule = ScheduleInProgress(requested.profile, requested.first)
    return any(schedule.until(number) for number in range(schedule.count))


class SegmentsExecution:
    """Execution of a profile that is known in advance, except for the ends set by conditions.

    Args:
        requested: the profile and the speed at which it begins.
        ahead: lead of the commands [s]: a drive approaches a command until the next one.
        silence: time for which the vibration may be missing while a condition needs it [s].
    """

    def __init__(self, requested: RequestedProfile, ahead: float, silence: float) -> None:
        self.first = requested.first
        self._ahead, self._silence = ahead, silence
        self._schedule = ScheduleInProgress(requested.profile, requested.first)
        self._left: list[float] = []
        self._condition: VibrationCondition | None = None
        self.words = self.failure = self.why = ""
        self.begin(0.0)

    @property
    def segment(self) -> tuple[int, int]:
        """Number of the present segment and of segments; see ``ProfileExecution``."""
        return min(max(self._number, 0) + 1, self._schedule.count), self._schedule.count

    @property
    def ended(self) -> bool:
        """True if the final speed is held; see ``ProfileExecution``."""
        return self._number >= self._schedule.count

    @property
    def reached(self) -> bool:
        """True if the profile has reached its aim; see ``ProfileExecution``."""
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
        schedule, elapsed, passed = (
            self._schedule,
            max(now - self._began, 0.0),
            max(self._number, 0),
        )
        condition, still = self._condition, schedule.number(elapsed) == self._number
        if condition is not None and condition.met:
            if still:
                schedule.leave(elapsed)
                self._left.append(elapsed)
            passed += 1
        elif condition is not None and still and (silent := condition.silence(now)) > self._silence:
            where = f"segment {self._number + 1} waits for the vibration"
            self.failure = f"{where}, and no good sample of it has come for {silent:.3g} s"
        number = schedule.number(elapsed)
        missed = self._missed(passed, number)
        if number != self._number and not self.failure:
            self._enter(number, now, missed)
        return float(schedule.profile.speed(elapsed + self._ahead))

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
        self._number = whole(state["number"], -1, self._schedule.count)
        self._left = [finite(time, 0.0, MOST_TIME) for time in state["left"]]
        if sorted(self._left) != self._left or len(self._left) > self._schedule.count:
            raise ValueError("the times at which its segments ended are not in order")
        for time in self._left:
            self._schedule.leave(time)
        until = self._schedule.until(max(self._number, 0))
        self._condition = None
        if until is not None and state["condition"] is not None:
            self._condition = VibrationCondition(until, self._began)
            self._condition.restore(state["condition"])
        self.words, self.why = map(str, state["texts"])

    def _missed(self, passed: int, number: int) -> str:
        """Report conditions that were not met in time, and fail if one of them says abort.

        Args:
            passed: first segment to check.
            number: present segment; those before it are checked.
        """
        missed = ""
        for unmet in range(passed, number):
            if self.failure or (until := self._schedule.until(unmet)) is None:
                continue
            self.why = f"segment {unmet + 1}: no {until.words} within {until.at_most:g} s"
            missed = f"; {self.why}"
            if until.otherwise == "abort":
                self.failure = self.why
        return missed

    def _enter(self, number: int, now: float, missed: str) -> None:
        self._number, until = number, self._schedule.until(number)
        self._condition = None if until is None else VibrationCondition(until, now)
        if number < self._schedule.count:
            words = (
                f"segment {number + 1} of {self._schedule.count}, {self._schedule.words(number)}"
            )
            self.words = words + missed
        else:
            self.words = missed.removeprefix("; ")
