"""Checks for held readings and spikes."""

from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ab_sim.base.errors import InputError
from ab_sim.identification.checks import FEWEST

SPIKE, TALL, AROUND = 8.0, 3.0, 12
"""Thresholds of a spike.

``SPIKE`` is relative to nearby deviations from a median of five samples, ``TALL`` to the signal's
r.m.s. ``AROUND`` is the number of nearby samples on either side.
"""
LONG, HELD, REGULAR, OFF_WHOLE = 0.05, 1.7, 0.9, 0.05
"""Thresholds of held series.

``LONG``: fraction of a series without change that counts as constant. ``HELD``: mean number of
equal samples in a held series. ``REGULAR``: fraction of equal intervals between changes.
``OFF_WHOLE``: distance from a whole number of steps of a resolution.
"""


def spikes_in(values: np.ndarray) -> np.ndarray:
    """Return rows of spikes: one or two samples that stand out from all samples near them.

    Args:
        values: signal, NaN for missing samples.
    """
    rows = np.flatnonzero(np.isfinite(values))
    some = values[rows]
    if len(some) < FEWEST:
        return rows[:0]
    middle = np.median(sliding_window_view(np.pad(some, 2, mode="edge"), 5), axis=1)
    off = np.abs(some - middle)
    around = sliding_window_view(np.pad(off, AROUND, mode="reflect"), 2 * AROUND + 1)
    # The third largest deviation nearby is not part of a spike of up to two samples.
    usual = np.partition(around, -3, axis=1)[:, -3]
    tall = off > max(TALL * float(middle.std()), 1e-300)
    spikes: np.ndarray = rows[tall & (off > SPIKE * usual)]
    return spikes


class _Repeats(NamedTuple):
    """Pattern of repeated values in a series."""

    lengths: np.ndarray
    """Lengths of runs of equal samples, without long constant stretches."""
    usual: float
    """Median of the lengths."""
    coarse: bool
    """True if the resolution is coarse: most changes are of one or two steps."""


def _repeats(values: np.ndarray) -> _Repeats | None:
    """Return the pattern of repeated values in a series; None if values hardly repeat."""
    jumps = np.abs(np.diff(values))
    changes = np.flatnonzero(jumps)
    lengths = np.diff(changes)
    # At constant speed a series may be constant for long; leave such stretches out.
    lengths = lengths[lengths < LONG * len(values)]
    if len(lengths) < FEWEST or lengths.sum() < HELD * len(lengths):
        return None
    usual = float(np.median(lengths))
    step = float(np.min(np.diff(np.unique(values))))
    steps = jumps[changes] / step
    whole = np.mean(np.abs(steps - np.rint(steps)) < OFF_WHOLE) > REGULAR
    return _Repeats(lengths, usual, bool(whole and float(np.median(steps)) < HELD))


HOLDS = (
    "is held: it changes every {:g} samples only and repeats its last value in between, which "
    "delays it by half that time; "
)


def check_held(values: np.ndarray, what: str, name: str) -> None:
    """Refuse a spindle's series that holds each value until the next one.

    A coarse resolution also repeats values. Its changes, however, are of one or two steps and
    irregular in time.

    Args:
        values: speed or angle of the spindle, in any unit.
        what: name of the column.
        name: name of the recording.

    Raises:
        InputError: the values are held; the message states the interval and the remedy.
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
    """Refuse a signal that is sampled more slowly than the rows, and held between its samples.

    Args:
        values: signal, NaN for missing samples.
        what: name of the column.
        name: name of the recording.

    Raises:
        InputError: the values are held; the message states the interval and the remedy.
    """
    repeats = _repeats(values[np.isfinite(values)])
    if repeats is None or repeats.coarse or repeats.usual < 2.0:
        return
    # A signal at rest and a clipped one also repeat values, but not as regularly.
    if np.mean(np.abs(repeats.lengths - repeats.usual) <= 1.0) > REGULAR:
        raise InputError(
            f"{name}: {what}: {HOLDS.format(repeats.usual)}keep the rows at which it changes; for "
            "a ROS bag, give the bag and not its import"
        )
