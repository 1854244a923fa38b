"""Root mean squares of samples, accumulated for several runs."""

import numpy as np


class MeanSquares:
    """Accumulated root mean squares, one per run."""

    def __init__(self, runs: int) -> None:
        self._sums, self._count = np.zeros(runs), 0

    def take(self, values: np.ndarray) -> None:
        """Add values, shape (runs, samples)."""
        self.take_squares(values * values)

    def take_squares(self, squares: np.ndarray) -> None:
        """Add values whose squares are given, shape (runs, samples), C-contiguous."""
        # Sum along the contiguous last axis: the order of summation, and thus every bit, is
        # independent of the other runs.
        self._sums += np.sum(squares, axis=1)
        self._count += squares.shape[1]

    @property
    def values(self) -> np.ndarray:
        """Root mean squares of all values so far; there must be at least one."""
        return np.asarray(np.sqrt(self._sums / self._count))

    @property
    def values_if_any(self) -> list[float | None]:
        """Root mean squares of all values so far; None without values."""
        return self.values.tolist() if self._count else [None] * len(self._sums)
