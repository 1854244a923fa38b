"""Run of a profile by a clock that may jump, and its snapshots; no ROS."""

from collections.abc import Callable

from ab_sim.base.errors import NOT_AS_WRITTEN, InputError
from ab_sim.base.numbers import reason_of
from ab_sim.model.spindle.profile_execution import ProfileExecution
from ab_sim.model.spindle.profile_run import ProfileRun, ProfileState
from ab_sim.nodes.checked_profile import CheckedProfile
from ab_sim.nodes.profile_snapshot import ProfileSnapshot

LEAP = 2_000_000_000
"""Advance of a clock between two commands from which on it may be a jump [ns]."""
FASTEST = 200.0
"""Largest ratio of simulated to real time; a faster advance is a jump."""


class TimedRun:
    """Runs profiles by a clock, which may jump if it is that of a simulator.

    Args:
        period: time between two commands [s].
        simulated: whether the clock is that of a simulator. Periods then count from the profile's
            start; otherwise a command is due at every call.
        say: see ``ProfileRun``.
        warn: function that reports a jump of the clock.
    """

    def __init__(
        self,
        period: float,
        simulated: bool,
        say: Callable[[str, bool], None],
        warn: Callable[[str], object],
    ) -> None:
        self._period = round(period * 1e9)
        self._simulated, self._warn = simulated, warn
        self._plan: CheckedProfile | None = None
        self._now = self._began = 0
        self._put_back: int | None = None
        self.run = ProfileRun(period, say)

    @property
    def waits(self) -> bool:
        """True if the run was restored, and waits until the drive is restored, too."""
        return self._put_back is not None

    @property
    def execution(self) -> ProfileExecution | None:
        """Execution that receives samples; None while waiting for the drive."""
        return None if self.waits else self.run.execution

    @property
    def elapsed(self) -> float:
        """Time since the start of the profile [s]; 0 before."""
        return max(self._now * 1e-9 - self.run.began, 0.0)

    def start(
        self,
        now: int,
        plan: CheckedProfile,
        silence: float,
        deceleration: float,
        begin: int | None = None,
    ) -> str:
        """Run a profile from its beginning.

        Args:
            now: present time [ns].
            plan: profile to run.
            silence: see ``CheckedProfile.execution``.
            deceleration: deceleration of an abort [rad/s^2].
            begin: start of the profile [ns], not before ``now``; None: ``now``.

        Returns:
            Empty text, or the reason of a refusal.
        """
        execution, begin = plan.execution(silence), now if begin is None else begin
        if refusal := self.run.start(now * 1e-9, execution, deceleration, begin * 1e-9):
            return refusal
        self._plan, self._put_back = plan, None
        self._now, self._began = now, begin
        return ""

    def postpone(self, begin: int) -> None:
        """Move the start of the profile to a later time [ns]."""
        self._began = begin
        self.run.shift(begin * 1e-9)

    def tick(self, now: int, passed: float) -> float | None:
        """Return the speed to command now [rad/s]; None: no command.

        Args:
            now: present time [ns].
            passed: time since the last call, by the steady clock [s].
        """
        if self._put_back is not None:
            return self._wait(now)
        before = self._now
        if now >= before and not self._due(before, now):
            return None
        if before == self._began == 0 and now >= LEAP:
            # Started before the first message on /clock: the profile begins now.
            before = self._began = now
            self.run.shift(now * 1e-9)
        self._now = now
        self._see_leap(before, now, passed)
        return self.run.tick(now * 1e-9)

    def abort(self, now: int, why: str) -> str:
        """Begin to ramp down to standstill.

        Args:
            now: present time [ns].
            why: reason, for the status.

        Returns:
            Empty text, or the reason if there is no profile to abort.
        """
        if self._put_back is not None:
            # An abort does not wait for the drive to be restored.
            self._put_back, self._now = None, now
        return self.run.abort(now * 1e-9, why)

    def snapshot(self) -> ProfileSnapshot:
        """Return the present state as a snapshot."""
        plan, kept = self._plan, self.run.state_values()
        if plan is None:
            return ProfileSnapshot(self._now, self._began, "", [], None, kept)
        return ProfileSnapshot(
            self._now, self._began, plan.source, plan.changes, plan.made_of, kept
        )

    def restore(
        self, now: int, snapshot: ProfileSnapshot, plan: CheckedProfile | None, silence: float
    ) -> None:
        """Restore a snapshot, and continue when the drive has reached its time.

        Args:
            now: present time [ns].
            snapshot: state to restore.
            plan: profile of the snapshot; None: no profile.
            silence: see ``CheckedProfile.execution``.

        Raises:
            InputError: the snapshot belongs to another profile or is damaged; nothing has changed.
        """
        if plan is not None and plan.made_of != snapshot.made_of:
            raise InputError(
                f"the profile {plan.source} has changed since; save a new snapshot, or restore the "
                "profile"
            )
        try:
            self.run.restore(snapshot.run, None if plan is None else plan.execution(silence))
        except NOT_AS_WRITTEN as error:
            raise InputError(f"it has no valid state of a profile: {reason_of(error)}") from error
        self._plan, self._now, self._began = plan, snapshot.time, snapshot.began
        self._put_back = now

    def _wait(self, now: int) -> float | None:
        """Return the speed to command [rad/s] once the drive's time has reached the snapshot's.

        Before, return None. The drive's time either jumps back, or advances to the snapshot's.
        """
        since, self._put_back = self._put_back, now
        assert since is not None
        if not (now < since if since > self._now else now >= self._now):
            return None
        self._put_back = None
        # The last command is sent again, because it may not have reached the drive before the
        # drive's snapshot.
        again, anew = self.run.commanded, self.tick(now, 0.0)
        return again if anew is None else anew

    def _due(self, before: int, now: int) -> bool:
        return not self._simulated or (
            (now - self._began) // self._period != (before - self._began) // self._period
        )

    def _see_leap(self, before: int, now: int, passed: float) -> None:
        if self.run.state not in (ProfileState.RUNNING, ProfileState.DONE, ProfileState.ABORTING):
            return
        leapt = f"time jumped from {before / 1e9:g} to {now / 1e9:g} s"
        # At a hundred times real time, a short delay of messages is seconds of simulated time.
        if now < before:
            # The drive was reset or restarted, and is at its start.
            self._warn(leapt)
            self.run.drop(leapt)
        elif now - before >= max(LEAP, round(1e9 * FASTEST * passed)):
            self._warn(leapt)
            self.run.abort(now * 1e-9, leapt)
