"""Root mean squares of samples as they come, of several runs side by side."""

import numpy as np


class MeanSquares:
    """Root mean squares that grow with what they are given, one for each run."""

    def __init__(self, runs: int) -> None:
        self._sums, self._count = np.zeros(runs), 0

    def take(self, values: np.ndarray) -> None:
        """Add values, shape (runs, samples)."""
        self.take_squares(values * values)

    def take_squares(self, squares: np.ndarray) -> None:
        """Add values whose squares are known, shape (runs, samples), C-contiguous."""
        # Along the last axis, in which each run's numbers follow each other: so its sum is taken in
        # the same order, and is the same to the bit, whatever is beside it.
        self._sums += np.sum(squares, axis=1)
        self._count += squares.shape[1]

    @property
    def values(self) -> np.ndarray:
        """The roots of the mean squares of all values so far; there must be some."""
        return np.asarray(np.sqrt(self._sums / self._count))

    @property
    def values_if_any(self) -> list[float | None]:
        """The same, None without values."""
        return self.values.tolist() if self._count else [None] * len(self._sums)
