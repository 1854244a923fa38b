"""From runs to their merits."""

from collections.abc import Callable, Iterable

import numpy as np

from ab_sim.analysis.merits.declared import Merits
from ab_sim.analysis.merits.judging import (
    JudgedRuns,
    Piece,
    Pieces,
    as_one_piece,
    in_pieces,
    passes,
    watch_runs,
)
from ab_sim.analysis.merits.merit import merits_named
from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene.model import Scene


def merits_of(trajectory: Trajectory, scene: Scene, keys: Iterable[str] | None = None) -> Merits:
    """Judge a run.

    Args:
        trajectory: consecutive samples, from the start of the run to its end.
        scene: what was run.
        keys: of the merits wanted; None: all. What only others need is not computed.

    Raises:
        InputError: there is no merit of such a key; names the nearest.
    """
    runs = JudgedRuns([scene], len(trajectory))
    found = merits_of_runs(runs, trajectory.channels, trajectory.samples[None], keys)
    return _of_the_first(found, scene)


def merits_of_pieces(
    pieces: Pieces, count: int, scene: Scene, keys: Iterable[str] | None = None
) -> Merits:
    """Judge a run that is too long to be held in memory, in as many passes as ``passes_of`` says.

    Args:
        pieces: begins at the run's start each time it is called; trajectories that follow each
            other, none of them empty.
        count: how many samples there are, at least 1.
        scene: what was run.
        keys: see ``merits_of``.

    Raises:
        InputError: see ``merits_of``.
    """
    runs = JudgedRuns([scene], count)
    return _of_the_first(_found(lambda: in_pieces(pieces, runs), runs, keys), scene)


def merits_of_runs(
    runs: JudgedRuns,
    channels: tuple[str, ...],
    samples: np.ndarray,
    keys: Iterable[str] | None = None,
    whirl: np.ndarray | None = None,
) -> dict[str, list[object]]:
    """Judge runs side by side; each has the same merits as by itself.

    Args:
        runs: what was run.
        channels: of the samples.
        samples: from the start of each run to its end, shape (runs, samples, channels).
        keys: see ``merits_of``.
        whirl: of decks in the plane W [m] at all samples, where it is known already: as
            ``whirl_of`` has it, shape (runs, samples).

    Returns:
        By key the merit of each run, whirls in m.

    Raises:
        InputError: see ``merits_of``.
    """
    piece = as_one_piece(channels, samples, runs, whirl)
    return _found(lambda: [piece], runs, keys)


def passes_of(keys: Iterable[str] | None = None) -> int:
    """How often ``merits_of_pieces`` goes through a run."""
    return passes(merit.watch for merit in merits_named(keys))


def _found(
    pieces: Callable[[], Iterable[Piece]], runs: JudgedRuns, keys: Iterable[str] | None
) -> dict[str, list[object]]:
    wanted = merits_named(keys)
    watches = watch_runs(pieces, runs, [merit.watch for merit in wanted])
    return {merit.key: merit.values(watches[merit.watch]) for merit in wanted}


def _of_the_first(found: dict[str, list[object]], scene: Scene) -> Merits:
    values = {key: each[0] for key, each in found.items()}
    return Merits(values, scene.rotor.eccentricity)
