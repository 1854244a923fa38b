"""Grid refinement: labels of a grid, with only the points near borders computed.

The first grid has every ``coarse``-th point of both axes, and their last ones. Then the spacing is
halved until it is 1. A new point takes the label of a neighbour. Every point that has a neighbour
with another label (in any of eight directions, at the present spacing) is then computed; this is
repeated until there is none. So at the end any two neighbours with different labels were computed.

The only possible error: an island of which no point was computed keeps the label of its
surroundings. An island that contains a square of ``coarse`` by ``coarse`` points is always found
completely. A smaller one, or a longer but thinner one, may be missed. With ``coarse`` = 1 every
point is computed.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ab_sim.base.errors import InputError

Point = tuple[int, int]
"""Row and column of a point of the grid."""

_NOT_YET = np.iinfo(np.int64).min
"""Label of points without a verdict."""


class Refined(NamedTuple):
    """Labels of a grid, and a mask of the points whose labels were computed, not copied."""

    labels: np.ndarray
    """Labels of all points, shape (rows, columns), integers."""
    computed: np.ndarray
    """Mask of computed points; the others have the label of a neighbour. Same shape."""


def check_coarse(coarse: int, setting: str) -> None:
    """Refuse an initial spacing that cannot be halved down to 1.

    Parameters
    ----------
    coarse
        Initial spacing of the points.
    setting
        Name and value for the message.

    Raises
    ------
    InputError
        ``coarse`` is not a power of two.
    """
    if coarse < 1 or coarse & (coarse - 1):
        raise InputError(f"{setting}: must be a power of two: 1, 2, 4, 8, ...")


def refined(
    verdicts: Callable[[Sequence[Point]], Sequence[int]], shape: Point, coarse: int = 8
) -> Refined:
    """Return the labels of a grid, computed only near borders between areas of equal labels.

    Parameters
    ----------
    verdicts
        Function that returns the labels of points; it gets each point at most once.
    shape
        Number of rows and of columns.
    coarse
        Spacing to begin with, a power of two.

    Raises
    ------
    InputError
        ``coarse`` is not a power of two.
    """
    check_coarse(coarse, f"coarse = {coarse!r}")
    grid = Refined(np.full(shape, _NOT_YET), np.zeros(shape, bool))
    before: list[np.ndarray] | None = None
    while coarse:
        lines = [_spaced(coarse, size) for size in shape]
        if before is None:
            _compute(verdicts, grid, np.ix_(*lines))
        else:
            # A new line starts with the labels of the last known line before it.
            last = [
                old[np.searchsorted(old, new, "right") - 1]
                for old, new in zip(before, lines, strict=True)
            ]
            computed = grid.computed[np.ix_(*lines)]
            labels = np.where(computed, grid.labels[np.ix_(*lines)], grid.labels[np.ix_(*last)])
            grid.labels[np.ix_(*lines)] = labels
            _compute_borders(verdicts, grid, np.ix_(*lines))
        before, coarse = lines, coarse // 2
    return grid


def _spaced(spacing: int, size: int) -> np.ndarray:
    """Return every ``spacing``-th index from 0, and the last one, ``size`` - 1."""
    return np.union1d(np.arange(0, size, spacing), [size - 1])


def _compute_borders(
    verdicts: Callable[[Sequence[Point]], Sequence[int]],
    grid: Refined,
    lines: tuple[np.ndarray, ...],
) -> None:
    """Compute points at borders until none is left; ``lines`` selects the rows and columns."""
    # A computed label may differ from the label that was copied, which makes further borders.
    while True:
        wanted = _at_borders(grid.labels[lines]) & ~grid.computed[lines]
        if not wanted.any():
            return
        rows, columns = (np.broadcast_to(line, wanted.shape)[wanted] for line in lines)
        _compute(verdicts, grid, (rows, columns))


def _compute(
    verdicts: Callable[[Sequence[Point]], Sequence[int]],
    grid: Refined,
    indices: tuple[np.ndarray, ...],
) -> None:
    """Compute the labels of points, given by arrays of rows and columns that are broadcast."""
    rows, columns = (index.ravel() for index in np.broadcast_arrays(*indices))
    points = [(int(i), int(j)) for i, j in zip(rows, columns, strict=True)]
    grid.labels[rows, columns] = verdicts(points)
    grid.computed[rows, columns] = True


def _at_borders(labels: np.ndarray) -> np.ndarray:
    """Return the mask of points with a different label among their eight neighbours."""
    around = np.lib.stride_tricks.sliding_window_view(np.pad(labels, 1, mode="edge"), (3, 3))
    different: np.ndarray = (around != labels[:, :, None, None]).any(axis=(2, 3))
    return different
