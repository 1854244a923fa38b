"""Sliding windows over a run, independent of the size of blocks."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ab_sim.record.recording.layout import Array


class SlidingWindows:
    """Divides samples into windows of length ``span`` that end at multiples of ``hop``.

    Windows depend only on the samples' times, and not on the size of blocks.

    Args:
        span: length of a window [s].
        hop: time between the ends of two windows [s].
    """

    def __init__(self, span: float, hop: float) -> None:
        self._span, self._hop = round(span * 1e9), round(hop * 1e9)
        self._kept = np.empty((0, 0))

    def of(self, rows: Array) -> Iterator[Array]:
        """Yield all windows that the next samples complete.

        Windows without samples, or in which time decreases, are omitted.

        Args:
            rows: next samples; ``time`` [s] is the second column.
        """
        seen = len(self._kept)
        every = np.concatenate([self._kept, rows]) if seen else rows
        time = nanoseconds(every[:, 1])
        part = time // self._hop
        # Windows that end at rows of earlier blocks were yielded before.
        over = 1 + np.flatnonzero(np.diff(part))
        first = np.searchsorted(time, (part + 1) * self._hop - self._span)
        self._kept = every[first[-1] :].copy()
        for end in over[over >= seen]:
            window = every[first[end - 1] : end]
            if len(window) and np.all(np.diff(window[:, 1]) > 0.0):
                yield window


class FrameRate:
    """Selects the first sample in each ``period`` [s], independent of the size of blocks."""

    def __init__(self, period: float) -> None:
        self._period = round(period * 1e9)
        self._last = np.iinfo(np.int64).min

    def of(self, rows: Array) -> Array:
        """Return the selected ones of the next samples; ``time`` [s] is the second column."""
        part = nanoseconds(rows[:, 1]) // self._period
        before, self._last = self._last, part[-1]
        return rows[np.concatenate([[part[0] != before], part[1:] != part[:-1]])]


def nanoseconds(time: Array) -> np.ndarray:
    """Return times [s] in whole nanoseconds."""
    return np.rint(time * 1e9).astype(np.int64)
