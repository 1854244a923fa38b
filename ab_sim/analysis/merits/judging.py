"""Runs looked at piece by piece, as often as it takes: they need not fit into memory.

A watch is a class that finds something in each of several runs, which lie side by side in arrays
whose first axis is theirs; a single run is a batch of one, so that it has the same bits. A watch is
made with the ``JudgedRuns``, is shown their pieces by ``take``, one after the other, and then has
what it has found. Where ``AFTER`` names other watches, it begins when these are through all
samples, and is made with them as well. One without ``take`` concludes from these alone, and asks
for no further pass.
"""

import functools
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.rest import Rest, rest_of
from ab_sim.drive.trajectory import Trajectory, balls_in, column_of, whirl_of
from ab_sim.equations.neighbours import start_angles
from ab_sim.scene.model import Scene
from ab_sim.scene.sections import Balanced

LAST = 0.1
"""Final values are those over this share of the run, at its end."""

_NEAR = 2**14
"""Numbers, 128 kB: of more, numpy's intermediate results go to memory and back, and are in pages
that the system has to clear first, each time."""

Pieces = Callable[[], Iterable[Trajectory]]
"""Begins at the run's start each time it is called; trajectories that follow each other, none of
them empty."""


class RunNumbers(NamedTuple):
    """What merits take from the scenes, an entry for each run along the first axis."""

    eccentricity: np.ndarray
    """e [m], shape (runs,)."""
    disc_alone: np.ndarray
    """M0 e / M [m]: the disc's own whirl far above the critical speed, without balls; the same."""
    unbalance: np.ndarray
    """M0 e [kg m], the same."""
    couple: np.ndarray
    """``Scene.couple_unbalance`` [kg m^2], complex, the same."""
    moments: np.ndarray
    """m_i R [kg m], shape (runs, balls)."""
    heights: np.ndarray
    """Of the race of each ball along the shaft [m], the same."""
    turning: np.ndarray
    """M0 and all balls [kg], shape (runs,)."""
    start_speed: np.ndarray
    """Of the spindle [rad/s], the same."""
    start_angles: np.ndarray
    """Where the balls start [rad], shape (runs, balls)."""
    most_unbalance: np.ndarray
    """``Scene.balanced``: of what share of it a rotor may be left, shape (runs,)."""
    most_couple: np.ndarray
    """The same of the couple; NaN where that does not count."""

    @classmethod
    def of(cls, scenes: Sequence[Scene]) -> "RunNumbers":
        """Of scenes with as many balls each."""
        rows = [_numbers_of(scene) for scene in scenes]
        return cls(*(np.array(column) for column in zip(*rows, strict=True)))


def _numbers_of(scene: Scene) -> tuple[Any, ...]:
    e = scene.rotor.eccentricity
    unbalance = scene.eccentric_mass * e
    moments = [mass * scene.race.radius for mass in scene.balls.masses]
    heights = [scene.race.heights[race] for race in scene.balls.races]
    couple, turning = complex(scene.couple_unbalance), scene.eccentric_mass + scene.balls.total_mass
    of_disc = e, unbalance / scene.total_mass, unbalance, couple
    start = scene.start.speed, start_angles(scene)
    return *of_disc, moments, heights, turning, *start, *limits_of(scene)


def limits_of(scene: Scene) -> tuple[float, float]:
    """Shares of unbalance and couple that may be left; NaN of a couple that does not count."""
    limits = scene.balanced or Balanced()
    couple = limits.residual_couple
    return limits.residual_unbalance, math.nan if couple is None else couple


class JudgedRuns:
    """What is known of runs before they are looked at.

    Args:
        scenes: what was run; their samples have the same channels. Some of them may be made only
            when they are asked for.
        samples: of each run.
        numbers: where they are known; else they are those of the scenes.
    """

    def __init__(
        self, scenes: Sequence[Scene], samples: int, numbers: RunNumbers | None = None
    ) -> None:
        self.scenes, self.samples = scenes, samples
        self.last = max(1, round(LAST * samples))
        """How many samples the last stretch has."""
        self._given = numbers

    def __len__(self) -> int:
        return len(self.scenes)

    @cached_property
    def numbers(self) -> RunNumbers:
        """Of their scenes."""
        return RunNumbers.of(self.scenes) if self._given is None else self._given

    @cached_property
    def rests(self) -> list[Rest]:
        """Where each deck hangs."""
        return [rest_of(scene) for scene in self.scenes]

    def counted_from_rest(self, channels: tuple[str, ...], samples: np.ndarray) -> np.ndarray:
        """Samples of all runs with displacements from where their decks hang; a copy if need be."""
        if "z" not in channels or not any(rest.place.any() for rest in self.rests):
            return samples  # in the plane they count from there
        runs = zip(self.rests, samples, strict=True)
        return np.array(
            [rest.counted_from(Trajectory(channels, run)).samples for rest, run in runs]
        )


class Piece:
    """Samples that follow each other of some runs, displacements from where the deck hangs.

    Args:
        channels: of the samples.
        samples: shape (runs, samples, channels).
        late: how many of them, at the end, are in the last stretch; may be 0.
        before: the last ones before these, two if there are so many; None at the runs' start.
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
        """One channel, shape (runs, samples)."""
        return self.samples[:, :, column_of(channel, self.channels)]

    @cached_property
    def whirl(self) -> np.ndarray:
        """W = |u| [m], shape (runs, samples)."""
        x, y = self["x"], self["y"]
        found = np.empty(x.shape)
        for rows in self.blocks():
            found[rows] = whirl_of(x[rows], y[rows])
        return found

    def blocks(self) -> Iterator[slice]:
        """Runs of which so many numbers each stay in the processor's nearest caches."""
        most = max(1, _NEAR // max(1, len(self)))
        for first in range(0, len(self.samples), most):
            yield slice(first, first + most)

    @property
    def late_whirl(self) -> np.ndarray:
        """Of the last stretch."""
        return self.whirl[:, len(self) - self.late :]

    @property
    def late_ball_angles(self) -> np.ndarray:
        """theta_i of the last stretch [rad], shape (runs, samples, balls)."""
        return self.ball_angles[:, len(self) - self.late :]

    @property
    def ball_angles(self) -> np.ndarray:
        """theta_i [rad], shape (runs, samples, balls)."""
        balls = balls_in(self.channels)
        first = column_of("ball_0_angle", self.channels) if balls else 0
        return self.samples[:, :, first : first + 2 * balls : 2]

    @cached_property
    def joined(self) -> "Piece":
        """With two samples before, so that what lies between pieces is seen."""
        if self._before is None:
            return self
        samples = np.concatenate([self._before, self.samples], axis=1)
        return Piece(self.channels, samples, self.late)

    @cached_property
    def trajectories(self) -> list[Trajectory]:
        """Of each run; a sample's numbers follow each other, whatever runs are beside it."""
        each = map(np.ascontiguousarray, self.samples)
        return [Trajectory(self.channels, samples) for samples in each]

    @property
    def late_trajectories(self) -> list[Trajectory]:
        """Of each run, what is in the last stretch."""
        return [each.last(self.late) for each in self.trajectories]


def watch_runs(
    pieces: Callable[[], Iterable[Piece]], runs: JudgedRuns, kinds: Iterable[type[Any]]
) -> dict[type[Any], Any]:
    """Watches of these kinds, and of those they come after, when the runs have passed them."""
    done: dict[type[Any], Any] = {}
    for together in _passes(tuple(kinds)):
        watches = {kind: kind(runs, *(done[each] for each in _after(kind))) for kind in together}
        looking = [watch for kind, watch in watches.items() if _looks(kind)]
        for piece in pieces() if looking else ():
            for watch in looking:
                watch.take(piece)
        done |= watches
    return done


def passes(kinds: Iterable[type[Any]]) -> int:
    """How often ``watch_runs`` goes through the samples."""
    return sum(any(map(_looks, together)) for together in _passes(tuple(kinds)))


def in_pieces(pieces: Pieces, runs: JudgedRuns) -> Iterator[Piece]:
    """A single run, piece by piece."""
    done, before = 0, None
    for trajectory in pieces():
        samples = runs.counted_from_rest(trajectory.channels, trajectory.samples[None])
        done += len(trajectory)
        late = min(max(done - (runs.samples - runs.last), 0), len(trajectory))
        piece = Piece(trajectory.channels, samples, late, before)
        yield piece
        before = (piece if len(piece) > 1 else piece.joined).samples[:, -2:]


def as_one_piece(
    channels: tuple[str, ...],
    samples: np.ndarray,
    runs: JudgedRuns,
    whirl: np.ndarray | None = None,
) -> Piece:
    """All samples of all runs at once; of decks in the plane their whirl may be known."""
    piece = Piece(channels, runs.counted_from_rest(channels, samples), runs.last)
    if whirl is not None:
        piece.whirl = whirl
    return piece


@functools.lru_cache(maxsize=64)
def _passes(kinds: tuple[type[Any], ...]) -> list[list[type[Any]]]:
    """Watches that can look at the runs together, group after group."""
    waiting = list(dict.fromkeys(_with_earlier(kinds)))
    groups: list[list[type[Any]]] = []
    while waiting:
        groups.append([kind for kind in waiting if not set(_after(kind)) & set(waiting)])
        waiting = [kind for kind in waiting if kind not in groups[-1]]
    return groups


def _with_earlier(kinds: Iterable[type[Any]]) -> Iterator[type[Any]]:
    for kind in kinds:
        yield from _with_earlier(_after(kind))
        yield kind


def _looks(kind: type[Any]) -> bool:
    return hasattr(kind, "take")


def _after(kind: type[Any]) -> tuple[type[Any], ...]:
    return getattr(kind, "AFTER", ())
