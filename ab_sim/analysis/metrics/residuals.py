"""Residual unbalance and couple of rotors with balls, for several runs."""

import numpy as np

from ab_sim.analysis.metrics.mean_squares import MeanSquares
from ab_sim.engine.compiling import Cube, Table, compiled
from ab_sim.tracing.functions import cos_sin


class Residuals:
    """Root mean square of abs(1 + sum s_i exp(i theta_i)), with s_i = p_i / whole.

    If the whole is 0, the root mean square of abs(sum p_i exp(i theta_i)).

    Args:
        parts: p_i of each ball, shape (runs, balls).
        wholes: unbalance or couple of each rotor, shape (runs,), real or complex.
    """

    def __init__(self, parts: np.ndarray, wholes: np.ndarray) -> None:
        self._has = np.asarray(wholes) != 0.0
        self.any = bool(self._has.any())
        """True if at least one run has an unbalance or couple to balance."""
        shares = parts / np.where(self._has, wholes, 1.0)[:, None]
        self._own = self._has.astype(float)[:, None]
        self._real, self._imaginary = shares.real.copy(), shares.imag.copy()
        self._mean = MeanSquares(len(parts))

    def take(self, angles: np.ndarray) -> np.ndarray:
        """Add the ball angles of further samples; return squared residuals, shape (runs, samples).

        Args:
            angles: ball angles [rad], shape (runs, samples, balls), C-contiguous.
        """
        squares = np.empty(angles.shape[:2])
        compiled(residual_squares)(self._own, self._real, self._imaginary, angles, squares)
        self._mean.take_squares(squares)
        return squares

    @property
    def values(self) -> np.ndarray:
        """Root mean square of each run, shape (runs,)."""
        return self._mean.values

    @property
    def found(self) -> list[float | None]:
        """Root mean square of each run's residual; None if the run has no unbalance or couple."""
        values = zip(self._mean.values_if_any, self._has.tolist(), strict=True)
        return [value if has else None for value, has in values]


def residual_squares(
    unbalance: Table, real: Table, imaginary: Table, angles: Cube, squares: Table
) -> None:
    """Compute abs(o + sum s_i exp(i theta_i))^2 at all samples of runs; to be compiled.

    Args:
        unbalance: o, shape (runs, 1).
        real, imaginary: parts of s_i, shape (runs, balls).
        angles: theta_i [rad], shape (runs, samples, balls).
        squares: output, shape (runs, samples).
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
