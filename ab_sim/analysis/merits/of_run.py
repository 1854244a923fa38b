"""From a run to its merits."""

from collections.abc import Iterable

from ab_sim.analysis.merits.declared import Merits
from ab_sim.analysis.merits.judging import JudgedRun, Pieces, passes, watch_run
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
    return merits_of_pieces(lambda: iter([trajectory]), len(trajectory), scene, keys)


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
    wanted = merits_named(keys)
    watches = watch_run(pieces, JudgedRun.of(scene, count), [merit.watch for merit in wanted])
    values = {merit.key: merit.find(watches[merit.watch]) for merit in wanted}
    return Merits(values, scene.rotor.eccentricity)


def passes_of(keys: Iterable[str] | None = None) -> int:
    """How often ``merits_of_pieces`` goes through a run."""
    return passes(merit.watch for merit in merits_named(keys))
