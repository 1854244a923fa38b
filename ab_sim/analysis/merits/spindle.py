"""Watches of the spindle: its start, its last speed, its motor's torque, balls that slip on it."""

import math

import numpy as np

from ab_sim.analysis.merits.each_run import EachRun, JudgedRun
from ab_sim.analysis.merits.judging import JudgedRuns, Piece
from ab_sim.drive.trajectory import Trajectory

NEAR = 0.01
"""A spindle has its speed while it is this near to it, as a share of the larger of the first and
the present speed that are asked for."""


def _follows_the_start(time: np.ndarray) -> bool:
    """Whether the sample before the first one would be that of the run's start, at t = 0.

    Some runs have it among their samples and some have not; merits are the same.
    """
    return len(time) > 1 and 0.0 < time[0] < 1.001 * (time[1] - time[0])


class SpindleStart:
    """When the speed that is asked for begins to change, in a single run."""

    def __init__(self, run: JudgedRun) -> None:
        self.found: float | None = None
        """s, of the last sample with the first command; None if it never changes."""
        self._first, self._before = math.nan, math.nan
        self._at_start = run.start_speed

    def take(self, samples: Trajectory, late: int) -> None:
        """The next samples."""
        if self.found is not None:
            return
        time, command = samples["time"], samples["command"]
        if math.isnan(self._before) and _follows_the_start(time):
            self._first, self._before = self._at_start, 0.0
        elif math.isnan(self._before):
            self._first = float(command[0])
        other = np.flatnonzero(command != self._first)
        if len(other):
            self.found = float(time[other[0] - 1]) if other[0] else self._before
        self._before = float(time[-1])


class SpindleStartWatch(EachRun[SpindleStart]):
    """When the speed that is asked for begins to change."""

    KIND = SpindleStart

    @property
    def found(self) -> list[float | None]:
        """See ``SpindleStart``."""
        return [each.found for each in self.each]


class SpindleTarget:
    """From when on the spindle has the speed that is asked for last, in a single run."""

    def __init__(self, run: JudgedRun) -> None:
        self._latest = run.samples - run.last
        self._begins, self._time, self._done = 0, math.nan, 0
        self._first, self._command = math.nan, math.nan

    def take(self, samples: Trajectory, late: int) -> None:
        """The next samples."""
        time, command = samples["time"], samples["command"]
        if self._done == 0:
            self._first = self._command = float(command[0])
        if self._begins == self._done:
            self._time = float(time[0])
        near = NEAR * np.maximum(np.abs(command), abs(self._first))
        off = np.flatnonzero(np.abs(samples["speed"] - command) > near)
        changed = np.flatnonzero(np.diff(command, prepend=self._command))
        # It has its last speed from the sample on at which that is asked for first.
        at = max(int(off[-1]) + 1 if len(off) else -1, int(changed[-1]) if len(changed) else -1)
        if at >= 0:
            self._begins = self._done + at
            self._time = float(time[at]) if at < len(samples) else math.nan
        self._command = float(command[-1])
        self._done += len(samples)

    @property
    def found(self) -> float | None:
        """s; None if that is not before the last stretch, of which final values are."""
        return self._time if self._begins <= self._latest else None


class SpindleTargetWatch(EachRun[SpindleTarget]):
    """From when on the spindle has the speed that is asked for last."""

    KIND = SpindleTarget

    @property
    def found(self) -> list[float | None]:
        """See ``SpindleTarget``."""
        return [each.found for each in self.each]


class TorqueWatch:
    """The largest torque of the motor."""

    def __init__(self, runs: JudgedRuns) -> None:
        self._most, self._motor = np.zeros(len(runs)), False

    def take(self, piece: Piece) -> None:
        """The next samples."""
        if "motor_torque" in piece.channels:
            self._motor = True
            self._most = np.maximum(self._most, np.abs(piece["motor_torque"]).max(axis=1))

    @property
    def found(self) -> list[float | None]:
        """N m, its magnitude; None without a motor."""
        return [most if self._motor else None for most in self._most.tolist()]


class SlipWatch:
    """How far the balls have turned on the race from the start to the last sample."""

    def __init__(self, runs: JudgedRuns) -> None:
        self._first: np.ndarray | None = None
        self._at_start = runs.numbers.start_angles
        self.turns = np.empty((len(runs), 0))
        """Of each ball, their magnitude, shape (runs, balls)."""

    def take(self, piece: Piece) -> None:
        """The next samples."""
        angles = piece.ball_angles
        if self._first is None:
            follows = np.array([[_follows_the_start(time)] for time in piece["time"]])
            self._first = np.where(follows, self._at_start, angles[:, 0])
        # C-contiguous: so a run's sum is taken in the same order whatever is beside it.
        slipped = np.ascontiguousarray(angles[:, -1] - self._first)
        self.turns = np.abs(slipped) / (2.0 * math.pi)

    @property
    def most(self) -> list[float | None]:
        """Of the ball that has turned most; None without balls."""
        return [max(turns) if turns else None for turns in self.turns.tolist()]

    @property
    def total(self) -> list[float | None]:
        """Of all balls together; None without balls."""
        return [float(turns.sum()) if len(turns) else None for turns in self.turns]
