"""Accumulators of the spindle: start, final speed, motor torque, and slip of balls."""

import math

import numpy as np

from ab_sim.analysis.metrics.judging import EachRun, JudgedRuns, SampleBlock
from ab_sim.drive.trajectory import Trajectory

NEAR = 0.01
"""Tolerance within which the spindle has its commanded speed, as a fraction of a command.

It refers to the larger of the first and the present command.
"""


def _follows_the_start(time: np.ndarray) -> bool:
    """Return whether the samples are complete except for the one at t = 0.

    Some runs have the start among their samples and some do not; their metrics must be equal.
    """
    return len(time) > 1 and 0.0 < time[0] < 1.001 * (time[1] - time[0])


class SpindleStart:
    """Time at which the commanded speed starts to change, in a single run."""

    def __init__(self, runs: JudgedRuns, number: int) -> None:
        self.begin: float | None = None
        """Time of the last sample with the first command [s]; None if it never changes."""
        self._first, self._before = math.nan, math.nan
        self._at_start = float(runs.numbers.start_speed[number])

    def take(self, samples: Trajectory, late: int) -> None:
        """Process the next samples."""
        if self.begin is not None:
            return
        time, command = samples["time"], samples["command"]
        if math.isnan(self._before) and _follows_the_start(time):
            self._first, self._before = self._at_start, 0.0
        elif math.isnan(self._before):
            self._first = float(command[0])
        other = np.flatnonzero(command != self._first)
        if len(other):
            self.begin = float(time[other[0] - 1]) if other[0] else self._before
        self._before = float(time[-1])


class SpindleStartAccumulator(EachRun):
    """Time at which the commanded speed starts to change."""

    KIND = SpindleStart


class SpindleTarget:
    """Time from which the spindle has its final commanded speed, in a single run."""

    def __init__(self, runs: JudgedRuns, number: int) -> None:
        self._latest = runs.samples - runs.last
        self._begins, self._time, self._done = 0, math.nan, 0
        self._first, self._command = math.nan, math.nan

    def take(self, samples: Trajectory, late: int) -> None:
        """Process the next samples."""
        time, command = samples["time"], samples["command"]
        if self._done == 0:
            self._first = self._command = float(command[0])
        if self._begins == self._done:
            self._time = float(time[0])
        near = NEAR * np.maximum(np.abs(command), abs(self._first))
        off = np.flatnonzero(np.abs(samples["speed"] - command) > near)
        changed = np.flatnonzero(np.diff(command, prepend=self._command))
        # The final speed counts from the sample at which it is first commanded.
        at = max(int(off[-1]) + 1 if len(off) else -1, int(changed[-1]) if len(changed) else -1)
        if at >= 0:
            self._begins = self._done + at
            self._time = float(time[at]) if at < len(samples) else math.nan
        self._command = float(command[-1])
        self._done += len(samples)

    @property
    def reached(self) -> float | None:
        """Time from which the spindle has the speed [s]; None if not before the last stretch."""
        return self._time if self._begins <= self._latest else None


class SpindleTargetAccumulator(EachRun):
    """Time from which the spindle has its final commanded speed."""

    KIND = SpindleTarget


class TorqueAccumulator:
    """Largest torque of the motor."""

    def __init__(self, runs: JudgedRuns) -> None:
        self._most, self._motor = np.zeros(len(runs)), False

    def take(self, block: SampleBlock) -> None:
        """Process the next samples."""
        if "motor_torque" in block.channels:
            self._motor = True
            self._most = np.maximum(self._most, np.abs(block["motor_torque"]).max(axis=1))

    @property
    def largest(self) -> list[float | None]:
        """Largest magnitude of each run's torque [N m]; None without a motor."""
        return [most if self._motor else None for most in self._most.tolist()]


class SlipAccumulator:
    """Slip of the balls on the race, from the start to the last sample."""

    def __init__(self, runs: JudgedRuns) -> None:
        self._first: np.ndarray | None = None
        self._at_start = runs.numbers.start_angles
        self.turns = np.empty((len(runs), 0))
        """Magnitude of each ball's slip in revolutions, shape (runs, balls)."""

    def take(self, block: SampleBlock) -> None:
        """Process the next samples."""
        angles = block.ball_angles
        if self._first is None:
            follows = np.array([[_follows_the_start(time)] for time in block["time"]])
            self._first = np.where(follows, self._at_start, angles[:, 0])
        # C-contiguous: the order of a run's sum, and thus every bit, is independent of the other
        # runs.
        slipped = np.ascontiguousarray(angles[:, -1] - self._first)
        self.turns = np.abs(slipped) / (2.0 * math.pi)

    @property
    def most(self) -> list[float | None]:
        """Slip of the ball that has turned most, for each run [revolutions]; None without balls."""
        return [max(turns) if turns else None for turns in self.turns.tolist()]

    @property
    def total(self) -> list[float | None]:
        """Sum of all balls' slip, for each run [revolutions]; None without balls."""
        return [float(turns.sum()) if len(turns) else None for turns in self.turns]
