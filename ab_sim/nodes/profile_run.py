"""What start-up firmware decides: no middleware and no clock, so that it can be tested alone."""

import enum
import math
from collections.abc import Callable, Sequence

from ab_sim.nodes.vibration_watch import VibrationWatch
from ab_sim.scene.profile_file import AskedProfile
from ab_sim.spindle.schedule_in_progress import ScheduleInProgress


class ProfileState(enum.Enum):
    """Where a profile is."""

    IDLE = "idle"
    WAITING = "waiting"
    """For a drive."""
    RUNNING = "running"
    DONE = "done"
    """And its final speed is held."""
    ABORTING = "aborting"
    """Ramping down."""
    ABORTED = "aborted"
    """And standstill is commanded."""


COMMANDING = (ProfileState.RUNNING, ProfileState.DONE, ProfileState.ABORTING, ProfileState.ABORTED)


class ProfileRun:
    """One profile and what becomes of it; times are of any clock that goes on.

    Args:
        asked: the profile.
        deceleration: of an abort [rad/s^2].
        ahead: how far ahead of time commands are [s]: a drive goes there until the next one comes.
        silence: s for which vibration may be missing where a condition needs it.
        say: told the status whenever it changes: the state's word, and often more behind a colon;
            and whether all is well.
    """

    def __init__(
        self,
        asked: AskedProfile,
        deceleration: float,
        ahead: float,
        silence: float,
        say: Callable[[str, bool], None],
    ) -> None:
        self._next = asked, deceleration
        self._deceleration = deceleration
        self._ahead, self._silence, self._say = ahead, silence, say
        self._course = ScheduleInProgress(*asked)
        self._began = 0.0
        self._number = -1
        self._watch: VibrationWatch | None = None
        self._falls = (0.0, 0.0)
        self.state = ProfileState.IDLE
        self.status = ""
        self.why = ""
        """It was aborted, or a condition was not met; empty as long as all is well."""
        self.command = asked.first
        """The speed that was commanded last [rad/s]."""
        self._enter(ProfileState.IDLE)

    @property
    def needs_vibration(self) -> bool:
        """Whether a condition of what the next start takes is judged by it."""
        course = ScheduleInProgress(*self._next[0])
        return any(course.until(number) for number in range(course.count))

    @property
    def vibration(self) -> float | None:
        """As it is judged at present [m/s^2]."""
        return None if self._watch is None else self._watch.rms

    def take(self, asked: AskedProfile, deceleration: float) -> None:
        """Another profile, and the deceleration of its abort, from the next start on."""
        self._next = asked, deceleration

    def wait(self, what: str) -> None:
        """Wait for something."""
        self._enter(ProfileState.WAITING, what)

    def start(self, now: float) -> str:
        """Run from the beginning, at a time [s]; why not, if it may not be."""
        if self.state is ProfileState.RUNNING:
            return "running already; abort first"
        if self.state is ProfileState.ABORTING:
            return "ramping down; wait for standstill"
        asked, deceleration = self._next
        if self.state is ProfileState.DONE and self.command != asked.first:
            return (
                f"{self.command:g} rad/s is commanded, and the profile begins at "
                f"{asked.first:g} rad/s; abort first"
            )
        self._course, self._deceleration = ScheduleInProgress(*asked), deceleration
        self._began, self._number, self._watch, self.why = now, -1, None, ""
        self.state = ProfileState.RUNNING
        self.tick(now)
        return ""

    def shift(self, now: float) -> None:
        """It began just now, and not at the time that was said."""
        self._began = now
        self._number = -1

    def abort(self, now: float, why: str) -> str:
        """Ramp down to standstill; why not, if that makes no sense."""
        if self.state is ProfileState.WAITING:
            self._enter(ProfileState.IDLE)
        elif self.state in (ProfileState.RUNNING, ProfileState.DONE):
            self.why, self._watch = why, None
            self._falls = now, self.command
            self._enter(ProfileState.ABORTING, why)
            self.tick(now)
        elif self.state is not ProfileState.ABORTING:
            return "not running"
        return ""

    def drop(self, why: str) -> None:
        """Command standstill at once: there is nothing any more that could be ramped down."""
        self.why, self._watch = why, None
        self.command = 0.0
        self._enter(ProfileState.ABORTED)

    def receive(self, now: float, sensor: str, stamp: int, vector: Sequence[float]) -> None:
        """A sample of the vibration: see ``VibrationWatch.receive``."""
        if self._watch is not None:
            self._watch.receive(now, sensor, stamp, vector)

    def tick(self, now: float) -> float | None:
        """What is to be commanded now [rad/s]; None: nothing."""
        if self.state is ProfileState.RUNNING:
            self._run(now)
        if self.state is ProfileState.ABORTING:
            since, speed = self._falls
            left = abs(speed) - self._deceleration * (now + self._ahead - since)
            self.command = math.copysign(max(left, 0.0), speed)
            if left <= 0.0:
                self.command = 0.0
                self._enter(ProfileState.ABORTED)
        return self.command if self.state in COMMANDING else None

    def _run(self, now: float) -> None:
        course, elapsed, passed = self._course, now - self._began, max(self._number, 0)
        watch, still = self._watch, course.number(elapsed) == self._number
        if watch is not None and watch.met:
            if still:
                course.leave(elapsed)
            passed += 1
        elif watch is not None and still and (silent := watch.silence(now)) > self._silence:
            where = f"segment {self._number + 1} waits for the vibration"
            self.abort(now, f"{where}, and no good sample of it has come for {silent:.3g} s")
            return
        number, missed = course.number(elapsed), ""
        for unmet in range(passed, number):
            if (until := course.until(unmet)) is None:
                continue
            self.why = f"segment {unmet + 1}: no {until.words} within {until.at_most:g} s"
            missed = f"; {self.why}"
            if until.otherwise == "abort":
                self.abort(now, self.why)
                return
        if number != self._number:
            self._number, until = number, course.until(number)
            self._watch = None if until is None else VibrationWatch(until, now)
            if number < course.count:
                words = f"segment {number + 1} of {course.count}, {course.words(number)}"
                self._enter(ProfileState.RUNNING, words + missed)
        self.command = float(course.profile.speed(elapsed + self._ahead))
        if number >= course.count:
            self._enter(ProfileState.DONE, missed.removeprefix("; "))

    def _enter(self, state: ProfileState, more: str = "") -> None:
        self.state = state
        status = f"{state.value}: {more}" if more else state.value
        if status != self.status:
            self.status = status
            self._say(status, not self.why)
