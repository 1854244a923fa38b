"""Watches that look at a single run, made for each of several."""

from typing import Any, ClassVar, Generic, NamedTuple, Protocol, TypeVar

from ab_sim.analysis.merits.judging import JudgedRuns, Piece
from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene.model import Scene


class JudgedRun(NamedTuple):
    """What is known of one of several runs before it is looked at."""

    runs: JudgedRuns
    number: int
    """Which of them it is."""

    @property
    def scene(self) -> Scene:
        """What was run; it may be made only now."""
        return self.runs.scenes[self.number]

    @property
    def start_speed(self) -> float:
        """Of the spindle [rad/s]; it takes no scene."""
        return float(self.runs.numbers.start_speed[self.number])

    @property
    def samples(self) -> int:
        """How many there are."""
        return self.runs.samples

    @property
    def last(self) -> int:
        """How many samples the last stretch has."""
        return self.runs.last


class SingleWatch(Protocol):
    """Finds something in a single run."""

    def __init__(self, run: JudgedRun) -> None:
        """For a run."""

    def take(self, samples: Trajectory, late: int) -> None:
        """The next samples, at least one; how many of them, at the end, are in the last stretch."""


Single = TypeVar("Single", bound=SingleWatch)


class EachRun(Generic[Single]):
    """A watch of several runs, with one of its ``KIND`` for each."""

    KIND: ClassVar[type[Any]]

    def __init__(self, runs: JudgedRuns) -> None:
        self.each: list[Single] = [self.KIND(JudgedRun(runs, k)) for k in range(len(runs))]
        """In the order of the runs."""

    def take(self, piece: Piece) -> None:
        """The next samples."""
        for watch, samples in zip(self.each, piece.trajectories, strict=True):
            watch.take(samples, piece.late)
