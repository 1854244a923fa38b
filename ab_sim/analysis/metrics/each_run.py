"""Accumulators of single runs, created for each of several runs."""

from typing import Any, ClassVar, Generic, NamedTuple, Protocol, TypeVar

from ab_sim.analysis.metrics.judging import JudgedRuns, SampleBlock
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


class SingleAccumulator(Protocol):
    """Accumulator of a metric of a single run."""

    def __init__(self, run: JudgedRun) -> None:
        """Prepare for a run."""

    def take(self, samples: Trajectory, late: int) -> None:
        """Process the next samples, of which the final ``late`` lie in the last stretch."""


Single = TypeVar("Single", bound=SingleAccumulator)


class EachRun(Generic[Single]):
    """Accumulator of several runs, with one instance of ``KIND`` per run."""

    KIND: ClassVar[type[Any]]

    def __init__(self, runs: JudgedRuns) -> None:
        self.each: list[Single] = [self.KIND(JudgedRun(runs, k)) for k in range(len(runs))]
        """Instances in the order of the runs."""

    def take(self, block: SampleBlock) -> None:
        """Process the next samples."""
        for accumulator, samples in zip(self.each, block.trajectories, strict=True):
            accumulator.take(samples, block.late)
