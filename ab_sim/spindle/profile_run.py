"""What start-up firmware decides: no middleware and no clock, so that it can be tested alone."""

import enum
import math
from collections.abc import Callable, Mapping
from typing import Any

from ab_sim.spindle.course import Course
from ab_sim.stored_numbers import MOST_TIME, finite


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

    @property
    def under_way(self) -> bool:
        """Whether it has been started and is not over."""
        return self in (ProfileState.RUNNING, ProfileState.ABORTING)


COMMANDING = (ProfileState.RUNNING, ProfileState.DONE, ProfileState.ABORTING, ProfileState.ABORTED)

MOST_SPEED = 1e6
"""rad/s; of a command in a snapshot."""


class ProfileRun:
    """One profile after the other and what becomes of it; times are of any clock that goes on.

    Args:
        ahead: how far ahead of time commands of a ramp down are [s]: a drive goes there until the
            next one comes.
        say: told the status whenever it changes: the state's word, and often more behind a colon;
            and whether all is well.
    """

    def __init__(self, ahead: float, say: Callable[[str, bool], None]) -> None:
        self._ahead, self._say = ahead, say
        self.course: Course | None = None
        """The profile that was started last; None before the first."""
        self._deceleration = math.inf
        self._falls = (0.0, 0.0)
        self.began = 0.0
        self.state = ProfileState.IDLE
        self.status = ""
        self.why = ""
        """It was aborted, or something did not go well; empty as long as all is well."""
        self.command = 0.0
        """The speed that was commanded last [rad/s]."""
        self.commanded: float | None = None
        """What the last call of ``tick`` gave."""
        self._enter(ProfileState.IDLE)

    def wait(self, what: str) -> None:
        """Wait for something."""
        self._enter(ProfileState.WAITING, what)

    def start(
        self, now: float, course: Course, deceleration: float, begin: float | None = None
    ) -> str:
        """Run a profile from its beginning.

        Args:
            now: the time [s].
            course: the profile, which nobody has begun.
            deceleration: of an abort [rad/s^2].
            begin: time of its beginning [s]; None: now.

        Returns:
            Why not, if it may not be; else nothing.
        """
        if self.state is ProfileState.RUNNING:
            return "running already; abort first"
        if self.state is ProfileState.ABORTING:
            return "ramping down; wait for standstill"
        if self.state is ProfileState.DONE and self.command != course.first:
            return (
                f"{self.command:g} rad/s is commanded, and the profile begins at "
                f"{course.first:g} rad/s; abort first"
            )
        self.course, self._deceleration = course, deceleration
        self.command, self.why = course.first, ""
        self.state = ProfileState.RUNNING
        self.shift(now if begin is None else begin)
        self.tick(now)
        return ""

    def shift(self, now: float) -> None:
        """It began just now, and not at the time that was said."""
        self.began = now
        if self.course is not None:
            self.course.begin(now)

    def abort(self, now: float, why: str) -> str:
        """Ramp down to standstill; why not, if that makes no sense."""
        if self.state is ProfileState.WAITING:
            self._enter(ProfileState.IDLE)
        elif self.state in (ProfileState.RUNNING, ProfileState.DONE):
            self.why = why
            self._falls = now, self.command
            self._enter(ProfileState.ABORTING, why)
            self.tick(now)
        elif self.state is not ProfileState.ABORTING:
            return "not running"
        return ""

    def drop(self, why: str) -> None:
        """Command standstill at once: there is nothing any more that could be ramped down."""
        self.why = why
        self.command = 0.0
        self._enter(ProfileState.ABORTED)

    def tick(self, now: float) -> float | None:
        """What is to be commanded now [rad/s]; None: nothing."""
        speaks = self.state in COMMANDING
        if self.state is ProfileState.RUNNING and self.course is not None:
            speaks = self._run(self.course, now)
        if self.state is ProfileState.ABORTING:
            since, speed = self._falls
            left = abs(speed) - self._deceleration * max(now + self._ahead - since, 0.0)
            self.command = math.copysign(max(left, 0.0), speed)
            if left <= 0.0:
                self.command = 0.0
                self._enter(ProfileState.ABORTED)
        self.commanded = self.command if speaks else None
        return self.commanded

    def state_values(self) -> dict[str, Any]:
        """All that it needs to go on, as JSON-able values."""
        return {
            "state": self.state.value,
            "status": self.status,
            "why": self.why,
            "command": self.command,
            "commanded": self.commanded,
            "began": self.began,
            "falls": self._falls,
            "deceleration": self._deceleration,
            "course": None if self.course is None else self.course.state(),
        }

    def restore(self, kept: Mapping[str, Any], course: Course | None) -> None:
        """Go on from what ``state_values`` gave.

        Args:
            kept: the values.
            course: the profile that they are of, which nobody has begun; None if there was none.

        Raises:
            ArithmeticError, AttributeError, LookupError, TypeError, ValueError: they are none; then
                nothing has changed.
        """
        state, status, why = ProfileState(kept["state"]), str(kept["status"]), str(kept["why"])
        began, command = finite(kept["began"], 0.0, MOST_TIME), _speed(kept["command"])
        commanded = None if kept["commanded"] is None else _speed(kept["commanded"])
        since, speed = kept["falls"]
        since, speed = finite(since, 0.0, MOST_TIME), _speed(speed)
        deceleration = float(kept["deceleration"])
        if not deceleration > 0.0 or (state is ProfileState.ABORTING and math.isinf(deceleration)):
            raise ValueError(f"deceleration = {deceleration}: must be above 0, and finite")
        if course is not None:
            course.restore(kept["course"])
        self.course, self.state, self.why = course, state, why
        self.began, self.command, self._deceleration = began, command, deceleration
        self._falls, self.commanded = (since, speed), commanded
        self.status = status
        self._say(status, not why)

    def _run(self, course: Course, now: float) -> bool:
        """One period of it; whether it commands anything."""
        speed = course.command(max(now, self.began))
        self.why = course.why
        if course.failure:
            self.abort(now, course.failure)
            return True
        self.command = self.command if speed is None else speed
        self._enter(ProfileState.DONE if course.ended else ProfileState.RUNNING, course.words)
        return speed is not None

    def _enter(self, state: ProfileState, more: str = "") -> None:
        self.state = state
        status = f"{state.value}: {more}" if more else state.value
        if status != self.status:
            self.status = status
            self._say(status, not self.why)


def _speed(value: Any) -> float:
    """Return a speed from a file [rad/s]."""
    return finite(value, -MOST_SPEED, MOST_SPEED)
