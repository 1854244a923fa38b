"""Run of a checked profile by a clock that may jump, and its snapshots; no ROS."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from ab_sim.base.errors import NOT_AS_WRITTEN, InputError, exact
from ab_sim.base.numbers import entry, reason_of, whole
from ab_sim.control import SensorFacts, StartUpSettings
from ab_sim.drive.controllers import settings_of
from ab_sim.drive.snapshot_file import check_origin, origin, read_content, write_content
from ab_sim.model.spindle import SpeedSchedule
from ab_sim.model.spindle.profile_run import (
    ProfileExecution,
    ProfileInputs,
    ProfileRun,
    ProfileState,
)
from ab_sim.model.spindle.segments_execution import SegmentsExecution, waits_for_vibration
from ab_sim.nodes.adaptive_execution import AdaptiveExecution
from ab_sim.scene.load import RequestedProfile
from ab_sim.scene.profiles import AdaptiveProfile

_FORMAT = "ab_sim profile snapshot"
"""Value of the key ``format`` in a snapshot's file."""
_OTHERWISE = (
    "not a snapshot of a profile controller; the drive's ~/restore_snapshot reads snapshots of "
    "drives"
)
_WHO = "ab_sim.nodes.timed_run"
"""Module whose version a snapshot must match."""


class ProfileSnapshot(NamedTuple):
    """State of a controller at one instant."""

    time: int
    """Simulated time [ns]."""
    began: int
    """Start of the profile [ns]."""
    source: str
    """Value of the parameter ``profile`` when the profile started; empty before the first one."""
    changes: list[str]
    """Changes to the profile, each ``key=value``."""
    made_of: Mapping[str, Any] | None
    """Definition of the profile, see ``CheckedProfile.made_of``; None before the first one."""
    run: Mapping[str, Any]
    """State of the run: see ``ProfileRun.state_values``."""
    trajectory: int | None = None
    """Start of the trajectory that the drive follows [ns]; None if it follows speed commands."""


def write_profile_snapshot(path: Path, snapshot: ProfileSnapshot) -> None:
    """Write a snapshot; an existing file is replaced atomically.

    Parameters
    ----------
    path
        File that ends in .json.
    snapshot
        State to write.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    write_content(path, {"format": _FORMAT, **origin(_WHO), **snapshot._asdict()})


def read_profile_snapshot(path: Path) -> ProfileSnapshot:
    """Read a snapshot.

    Raises
    ------
    InputError
        The file is missing or damaged, or from another version of ab_sim.
    """
    content = read_content(path, _FORMAT, _OTHERWISE)
    check_origin(path, content, _WHO)
    try:
        return ProfileSnapshot(
            entry(content, "time", _time),
            entry(content, "began", _time),
            entry(content, "source", str),
            entry(content, "changes", lambda changes: [str(change) for change in changes]),
            entry(content, "made_of", lambda values: None if values is None else dict(values)),
            entry(content, "run", dict),
            entry(content, "trajectory", lambda start: None if start is None else _time(start)),
        )
    except ValueError as error:
        raise InputError(f"snapshot {path}: is damaged: {error}") from error


def _time(value: Any) -> int:
    return whole(value, 0)


_PERIODS_AGREE = 1e-9
"""Largest relative difference between the periods of an adaptive start-up and of the commands."""


class CheckedProfile:
    """Profile that was requested and checked, and has not started.

    Parameters
    ----------
    requested
        Requested profile.
    source
        Value of the parameter that names the profile.
    changes
        Changes to the profile, each ``key=value``.
    period
        Time between two commands [s].

    Raises
    ------
    InputError
        The profile requires another period.
    """

    def __init__(
        self, requested: RequestedProfile, source: str, changes: list[str], period: float
    ) -> None:
        self.source, self.changes = source, changes
        self._requested, self._period = requested, period
        self._settings: StartUpSettings | None = None
        profile = requested.profile
        if isinstance(profile, AdaptiveProfile):
            if abs(profile.command_period / period - 1.0) > _PERIODS_AGREE:
                raise InputError(
                    f"profile.command_period = {exact(profile.command_period)} s: this node "
                    f"commands every {exact(period)} s; start it with command_rate = "
                    f"{exact(1.0 / profile.command_period)} [1/s], or change the period"
                )
            self._settings = _settings(requested, profile)

    @property
    def steepest(self) -> float:
        """Largest magnitude of the profile's acceleration [rad/s^2]; 0: the speed is constant."""
        profile = self._requested.profile
        if isinstance(profile, AdaptiveProfile):
            return profile.acceleration
        return SpeedSchedule.of_profile(profile, self._requested.first).steepest

    @property
    def schedule(self) -> SpeedSchedule | None:
        """Speed over time; None if it depends on measurements."""
        if isinstance(self._requested.profile, AdaptiveProfile) or waits_for_vibration(
            self._requested
        ):
            return None
        return SpeedSchedule.of_profile(self._requested.profile, self._requested.first)

    @property
    def inputs(self) -> ProfileInputs:
        """Input topics that the profile needs."""
        profile, scene = self._requested.profile, self._requested.scene
        if isinstance(profile, AdaptiveProfile):
            name = profile.sensor
            probe = scene is not None and name in scene.probes
            alike = () if scene is None else scene.probes if probe else scene.sensors
            return ProfileInputs(
                sensor=name, first_sensor=name == next(iter(alike), name), probe=probe
            )
        return ProfileInputs(vibration=waits_for_vibration(self._requested))

    @property
    def made_of(self) -> dict[str, Any]:
        """Definition of the profile as JSON-able values, for comparison with a snapshot's."""
        requested = self._requested
        definition: Mapping[str, Any] = {
            "profile": requested.profile.model_dump(mode="json"),
            "first": requested.first,
            "settings": self._settings,
        }
        return dict(json.loads(json.dumps(definition)))

    def execution(self, silence: float) -> ProfileExecution:
        """Return the execution of the profile, ready to begin.

        Parameters
        ----------
        silence
            Longest time without vibration messages while a condition needs them [s].
        """
        if self._settings is not None:
            return AdaptiveExecution(self._settings, self._requested.first)
        return SegmentsExecution(self._requested, self._period, silence)


def _settings(requested: RequestedProfile, profile: AdaptiveProfile) -> StartUpSettings:
    """Return the settings of an adaptive start-up, with the scene's sensor if there is a scene."""
    if requested.scene is not None:
        return settings_of(requested.scene)
    # A profile without a scene does not describe the sensor. The noise is then estimated. Unknown
    # angles of the sensor's axes only turn the estimated unbalance.
    return profile.settings(SensorFacts("acceleration", 2))


_LEAP = 2_000_000_000
"""Least advance of a clock between two commands that may be a jump [ns]."""
FASTEST = 200.0
"""Largest ratio of simulated to real time; a faster advance is a jump."""


class TimedRun:
    """Runs profiles by a clock, which may jump if a simulator publishes it.

    Parameters
    ----------
    period
        Time between two commands [s].
    simulated
        Whether the clock is that of a simulator. Periods then count from the profile's start;
        otherwise a command is due at every call.
    say
        See ``ProfileRun``.
    warn
        Function that reports a jump of the clock.
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
        """True if this run has been restored from a snapshot, and the drive has not yet been."""
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
        """Start a profile from its beginning, now or at a given time.

        Parameters
        ----------
        now
            Present time [ns].
        plan
            Profile to run.
        silence
            See ``CheckedProfile.execution``.
        deceleration
            Deceleration of an abort [rad/s^2].
        begin
            Start of the profile [ns], not before ``now``; None: ``now``.

        Returns
        -------
        str
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

        Parameters
        ----------
        now
            Present time [ns].
        passed
            Time since the last call, by the steady clock [s].
        """
        if self._put_back is not None:
            return self._wait(now)
        before = self._now
        if now >= before and not self._due(before, now):
            return None
        if before == self._began == 0 and now >= _LEAP:
            # Started before the first message on /clock: the profile begins now.
            before = self._began = now
            self.run.shift(now * 1e-9)
        self._now = now
        self._see_leap(before, now, passed)
        return self.run.tick(now * 1e-9)

    def abort(self, now: int, why: str) -> str:
        """Begin to ramp down to standstill.

        Parameters
        ----------
        now
            Present time [ns].
        why
            Reason, for the status.

        Returns
        -------
        str
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
        """Restore a snapshot, and continue when the drive's time is that of the snapshot.

        Parameters
        ----------
        now
            Present time [ns].
        snapshot
            State to restore.
        plan
            Profile of the snapshot; None: no profile.
        silence
            See ``CheckedProfile.execution``.

        Raises
        ------
        InputError
            The snapshot belongs to another profile or is damaged; nothing has changed.
        """
        if plan is not None and plan.made_of != snapshot.made_of:
            raise InputError(
                f"the profile {plan.source} has changed since; save a new snapshot, or restore the "
                "profile"
            )
        try:
            self.run.restore(snapshot.run, None if plan is None else plan.execution(silence))
        except NOT_AS_WRITTEN as error:
            raise InputError(f"the state of its profile is invalid: {reason_of(error)}") from error
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
        """Return whether a period has begun between two times [ns]; True without a simulator."""
        return not self._simulated or (
            (now - self._began) // self._period != (before - self._began) // self._period
        )

    def _see_leap(self, before: int, now: int, passed: float) -> None:
        """Drop or abort the profile if the clock has jumped.

        Parameters
        ----------
        before, now
            Times of the last and of the present call by the node's clock [ns].
        passed
            Time between the two calls by the steady clock [s].
        """
        if self.run.state not in (ProfileState.RUNNING, ProfileState.DONE, ProfileState.ABORTING):
            return
        leapt = f"time jumped from {before / 1e9:g} to {now / 1e9:g} s"
        # At a hundred times real time, a short delay of messages is seconds of simulated time.
        if now < before:
            # The drive was reset or restarted, and is at its start.
            self._warn(leapt)
            self.run.drop(leapt)
        elif now - before >= max(_LEAP, round(1e9 * FASTEST * passed)):
            self._warn(leapt)
            self.run.abort(now * 1e-9, leapt)
