"""Whether a curve of many oscillations still rises or falls: a question of its own."""

import numpy as np

CHANGE = 0.1
"""A level has a trend if it changes by more than this share of itself, from the first third of
the samples to the last."""
PARTS = 6


class Trends:
    """Compares the beginning of so many samples of each run with their end, as they come.

    An oscillation is no trend: the root mean square from third to third and from half to half,
    and the largest value from third to third, must all move in one direction, and enough. Periods
    of a beat that fit badly into the one fit into the other.
    """

    def __init__(self, runs: int, count: int) -> None:
        """For ``count`` samples in all of each run; of less than six nothing is said."""
        self._ends = [count * (part + 1) // PARTS for part in range(PARTS)]
        self._squares, self._peaks = np.zeros((PARTS, runs)), np.zeros((PARTS, runs))
        self._taken = 0

    def take(self, values: np.ndarray, squares: np.ndarray) -> None:
        """The next samples, none of them negative, and their squares, shape (runs, samples)."""
        begin = 0
        for part, end in enumerate(self._ends):
            until = min(max(end - self._taken, begin), values.shape[1])
            if until > begin:
                own = slice(begin, until)
                self._squares[part] += np.sum(squares[:, own], axis=1)
                self._peaks[part] = np.maximum(self._peaks[part], values[:, own].max(axis=1))
            begin = until
        self._taken += values.shape[1]

    def found(self, floors: np.ndarray) -> np.ndarray:
        """Direction of each run's trend, shape (runs,): 1 rises, -1 falls, 0 has none.

        Args:
            floors: a change of less than that is rounding, shape (runs,).
        """
        counts = np.diff(self._ends, prepend=0)
        if not counts.all():
            return np.zeros(self._peaks.shape[1], int)

        def level(first: int, end: int) -> np.ndarray:
            # One after the other: so the sum is the same however many runs there are.
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
