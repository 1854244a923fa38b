"""Stretches of a run that slide along with it, however its rows come in."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ab_sim.recording.layout import Array


class Windows:
    """Cuts rows into windows that end at whole multiples of ``hop``, each ``span`` long.

    Where a window begins and ends depends on the rows' times alone, and not on how they come in.

    Args:
        span: of a window [s].
        hop: from one to the next [s].
    """

    def __init__(self, span: float, hop: float) -> None:
        self._span, self._hop = round(span * 1e9), round(hop * 1e9)
        self._kept = np.empty((0, 0))

    def of(self, rows: Array) -> Iterator[Array]:
        """Every window that is complete now, in turn; none without rows, or where time runs back.

        Args:
            rows: the next ones; ``time`` [s] is their second column.
        """
        seen = len(self._kept)
        every = np.concatenate([self._kept, rows]) if seen else rows
        time = nanoseconds(every[:, 1])
        part = time // self._hop
        # The rows kept were all that could be seen of parts that are over but for the last one.
        over = 1 + np.flatnonzero(np.diff(part))
        first = np.searchsorted(time, (part + 1) * self._hop - self._span)
        self._kept = every[first[-1] :].copy()
        for end in over[over >= seen]:
            window = every[first[end - 1] : end]
            if len(window) and np.all(np.diff(window[:, 1]) > 0.0):
                yield window


class FrameRate:
    """Keeps one row in each ``period`` [s]: the first, however the rows come in."""

    def __init__(self, period: float) -> None:
        self._period = round(period * 1e9)
        self._last = np.iinfo(np.int64).min

    def of(self, rows: Array) -> Array:
        """Those of the rows that are kept; ``time`` [s] is their second column."""
        part = nanoseconds(rows[:, 1]) // self._period
        before, self._last = self._last, part[-1]
        return rows[np.concatenate([[part[0] != before], part[1:] != part[:-1]])]


def nanoseconds(time: Array) -> np.ndarray:
    """Times [s] in whole ns."""
    return np.rint(time * 1e9).astype(np.int64)
