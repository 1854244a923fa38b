"""Statistics over the samples of several runs: root mean squares, residuals and trends."""

import numpy as np

from ab_sim.engine.compiling import Cube, Table, compiled
from ab_sim.tracing.functions import cos_sin


class MeanSquares:
    """Accumulated root mean squares, one per run; ``runs`` is the number of runs."""

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
        """Root mean square of each run's values so far, at least one, shape (runs,)."""
        return np.asarray(np.sqrt(self._sums / self._count))

    @property
    def values_if_any(self) -> list[float | None]:
        """Root mean square of each run's values so far; None without values."""
        return self.values.tolist() if self._count else [None] * len(self._sums)


class RotorResiduals:
    """Root mean square of abs(1 + sum s_i exp(i theta_i)), with s_i = p_i / whole.

    If the whole is 0, the root mean square of abs(sum p_i exp(i theta_i)).

    Parameters
    ----------
    parts
        p_i of each ball, shape (runs, balls).
    wholes
        Unbalance or couple of each rotor, shape (runs,), real or complex.
    """

    def __init__(self, parts: np.ndarray, wholes: np.ndarray) -> None:
        self._has = np.asarray(wholes) != 0.0
        self.any = bool(self._has.any())
        """True if at least one run has an unbalance or couple to balance."""
        shares = parts / np.where(self._has, wholes, 1.0)[:, None]
        self._offset = self._has.astype(float)[:, None]
        self._real, self._imaginary = shares.real.copy(), shares.imag.copy()
        self._mean = MeanSquares(len(parts))

    def take(self, angles: np.ndarray) -> np.ndarray:
        """Add the ball angles of further samples; return squared residuals, shape (runs, samples).

        Parameters
        ----------
        angles
            Ball angles [rad], shape (runs, samples, balls), C-contiguous.
        """
        squares = np.empty(angles.shape[:2])
        compiled(_residual_squares)(self._offset, self._real, self._imaginary, angles, squares)
        self._mean.take_squares(squares)
        return squares

    @property
    def values(self) -> np.ndarray:
        """Root mean square of each run, shape (runs,)."""
        return self._mean.values

    @property
    def shares(self) -> list[float | None]:
        """Root mean square of each run's residual; None if the run has no unbalance or couple."""
        values = zip(self._mean.values_if_any, self._has.tolist(), strict=True)
        return [value if has else None for value, has in values]


def _residual_squares(
    unbalance: Table, real: Table, imaginary: Table, angles: Cube, squares: Table
) -> None:
    """Compute abs(o + sum s_i exp(i theta_i))^2 at all samples of runs; to be compiled.

    Parameters
    ----------
    unbalance
        o, shape (runs, 1).
    real, imaginary
        Parts of s_i, shape (runs, balls).
    angles
        theta_i [rad], shape (runs, samples, balls).
    squares
        Output, shape (runs, samples).
    """
    for run in range(angles.shape[0]):
        for k in range(angles.shape[1]):
            x = unbalance[run, 0]
            y = 0.0
            for ball in range(angles.shape[2]):
                c, s = cos_sin(angles[run, k, ball])
                x += real[run, ball] * c - imaginary[run, ball] * s
                y += real[run, ball] * s + imaginary[run, ball] * c
            squares[run, k] = x * x + y * y


CHANGE = 0.1
"""Relative change of the level, from the first third of the samples to the last, that is a
trend."""
PARTS = 6
"""Number of parts of the samples, of which thirds and halves consist."""


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

    def directions(self, floors: np.ndarray) -> np.ndarray:
        """Return the direction of each run's trend, shape (runs,): 1 rising, -1 falling, 0 none.

        Parameters
        ----------
        floors
            Bounds of the rounding error; smaller changes are ignored, shape (runs,).
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
