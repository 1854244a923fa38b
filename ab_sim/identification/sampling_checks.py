"""Readings that are not of their sample: held ones, and spikes."""

from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ab_sim.errors import InputError
from ab_sim.identification.checks import FEWEST

SPIKE, TALL, AROUND = 8.0, 3.0, 12
"""Times as far off the median of five samples as those near it, and times the signal's r.m.s., from
which a sample is a spike; samples on either side that are near."""
LONG, HELD, REGULAR, OFF_WHOLE = 0.05, 1.7, 0.9, 0.05
"""Share of a series without change that counts as constant; mean number of equal samples from
which it is held; share of equal intervals between changes from which they are regular; distance
from a whole number of steps of a resolution."""


def spikes_in(values: np.ndarray) -> np.ndarray:
    """Return rows of one or two samples that stand out of all near them, and of the signal.

    Args:
        values: of a signal, NaN where there is none.
    """
    rows = np.flatnonzero(np.isfinite(values))
    some = values[rows]
    if len(some) < FEWEST:
        return rows[:0]
    middle = np.median(sliding_window_view(np.pad(some, 2, mode="edge"), 5), axis=1)
    off = np.abs(some - middle)
    around = sliding_window_view(np.pad(off, AROUND, mode="reflect"), 2 * AROUND + 1)
    # The largest one near it that belongs to no spike of up to two samples.
    usual = np.partition(around, -3, axis=1)[:, -3]
    tall = off > max(TALL * float(middle.std()), 1e-300)
    found: np.ndarray = rows[tall & (off > SPIKE * usual)]
    return found


class _Repeats(NamedTuple):
    """How a series repeats its values."""

    lengths: np.ndarray
    """Numbers of equal samples in a row, but for long stretches."""
    usual: float
    """Median of these."""
    coarse: bool
    """Whether most changes are of one or two steps of a resolution."""


def _repeats(values: np.ndarray) -> _Repeats | None:
    """Return how a series repeats its values; None if it hardly does."""
    jumps = np.abs(np.diff(values))
    changes = np.flatnonzero(jumps)
    lengths = np.diff(changes)
    # At a speed that is held nothing changes for long.
    lengths = lengths[lengths < LONG * len(values)]
    if len(lengths) < FEWEST or lengths.sum() < HELD * len(lengths):
        return None
    usual = float(np.median(lengths))
    step = float(np.min(np.diff(np.unique(values))))
    steps = jumps[changes] / step
    whole = np.mean(np.abs(steps - np.rint(steps)) < OFF_WHOLE) > REGULAR
    return _Repeats(lengths, usual, bool(whole and float(np.median(steps)) < HELD))


HOLDS = (
    "is held: it changes every {:g} samples only, and repeats its last value until then, which "
    "is late by half of that; "
)


def check_held(values: np.ndarray, what: str, name: str) -> None:
    """Refuse a spindle's series that repeats each value until the next one.

    A coarse resolution repeats values as well. But its changes are of one or two steps of it, and
    not regular in time.

    Raises:
        InputError: as of ``check_time``.
    """
    repeats = _repeats(values)
    if repeats is None:
        return
    if repeats.coarse and np.mean(repeats.lengths == repeats.usual) < REGULAR:
        return
    raise InputError(
        f"{name}: {what}: {HOLDS.format(repeats.usual)}interpolate it between its changes, or "
        "record it at every sample"
    )


def check_held_signal(values: np.ndarray, what: str, name: str) -> None:
    """Refuse a signal that is sampled slower than the rows, and held between its samples.

    Raises:
        InputError: as of ``check_time``.
    """
    repeats = _repeats(values[np.isfinite(values)])
    if repeats is None or repeats.coarse or repeats.usual < 2.0:
        return
    # A signal at rest and one that is clipped repeat values, too, but not as regularly.
    if np.mean(np.abs(repeats.lengths - repeats.usual) <= 1.0) > REGULAR:
        raise InputError(
            f"{name}: {what}: {HOLDS.format(repeats.usual)}keep the rows at which it changes; of a "
            "ROS bag, give the bag and not its import"
        )
