"""Trend of an oscillating curve: whether its level rises or falls."""

import numpy as np

CHANGE = 0.1
"""Relative change of the level, from the first third of the samples to the last, that is a
trend."""
PARTS = 6


class Trends:
    """Trend detector that compares the start of each run with its end.

    An oscillation is not a trend. Three changes must have the same sign and exceed a threshold: the
    root mean square between thirds and between halves, and the largest value between thirds. A beat
    whose period fits badly into the thirds fits better into the halves.
    """

    def __init__(self, runs: int, count: int) -> None:
        """Expect ``count`` samples per run; with fewer than six, no trend is reported."""
        self._ends = [count * (part + 1) // PARTS for part in range(PARTS)]
        self._squares, self._peaks = np.zeros((PARTS, runs)), np.zeros((PARTS, runs))
        self._taken = 0

    def take(self, values: np.ndarray, squares: np.ndarray) -> None:
        """Process the next non-negative samples and their squares, shape (runs, samples)."""
        begin = 0
        for part, end in enumerate(self._ends):
            until = min(max(end - self._taken, begin), values.shape[1])
            if until > begin:
                window = slice(begin, until)
                self._squares[part] += np.sum(squares[:, window], axis=1)
                self._peaks[part] = np.maximum(self._peaks[part], values[:, window].max(axis=1))
            begin = until
        self._taken += values.shape[1]

    def found(self, floors: np.ndarray) -> np.ndarray:
        """Return the direction of each run's trend, shape (runs,): 1 rising, -1 falling, 0 none.

        Args:
            floors: bounds of the rounding error; smaller changes are ignored, shape (runs,).
        """
        counts = np.diff(self._ends, prepend=0)
        if not counts.all():
            return np.zeros(self._peaks.shape[1], int)

        def level(first: int, end: int) -> np.ndarray:
            # Sum sequentially, so that the result does not depend on the number of runs.
            total = sum(self._squares[first + 1 : end], self._squares[first])
            return np.asarray(np.sqrt(total / counts[first:end].sum()))

        whole, peaks = level(0, PARTS), self._peaks
        thirds = level(4, 6) - level(0, 2)
        halves = level(3, 6) - level(0, 3)
        rises = np.maximum(peaks[4], peaks[5]) - np.maximum(peaks[0], peaks[1])
        sign = np.sign(thirds)
        moved = sign * thirds > CHANGE * whole
        moved &= sign * halves > CHANGE * whole / 2
        moved &= sign * rises > CHANGE * peaks.max(axis=0)
        return np.where(moved & (np.abs(thirds) > floors), sign, 0.0).astype(int)
