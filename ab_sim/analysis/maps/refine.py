"""A grid of labels of which only the surroundings of borders are computed.

It begins with every ``coarse``-th point of both axes, and their last ones. Then the spacing is
halved until it is 1. New points have the label of a neighbour; of those and all others, each that
has another label beside it (in any of eight directions, at the spacing reached) is computed, and
again, until none is left. So at the end any two points beside each other that are labelled
differently have both been computed.

What can go wrong is therefore only this: a patch of which no point happened to be computed keeps
the label of what surrounds it. A patch that holds a square of ``coarse`` by ``coarse`` points is
always found, and then found whole; one within ``coarse - 1`` by ``coarse - 1`` points may be
missed, as may a longer but thinner one. With ``coarse`` = 1 nothing can: every point is computed.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

Point = tuple[int, int]

NOT_YET = np.iinfo(np.int64).min
"""A label that no verdict has."""


class Refined(NamedTuple):
    """Labels over a grid."""

    labels: np.ndarray
    """Of every point, shape (rows, columns), integers."""
    computed: np.ndarray
    """Which of them were computed and not concluded from their neighbours, same shape."""


def refined(
    verdicts: Callable[[Sequence[Point]], Sequence[int]], shape: Point, coarse: int = 8
) -> Refined:
    """Labels over a grid, computed where they change.

    Args:
        verdicts: called with points (row, column), gives their labels; never twice with the same.
        shape: rows, columns.
        coarse: spacing to begin with, a power of two.

    Raises:
        ValueError: ``coarse`` is no power of two.
    """
    if coarse < 1 or coarse & (coarse - 1):
        raise ValueError(f"coarse = {coarse!r}: must be a power of two: 1, 2, 4, 8, ...")
    found = Refined(np.full(shape, NOT_YET), np.zeros(shape, bool))
    before: list[np.ndarray] | None = None
    while coarse:
        lines = [_every(coarse, size) for size in shape]
        if before is None:
            _compute(verdicts, found, np.ix_(*lines))
        else:
            # Each line has the labels of the last one that was there already.
            last = [
                old[np.searchsorted(old, new, "right") - 1]
                for old, new in zip(before, lines, strict=True)
            ]
            known = found.computed[np.ix_(*lines)]
            labels = np.where(known, found.labels[np.ix_(*lines)], found.labels[np.ix_(*last)])
            found.labels[np.ix_(*lines)] = labels
            _follow_borders(verdicts, found, np.ix_(*lines))
        before, coarse = lines, coarse // 2
    return found


def _every(spacing: int, size: int) -> np.ndarray:
    """Of so many, from the first on; and the last."""
    return np.union1d(np.arange(0, size, spacing), [size - 1])


def _follow_borders(
    verdicts: Callable[[Sequence[Point]], Sequence[int]], found: Refined, at: tuple[np.ndarray, ...]
) -> None:
    while True:
        wanted = _beside_others(found.labels[at]) & ~found.computed[at]
        if not wanted.any():
            return
        rows, columns = (np.broadcast_to(lines, wanted.shape)[wanted] for lines in at)
        _compute(verdicts, found, (rows, columns))


def _compute(
    verdicts: Callable[[Sequence[Point]], Sequence[int]], found: Refined, at: tuple[np.ndarray, ...]
) -> None:
    rows, columns = (lines.ravel() for lines in np.broadcast_arrays(*at))
    points = [(int(i), int(j)) for i, j in zip(rows, columns, strict=True)]
    found.labels[rows, columns] = verdicts(points)
    found.computed[rows, columns] = True


def _beside_others(labels: np.ndarray) -> np.ndarray:
    """Which points have a neighbour with another label."""
    around = np.lib.stride_tricks.sliding_window_view(np.pad(labels, 1, mode="edge"), (3, 3))
    different: np.ndarray = (around != labels[:, :, None, None]).any(axis=(2, 3))
    return different
