"""A profile by a clock that may leap, and its way into a snapshot and out of it; no ROS."""

from collections.abc import Callable

from ab_sim.errors import NOT_AS_WRITTEN, InputError
from ab_sim.nodes.courses import PlannedCourse
from ab_sim.nodes.profile_snapshot import ProfileSnapshot
from ab_sim.quoting import short
from ab_sim.spindle.course import Course
from ab_sim.spindle.profile_run import ProfileRun, ProfileState

LEAP = 2_000_000_000
"""ns; a clock that goes on by more than this between two commands has leapt."""
FASTEST = 200.0
"""Times real time; faster than a simulator is asked to go, and what its clock does is a leap."""


class TimedRun:
    """Runs profiles by a clock. Simulated time may leap, as a simulator is reset or put back.

    Args:
        period: between two commands [s].
        simulated: whether time is a simulator's; then periods count from a profile's beginning, and
            else whenever it is asked is when a command is due.
        say: see ``ProfileRun``.
        warn: told of leaps.
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
        self._plan: PlannedCourse | None = None
        self._now = self._began = 0
        self._put_back: int | None = None
        self.run = ProfileRun(period, say)

    @property
    def waits(self) -> bool:
        """Whether it was put back, and the drive was not yet."""
        return self._put_back is not None

    @property
    def course(self) -> Course | None:
        """Who is to hear what comes."""
        return None if self.waits else self.run.course

    @property
    def elapsed(self) -> float:
        """Time since the profile began [s]; 0 before it begins."""
        return max(self._now * 1e-9 - self.run.began, 0.0)

    def start(
        self,
        now: int,
        plan: PlannedCourse,
        silence: float,
        deceleration: float,
        begin: int | None = None,
    ) -> str:
        """Run a profile from its beginning.

        Args:
            now: time [ns].
            plan: the profile.
            silence: see ``PlannedCourse.course``.
            deceleration: of an abort [rad/s^2].
            begin: time of the beginning [ns], not before now; None: now.

        Returns:
            Why not, if it may not be; else nothing.
        """
        course, begin = plan.course(silence), now if begin is None else begin
        if refusal := self.run.start(now * 1e-9, course, deceleration, begin * 1e-9):
            return refusal
        self._plan, self._put_back = plan, None
        self._now, self._began = now, begin
        return ""

    def postpone(self, begin: int) -> None:
        """Let the profile begin at a later time [ns]."""
        self._began = begin
        self.run.shift(begin * 1e-9)

    def tick(self, now: int, passed: float) -> float | None:
        """What is to be commanded now [rad/s]; None: nothing.

        Args:
            now: time [ns].
            passed: since the last call, by the steady clock [s].
        """
        if self._put_back is not None:
            return self._wait(now)
        before = self._now
        if now >= before and not self._due(before, now):
            return None
        if before == self._began == 0 and now >= LEAP:
            # Started before the first message on /clock was heard: the profile begins now.
            before = self._began = now
            self.run.shift(now * 1e-9)
        self._now = now
        self._see_leap(before, now, passed)
        return self.run.tick(now * 1e-9)

    def abort(self, now: int, why: str) -> str:
        """Ramp down to standstill, time being now [ns]; why not, if that makes no sense."""
        if self._put_back is not None:
            # Whoever aborts does not wait for a drive to be put back.
            self._put_back, self._now = None, now
        return self.run.abort(now * 1e-9, why)

    def snapshot(self) -> ProfileSnapshot:
        """The present."""
        plan, kept = self._plan, self.run.state_values()
        if plan is None:
            return ProfileSnapshot(self._now, self._began, "", [], None, kept)
        return ProfileSnapshot(
            self._now, self._began, plan.source, plan.changes, plan.made_of, kept
        )

    def restore(
        self, now: int, snapshot: ProfileSnapshot, plan: PlannedCourse | None, silence: float
    ) -> None:
        """Go on from a snapshot, as soon as the drive's time is there.

        Args:
            now: time [ns].
            snapshot: the present of then.
            plan: the profile that it is of; None: there was none.
            silence: see ``PlannedCourse.course``.

        Raises:
            InputError: it is of another profile, or damaged; nothing has changed.
        """
        if plan is not None and plan.made_of != snapshot.made_of:
            raise InputError(f"{plan.source} is another profile than it was; save it again")
        try:
            self.run.restore(snapshot.run, None if plan is None else plan.course(silence))
        except NOT_AS_WRITTEN as error:
            raise InputError(f"it holds no state of a profile: {short(error)}") from error
        self._plan, self._now, self._began = plan, snapshot.time, snapshot.began
        self._put_back = now

    def _wait(self, now: int) -> float | None:
        """For the drive: until its time goes back, or comes as far as the snapshot's."""
        since, self._put_back = self._put_back, now
        assert since is not None
        if not (now < since if since > self._now else now >= self._now):
            return None
        self._put_back = None
        # Again: the command of then may have been under way when the drive was kept.
        again, anew = self.run.commanded, self.tick(now, 0.0)
        return again if anew is None else anew

    def _due(self, before: int, now: int) -> bool:
        return not self._simulated or (
            (now - self._began) // self._period != (before - self._began) // self._period
        )

    def _see_leap(self, before: int, now: int, passed: float) -> None:
        if self.run.state not in (ProfileState.RUNNING, ProfileState.DONE, ProfileState.ABORTING):
            return
        leapt = f"time leapt from {before / 1e9:g} to {now / 1e9:g} s"
        # At a hundred times real time a moment's delay is seconds, and no leap.
        if now < before:
            # The drive was reset or restarted, and stands where it stood at first.
            self._warn(leapt)
            self.run.drop(leapt)
        elif now - before >= max(LEAP, round(1e9 * FASTEST * passed)):
            self._warn(leapt)
            self.run.abort(now * 1e-9, leapt)
