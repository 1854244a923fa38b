"""A run looked at piece by piece, as often as it takes: it need not fit into memory.

A watch is a class that finds something in a run. It is made with the ``JudgedRun``, is shown its
pieces by ``take``, one after the other, and then has what it has found. Where ``AFTER`` names other
watches, it begins when these are through the whole run, and is made with them as well. One without
``take`` concludes from these alone, and asks for no further pass.
"""

from collections.abc import Callable, Iterable, Iterator
from functools import cached_property
from typing import Any, NamedTuple

from ab_sim.analysis.rest import Rest, rest_of
from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene.model import Scene

LAST = 0.1
"""Final values are those over this share of the run, at its end."""

Pieces = Callable[[], Iterable[Trajectory]]
"""Begins at the run's start each time it is called; trajectories that follow each other, none of
them empty."""


class JudgedRun(NamedTuple):
    """What is known of a run before it is looked at."""

    scene: Scene
    rest: Rest
    """Where the deck hangs."""
    samples: int
    last: int
    """How many samples the last stretch has."""

    @classmethod
    def of(cls, scene: Scene, samples: int) -> "JudgedRun":
        """A run of a scene, of so many samples."""
        return cls(scene, rest_of(scene), samples, max(1, round(LAST * samples)))

    @property
    def disc_alone(self) -> float:
        """M0 e / M [m]: the disc's own whirl far above the critical speed, without balls."""
        return self.scene.eccentric_mass * self.scene.rotor.eccentricity / self.scene.total_mass


class Piece:
    """Samples that follow each other, with displacements from where the deck hangs.

    Args:
        trajectory: the samples.
        before: the last ones before these, two if there are so many; None at the run's start.
        late: those of them that are in the last stretch; may be empty.
    """

    def __init__(self, trajectory: Trajectory, before: Trajectory | None, late: Trajectory) -> None:
        self.trajectory, self.late, self._before = trajectory, late, before

    @cached_property
    def joined(self) -> Trajectory:
        """With two samples before, so that what lies between pieces is seen."""
        if self._before is None:
            return self.trajectory
        return Trajectory.join([self._before, self.trajectory])


def watch_run(pieces: Pieces, run: JudgedRun, kinds: Iterable[type[Any]]) -> dict[type[Any], Any]:
    """Watches of these kinds, and of those they come after, when the run has passed them."""
    done: dict[type[Any], Any] = {}
    for together in _passes(kinds):
        watches = {kind: kind(run, *(done[each] for each in _after(kind))) for kind in together}
        looking = [watch for kind, watch in watches.items() if _looks(kind)]
        for piece in _in_pieces(pieces, run) if looking else ():
            for watch in looking:
                watch.take(piece)
        done |= watches
    return done


def passes(kinds: Iterable[type[Any]]) -> int:
    """How often ``watch_run`` goes through a run."""
    return sum(any(map(_looks, together)) for together in _passes(kinds))


def _in_pieces(pieces: Pieces, run: JudgedRun) -> Iterator[Piece]:
    done, before = 0, None
    for trajectory in map(run.rest.counted_from, pieces()):
        done += len(trajectory)
        late = trajectory.last(done - (run.samples - run.last))
        piece = Piece(trajectory, before, late)
        yield piece
        before = (trajectory if len(trajectory) > 1 else piece.joined).last(2)


def _passes(kinds: Iterable[type[Any]]) -> list[list[type[Any]]]:
    """Watches that can look at the run together, group after group."""
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
