"""State machine of the start-up firmware, and the interface of the profiles that it runs.

It needs neither middleware nor a clock, so that tests can run it alone.
"""

import enum
import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, Protocol

from ab_sim.base.numbers import MOST_TIME, finite


class ProfileInputs(NamedTuple):
    """Measurements that a profile needs."""

    vibration: bool = False
    """True if a condition of the profile depends on the vibration."""
    sensor: str | None = None
    """Name of the sensor of which the profile needs every sample, with the spindle's angle; None if
    it needs no such sensor."""
    first_sensor: bool = True
    """True if ``sensor`` is the drive's first one of its kind, accelerometer or probe."""
    probe: bool = False
    """True if ``sensor`` is a proximity probe."""


class ProfileExecution(Protocol):
    """A profile in progress. Times are by the caller's clock [s]."""

    first: float
    """Speed at which the profile begins [rad/s]."""

    @property
    def words(self) -> str:
        """Description, for the status text, of the segment or state that is in progress."""

    @property
    def segment(self) -> tuple[int, int]:
        """Number of the present segment, from 1, and number of segments; zeros without segments."""

    @property
    def ended(self) -> bool:
        """True if the final speed is held from now on."""

    @property
    def reached(self) -> bool:
        """True if the profile has ended as planned, which an aborted or failed one has not."""

    @property
    def failure(self) -> str:
        """Reason for an abort; empty if there is none."""

    @property
    def why(self) -> str:
        """Latest problem, whether or not it aborts the profile; empty if there is none."""

    @property
    def values(self) -> Mapping[str, str]:
        """Numbers for the diagnostics, units in the keys."""

    def begin(self, now: float) -> None:
        """Begin the profile at the time ``now`` [s]."""

    def command(self, now: float) -> float | None:
        """Run one period; return the speed to command now [rad/s], or None for no command."""

    def state(self) -> dict[str, Any]:
        """Return the complete state as JSON-able values."""

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from a result of ``state``; an invalid one may raise any error."""


class ProfileState(enum.Enum):
    """State of a profile."""

    IDLE = "idle"
    WAITING = "waiting"
    """Waiting for a drive."""
    RUNNING = "running"
    DONE = "done"
    """Done; the final speed is held."""
    ABORTING = "aborting"
    """Ramping down."""
    ABORTED = "aborted"
    """Aborted; standstill is commanded."""

    @property
    def under_way(self) -> bool:
        """True if the profile was started and is not over."""
        return self in (ProfileState.RUNNING, ProfileState.ABORTING)


_COMMANDING = (ProfileState.RUNNING, ProfileState.DONE, ProfileState.ABORTING, ProfileState.ABORTED)

MOST_SPEED = 1e6
"""Largest magnitude of a commanded speed in a snapshot [rad/s]."""


class ProfileRun:
    """State machine that runs speed profiles one after the other and commands their speeds.

    Times are by any clock that only advances.

    Parameters
    ----------
    ahead
        Lead of the commands of a ramp down [s], because a drive approaches each command until the
        next one.
    say
        Function that receives the status whenever it changes: the state's word, often with details
        after a colon; and True if there is no problem.
    """

    def __init__(self, ahead: float, say: Callable[[str, bool], None]) -> None:
        self._ahead, self._say = ahead, say
        self.execution: ProfileExecution | None = None
        """Profile that was started last; None before the first."""
        self._deceleration = math.inf
        self._falls = (0.0, 0.0)
        self.began = 0.0
        """Start time of the profile that was started last [s]."""
        self.state = ProfileState.IDLE
        self.status = ""
        self.why = ""
        """Reason of an abort, or problem; empty if there is none."""
        self.command = 0.0
        """Last commanded speed [rad/s]."""
        self.commanded: float | None = None
        """Result of the last call of ``tick``."""
        self._enter(ProfileState.IDLE)

    def wait(self, what: str) -> None:
        """Change to the state ``WAITING``; ``what`` names the condition in the status."""
        self._enter(ProfileState.WAITING, what)

    def start(
        self,
        now: float,
        execution: ProfileExecution,
        deceleration: float,
        begin: float | None = None,
    ) -> str:
        """Start a profile from its beginning; refuse while another one runs or ramps down.

        Parameters
        ----------
        now
            The time [s].
        execution
            The profile, not yet begun.
        deceleration
            Deceleration of an abort [rad/s^2].
        begin
            Time at which the profile begins [s]; None for now.

        Returns
        -------
        str
            Reason of a refusal; empty if the profile runs.
        """
        if self.state is ProfileState.RUNNING:
            return "running already; abort first"
        if self.state is ProfileState.ABORTING:
            return "ramping down; wait for standstill"
        if self.state is ProfileState.DONE and self.command != execution.first:
            return (
                f"{self.command:g} rad/s is commanded, and the profile begins at "
                f"{execution.first:g} rad/s; abort first"
            )
        self.execution, self._deceleration = execution, deceleration
        self.command, self.why = execution.first, ""
        self.state = ProfileState.RUNNING
        self.shift(now if begin is None else begin)
        self.tick(now)
        return ""

    def shift(self, now: float) -> None:
        """Move the start of the profile to the present time."""
        self.began = now
        if self.execution is not None:
            self.execution.begin(now)

    def abort(self, now: float, why: str) -> str:
        """Ramp down to standstill; return the reason of a refusal, empty if there is none."""
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
        """Abort the profile and command 0 rad/s without a ramp, as there is no motion any more."""
        self.why = why
        self.command = 0.0
        self._enter(ProfileState.ABORTED, why)

    def tick(self, now: float) -> float | None:
        """Run one period; return the speed to command now [rad/s], or None for no command."""
        is_commanding = self.state in _COMMANDING
        follows_profile = self.state in (ProfileState.RUNNING, ProfileState.DONE)
        if follows_profile and self.execution is not None:
            is_commanding = self._run(self.execution, now)
        if self.state is ProfileState.ABORTING:
            since, speed = self._falls
            speed_left = abs(speed) - self._deceleration * max(now + self._ahead - since, 0.0)
            self.command = math.copysign(max(speed_left, 0.0), speed)
            if speed_left <= 0.0:
                self.command = 0.0
                self._enter(ProfileState.ABORTED)
        self.commanded = self.command if is_commanding else None
        return self.commanded

    def state_values(self) -> dict[str, Any]:
        """Return the complete state as JSON-able values."""
        return {
            "state": self.state.value,
            "status": self.status,
            "why": self.why,
            "command": self.command,
            "commanded": self.commanded,
            "began": self.began,
            "falls": self._falls,
            "deceleration": self._deceleration,
            "execution": None if self.execution is None else self.execution.state(),
        }

    def restore(self, kept: Mapping[str, Any], execution: ProfileExecution | None) -> None:
        """Continue from a result of ``state_values``.

        Parameters
        ----------
        kept
            The values.
        execution
            The profile of the state, not yet begun; None if there was none.

        Raises
        ------
        ArithmeticError, AttributeError, LookupError, TypeError, ValueError
            The values are invalid; nothing has changed.
        """
        state, status, why = ProfileState(kept["state"]), str(kept["status"]), str(kept["why"])
        began, command = finite(kept["began"], 0.0, MOST_TIME), _speed(kept["command"])
        commanded = None if kept["commanded"] is None else _speed(kept["commanded"])
        since, speed = kept["falls"]
        since, speed = finite(since, 0.0, MOST_TIME), _speed(speed)
        deceleration = float(kept["deceleration"])
        if not deceleration > 0.0 or (state is ProfileState.ABORTING and math.isinf(deceleration)):
            raise ValueError(f"deceleration = {deceleration}: must be above 0, and finite")
        if execution is not None:
            execution.restore(kept["execution"])
        self.execution, self.state, self.why = execution, state, why
        self.began, self.command, self._deceleration = began, command, deceleration
        self._falls, self.commanded = (since, speed), commanded
        self.status = status
        self._say(status, not why)

    def _run(self, execution: ProfileExecution, now: float) -> bool:
        """Run one period of the execution; return whether it commands a speed."""
        speed = execution.command(max(now, self.began))
        self.why = execution.why
        if execution.failure:
            self.abort(now, execution.failure)
            return True
        self.command = self.command if speed is None else speed
        self._enter(ProfileState.DONE if execution.ended else ProfileState.RUNNING, execution.words)
        return speed is not None

    def _enter(self, state: ProfileState, more: str = "") -> None:
        """Change the state, and report a new status, which consists of the state and ``more``."""
        self.state = state
        status = f"{state.value}: {more}" if more else state.value
        if status != self.status:
            self.status = status
            self._say(status, not self.why)


def _speed(value: Any) -> float:
    """Return a speed [rad/s] from a snapshot; refuse one that is not finite or too large."""
    return finite(value, -MOST_SPEED, MOST_SPEED)
