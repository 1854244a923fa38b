"""Whether a curve of many oscillations still rises or falls: a question of its own."""

import numpy as np

CHANGE = 0.1
"""A level has a trend if it changes by more than this share of itself, from the first third of
the samples to the last."""
PARTS = 6


class Trend:
    """Compares the beginning of so many samples with their end, as they come.

    An oscillation is no trend: the root mean square from third to third and from half to half,
    and the largest value from third to third, must all move in one direction, and enough. Periods
    of a beat that fit badly into the one fit into the other.
    """

    def __init__(self, count: int) -> None:
        """For ``count`` samples in all; of less than six nothing is said."""
        self._ends = [count * (part + 1) // PARTS for part in range(PARTS)]
        self._squares, self._peaks, self._taken = np.zeros(PARTS), np.zeros(PARTS), 0

    def take(self, values: np.ndarray) -> None:
        """The next samples, none of them negative."""
        begin = 0
        for part, end in enumerate(self._ends):
            own = values[begin : max(end - self._taken, begin)]
            begin += len(own)
            self._squares[part] += np.sum(own**2)
            self._peaks[part] = max(self._peaks[part], np.max(own, initial=0.0))
        self._taken += len(values)

    def found(self, floor: float) -> bool:
        """Whether the samples have a trend; a change of less than ``floor`` is rounding."""
        counts = np.diff(self._ends, prepend=0)
        if not counts.all():
            return False

        def level(parts: slice) -> float:
            return float(np.sqrt(self._squares[parts].sum() / counts[parts].sum()))

        first, last = slice(0, 2), slice(4, 6)
        thirds = level(last) - level(first)
        halves = level(slice(3, 6)) - level(slice(0, 3))
        peaks = float(self._peaks[last].max() - self._peaks[first].max())
        moved = np.sign(thirds) * np.array([thirds, halves, peaks])
        least = CHANGE * np.array([level(slice(None)), level(slice(None)) / 2, self._peaks.max()])
        return bool(np.all(moved > least)) and abs(thirds) > floor
