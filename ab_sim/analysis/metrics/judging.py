"""Evaluation of runs block by block, in several passes; runs need not fit into memory.

An accumulator is a class that accumulates a metric of several runs, which are the first axis of its
arrays. A single run is a batch of one and gives the same bits. An accumulator is created with the
``JudgedRuns``, receives their blocks through ``take``, and then holds its result. If ``AFTER``
names other accumulators, it starts once these have seen all samples and is created with them as
further arguments. An accumulator without ``take`` uses only these results and needs no further
pass.
"""

import functools
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ab_sim.analysis.rest import Rest, rest_of
from ab_sim.base.presentation import last_stretch
from ab_sim.drive.trajectory import Trajectory, balls_in, column_of, whirl_of
from ab_sim.model.equations.neighbours import start_angles
from ab_sim.scene.model import Scene
from ab_sim.scene.sections import Balanced

_BLOCK = 2**14
"""Size of a block in numbers (128 kB).

Larger intermediate results of numpy do not fit into the cache, and the system has to clear their
pages each time.
"""

SampleBlocks = Callable[[], Iterable[Trajectory]]
"""Function that starts at the beginning of the run on each call.

It yields successive trajectories, none of them empty.
"""


class RunNumbers(NamedTuple):
    """Scene values used by metrics; the first axis is the run."""

    eccentricity: np.ndarray
    """Eccentricity e [m], shape (runs,)."""
    disc_alone: np.ndarray
    """Whirl M0 e / M far above the critical speed, without balls [m], shape (runs,)."""
    unbalance: np.ndarray
    """Unbalance M0 e [kg m], shape (runs,)."""
    couple: np.ndarray
    """Couple ``Scene.couple_unbalance`` [kg m^2], complex, shape (runs,)."""
    moments: np.ndarray
    """Ball moments m_i R [kg m], shape (runs, balls)."""
    heights: np.ndarray
    """Height of each ball's race along the shaft [m], shape (runs, balls)."""
    turning: np.ndarray
    """Rotating mass: M0 and all balls [kg], shape (runs,)."""
    start_speed: np.ndarray
    """Spindle speed at the start [rad/s], shape (runs,)."""
    start_angles: np.ndarray
    """Ball angles at the start [rad], shape (runs, balls)."""
    most_unbalance: np.ndarray
    """Limit of the residual unbalance of a balanced rotor (``Scene.balanced``), shape (runs,)."""
    most_couple: np.ndarray
    """Limit of the residual couple; NaN if the couple does not count."""

    @classmethod
    def of(cls, scenes: Sequence[Scene]) -> "RunNumbers":
        """Collect the values of scenes with equal numbers of balls."""
        rows = [_numbers_of(scene) for scene in scenes]
        return cls(*(np.array(column) for column in zip(*rows, strict=True)))


def _numbers_of(scene: Scene) -> tuple[Any, ...]:
    """Return the fields of ``RunNumbers`` for one scene."""
    e = scene.rotor.eccentricity
    unbalance = scene.eccentric_mass * e
    moments = [mass * scene.race.radius for mass in scene.balls.masses]
    heights = [scene.race.heights[race] for race in scene.balls.races]
    couple, turning = complex(scene.couple_unbalance), scene.eccentric_mass + scene.balls.total_mass
    of_disc = e, unbalance / scene.total_mass, unbalance, couple
    start = scene.start.speed, start_angles(scene)
    return *of_disc, moments, heights, turning, *start, *limits_of(scene)


def limits_of(scene: Scene) -> tuple[float, float]:
    """Return the limits of residual unbalance and couple; NaN for a couple that does not count."""
    limits = scene.balanced or Balanced()
    couple = limits.residual_couple
    return limits.residual_unbalance, math.nan if couple is None else couple


class JudgedRuns:
    """Data of runs that metrics need besides samples, known before the runs start.

    Parameters
    ----------
    scenes
        Scenes of the runs; their samples have the same channels. A lazy sequence may create them on
        access.
    samples
        Number of samples of each run.
    numbers
        Values of the scenes, if known; by default they are read from the scenes.
    """

    def __init__(
        self, scenes: Sequence[Scene], samples: int, numbers: RunNumbers | None = None
    ) -> None:
        self.scenes, self.samples = scenes, samples
        self.last = last_stretch(samples)
        """Number of samples in the last stretch."""
        self._given = numbers

    def __len__(self) -> int:
        return len(self.scenes)

    @cached_property
    def numbers(self) -> RunNumbers:
        """Values of the scenes."""
        return RunNumbers.of(self.scenes) if self._given is None else self._given

    @cached_property
    def rests(self) -> list[Rest]:
        """Rest pose of each deck."""
        return [rest_of(scene) for scene in self.scenes]

    def counted_from_rest(self, channels: tuple[str, ...], samples: np.ndarray) -> np.ndarray:
        """Return samples with displacements from the decks' rest positions; copied if changed."""
        if "z" not in channels or not any(rest.place.any() for rest in self.rests):
            return samples  # planar displacements start from rest already
        runs = zip(self.rests, samples, strict=True)
        return np.array(
            [rest.counted_from(Trajectory(channels, run)).samples for rest, run in runs]
        )


class SampleBlock:
    """Successive samples of some runs, with displacements relative to the deck's rest position.

    Parameters
    ----------
    channels
        Channels of the samples.
    samples
        Shape (runs, samples, channels).
    late
        Number of samples, at the end of the block, that lie in the last tenth of the run; may be 0.
    before
        The preceding samples, two if available; None at the start of the runs.
    """

    def __init__(
        self,
        channels: tuple[str, ...],
        samples: np.ndarray,
        late: int,
        before: np.ndarray | None = None,
    ) -> None:
        self.channels, self.samples, self.late, self._before = channels, samples, late, before

    def __len__(self) -> int:
        return self.samples.shape[1]

    def __getitem__(self, channel: str) -> np.ndarray:
        """Return one channel, shape (runs, samples)."""
        return self.samples[:, :, column_of(channel, self.channels)]

    @cached_property
    def whirl(self) -> np.ndarray:
        """Whirl W = |u| [m], shape (runs, samples)."""
        x, y = self["x"], self["y"]
        whirl = np.empty(x.shape)
        for rows in self.row_blocks():
            whirl[rows] = whirl_of(x[rows], y[rows])
        return whirl

    def row_blocks(self) -> Iterator[slice]:
        """Yield slices of runs whose samples together fit into a cache of the processor."""
        most = max(1, _BLOCK // max(1, len(self)))
        for first in range(0, len(self.samples), most):
            yield slice(first, first + most)

    @property
    def late_whirl(self) -> np.ndarray:
        """Whirl W in the last stretch of each run [m], shape (runs, samples)."""
        return self.whirl[:, len(self) - self.late :]

    @property
    def late_ball_angles(self) -> np.ndarray:
        """Ball angles theta_i of the last stretch [rad], shape (runs, samples, balls)."""
        return self.ball_angles[:, len(self) - self.late :]

    @property
    def ball_angles(self) -> np.ndarray:
        """Ball angles theta_i [rad], shape (runs, samples, balls)."""
        balls = balls_in(self.channels)
        first = column_of("ball_0_angle", self.channels) if balls else 0
        return self.samples[:, :, first : first + 2 * balls : 2]

    @cached_property
    def joined(self) -> "SampleBlock":
        """Return the block with the two samples before it, to cover the gap between blocks."""
        if self._before is None:
            return self
        samples = np.concatenate([self._before, self.samples], axis=1)
        return SampleBlock(self.channels, samples, self.late)

    @cached_property
    def trajectories(self) -> list[Trajectory]:
        """Trajectory of each run.

        The channels of a sample are contiguous in memory, so that results do not depend on the
        other runs.
        """
        runs = map(np.ascontiguousarray, self.samples)
        return [Trajectory(self.channels, samples) for samples in runs]

    @property
    def late_trajectories(self) -> list[Trajectory]:
        """Trajectory of each run in the last stretch."""
        return [trajectory.last(self.late) for trajectory in self.trajectories]


def accumulate(
    blocks: Callable[[], Iterable[SampleBlock]], runs: JudgedRuns, kinds: Iterable[type[Any]]
) -> dict[type[Any], Any]:
    """Return accumulators of some kinds, and the accumulators that they need, after all passes.

    Parameters
    ----------
    blocks
        Function that starts at the beginning of the runs on each call.
    runs
        Data of the runs.
    kinds
        Classes of accumulators.

    Returns
    -------
    dict[type[Any], Any]
        Accumulators by class.
    """
    done: dict[type[Any], Any] = {}
    for group in _passes(tuple(kinds)):
        accumulators = {
            kind: kind(runs, *(done[needed] for needed in _after(kind))) for kind in group
        }
        fed = [accumulator for kind, accumulator in accumulators.items() if _takes_samples(kind)]
        for block in blocks() if fed else ():
            for accumulator in fed:
                accumulator.take(block)
        done |= accumulators
    return done


def passes(kinds: Iterable[type[Any]]) -> int:
    """Return the number of passes of ``accumulate`` through the samples."""
    return sum(any(map(_takes_samples, group)) for group in _passes(tuple(kinds)))


def in_blocks(blocks: SampleBlocks, runs: JudgedRuns) -> Iterator[SampleBlock]:
    """Yield the samples of a single run as blocks, each with the two samples before it.

    A peak between samples that lies at the seam of two blocks needs both.
    """
    done, before = 0, None
    for trajectory in blocks():
        samples = runs.counted_from_rest(trajectory.channels, trajectory.samples[None])
        done += len(trajectory)
        late = min(max(done - (runs.samples - runs.last), 0), len(trajectory))
        block = SampleBlock(trajectory.channels, samples, late, before)
        yield block
        before = (block if len(block) > 1 else block.joined).samples[:, -2:]


def as_one_block(
    channels: tuple[str, ...],
    samples: np.ndarray,
    runs: JudgedRuns,
    whirl: np.ndarray | None = None,
) -> SampleBlock:
    """Return all samples of all runs as one block; for planar decks the whirl may be given."""
    block = SampleBlock(channels, runs.counted_from_rest(channels, samples), runs.last)
    if whirl is not None:
        block.whirl = whirl
    return block


@functools.lru_cache(maxsize=64)
def _passes(kinds: tuple[type[Any], ...]) -> list[list[type[Any]]]:
    """Return groups of accumulators that share a pass over the samples; later ones need earlier."""
    waiting = list(dict.fromkeys(_with_earlier(kinds)))
    groups: list[list[type[Any]]] = []
    while waiting:
        groups.append([kind for kind in waiting if not set(_after(kind)) & set(waiting)])
        waiting = [kind for kind in waiting if kind not in groups[-1]]
    return groups


def _with_earlier(kinds: Iterable[type[Any]]) -> Iterator[type[Any]]:
    """Yield each kind after the kinds on which it depends; a kind may occur several times."""
    for kind in kinds:
        yield from _with_earlier(_after(kind))
        yield kind


def _takes_samples(kind: type[Any]) -> bool:
    """Return whether accumulators of a kind need the samples, not only other accumulators."""
    return hasattr(kind, "take")


def _after(kind: type[Any]) -> tuple[type[Any], ...]:
    """Return the kinds of accumulators on which a kind depends."""
    return getattr(kind, "AFTER", ())


class EachRun:
    """Accumulator of several runs, with one instance of ``KIND`` per run.

    An instance is created with the runs and the index of its run. Its ``take(samples, late)``
    receives successive trajectories, of which the final ``late`` samples lie in the last stretch.
    """

    KIND: ClassVar[type[Any]]

    def __init__(self, runs: JudgedRuns) -> None:
        self._single = [self.KIND(runs, number) for number in range(len(runs))]

    def take(self, block: SampleBlock) -> None:
        """Process the next samples."""
        for accumulator, samples in zip(self._single, block.trajectories, strict=True):
            accumulator.take(samples, block.late)

    def each(self, name: str) -> list[Any]:
        """Return the attribute ``name`` of each run's instance."""
        return [getattr(accumulator, name) for accumulator in self._single]
