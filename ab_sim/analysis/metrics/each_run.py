"""Watches of single runs, created for each of several runs."""

from typing import Any, ClassVar, Generic, NamedTuple, Protocol, TypeVar

from ab_sim.analysis.metrics.judging import JudgedRuns, Piece
from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene.model import Scene


class JudgedRun(NamedTuple):
    """Data of one of several runs, available before its samples."""

    runs: JudgedRuns
    number: int
    """Index of the run."""

    @property
    def scene(self) -> Scene:
        """Scene of the run; it may be created on access."""
        return self.runs.scenes[self.number]

    @property
    def start_speed(self) -> float:
        """Spindle speed at the start [rad/s]; reading it does not create the scene."""
        return float(self.runs.numbers.start_speed[self.number])

    @property
    def samples(self) -> int:
        """Number of samples."""
        return self.runs.samples

    @property
    def last(self) -> int:
        """Number of samples in the last stretch."""
        return self.runs.last


class SingleWatch(Protocol):
    """Accumulator of a metric of a single run."""

    def __init__(self, run: JudgedRun) -> None:
        """Prepare for a run."""

    def take(self, samples: Trajectory, late: int) -> None:
        """Process the next samples; the final ``late`` of them are in the last stretch."""


Single = TypeVar("Single", bound=SingleWatch)


class EachRun(Generic[Single]):
    """Watch of several runs, with one instance of ``KIND`` per run."""

    KIND: ClassVar[type[Any]]

    def __init__(self, runs: JudgedRuns) -> None:
        self.each: list[Single] = [self.KIND(JudgedRun(runs, k)) for k in range(len(runs))]
        """Instances in the order of the runs."""

    def take(self, piece: Piece) -> None:
        """Process the next samples."""
        for watch, samples in zip(self.each, piece.trajectories, strict=True):
            watch.take(samples, piece.late)
