"""Watches of the spindle: its start, its last speed, its motor's torque, balls that slip on it."""

import math

import numpy as np

from ab_sim.analysis.merits.judging import JudgedRun, Piece
from ab_sim.equations.neighbours import start_angles

NEAR = 0.01
"""A spindle has its speed while it is this near to it, as a share of the larger of the first and
the present speed that are asked for."""


def _follows_the_start(time: np.ndarray) -> bool:
    """Whether the sample before the first one would be that of the run's start, at t = 0.

    Some runs have it among their samples and some have not; merits are the same.
    """
    return len(time) > 1 and 0.0 < time[0] < 1.001 * (time[1] - time[0])


class SpindleStartWatch:
    """When the speed that is asked for begins to change."""

    def __init__(self, run: JudgedRun) -> None:
        self.found: float | None = None
        """s, of the last sample with the first command; None if it never changes."""
        self._first, self._before = math.nan, math.nan
        self._at_start = run.scene.start.speed

    def take(self, piece: Piece) -> None:
        """The next samples."""
        if self.found is not None:
            return
        time, command = piece.trajectory["time"], piece.trajectory["command"]
        if math.isnan(self._before) and _follows_the_start(time):
            self._first, self._before = self._at_start, 0.0
        elif math.isnan(self._before):
            self._first = float(command[0])
        other = np.flatnonzero(command != self._first)
        if len(other):
            self.found = float(time[other[0] - 1]) if other[0] else self._before
        self._before = float(time[-1])


class SpindleTargetWatch:
    """From when on the spindle has the speed that is asked for last."""

    def __init__(self, run: JudgedRun) -> None:
        self._latest = run.samples - run.last
        self._begins, self._time, self._done = 0, math.nan, 0
        self._first, self._command = math.nan, math.nan

    def take(self, piece: Piece) -> None:
        """The next samples."""
        samples = piece.trajectory
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


class TorqueWatch:
    """The largest torque of the motor."""

    def __init__(self, run: JudgedRun) -> None:
        self.found: float | None = None
        """N m, its magnitude; None without a motor."""

    def take(self, piece: Piece) -> None:
        """The next samples."""
        if "motor_torque" in piece.trajectory.channels:
            most = float(np.max(np.abs(piece.trajectory["motor_torque"])))
            self.found = most if self.found is None else max(self.found, most)


class SlipWatch:
    """How far the balls have turned on the race from the start to the last sample."""

    def __init__(self, run: JudgedRun) -> None:
        self._first: np.ndarray | None = None
        self._at_start = np.array(start_angles(run.scene))
        self.turns = np.empty(0)
        """Of each ball, their magnitude."""

    def take(self, piece: Piece) -> None:
        """The next samples."""
        angles = piece.trajectory.ball_angles
        if self._first is None:
            follows = _follows_the_start(piece.trajectory["time"])
            self._first = self._at_start if follows else angles[0].copy()
        self.turns = np.abs(angles[-1] - self._first) / (2.0 * math.pi)

    @property
    def most(self) -> float | None:
        """Of the ball that has turned most; None without balls."""
        return float(self.turns.max()) if len(self.turns) else None

    @property
    def total(self) -> float | None:
        """Of all balls together; None without balls."""
        return float(self.turns.sum()) if len(self.turns) else None
