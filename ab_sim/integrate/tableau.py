"""An explicit Runge-Kutta method as data."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np


class Weights(NamedTuple):
    """The Butcher tableau as arrays, as the compiled loop takes it."""

    a: np.ndarray
    """Stage weights, shape (s, s), strictly lower triangular."""
    b: np.ndarray
    """Weights of the stages in the step, shape (s,)."""
    c: np.ndarray
    """Stage times as fractions of the step, shape (s,)."""


class Tableau(NamedTuple):
    """A named explicit Runge-Kutta method with the order it is declared to have."""

    name: str
    order: int
    source: str
    weights: Weights

    @property
    def stages(self) -> int:
        """Evaluations of the right-hand side per step."""
        return self.weights.b.size

    @property
    def slopes(self) -> int:
        """Slopes that a step keeps: rows of the workspace."""
        return self.stages

    @property
    def nodes(self) -> int:
        """Sets of balls that a step keeps beside the one at hand."""
        return 0

    def growth(self, z: complex) -> complex:
        """R(z): what one step makes of y' = lambda y, with z = step times lambda."""
        a, b, _ = self.weights
        ones = np.ones(self.stages, dtype=complex)
        return complex(1 + z * (b @ np.linalg.solve(np.eye(self.stages) - z * a, ones)))


def explicit(
    name: str, order: int, source: str, rows: Sequence[Sequence[float]], weights: Sequence[float]
) -> Tableau:
    """A tableau from the rows below its diagonal; stage times are the row sums."""
    stages = len(weights)
    a = np.zeros((stages, stages))
    for i, row in enumerate(rows, start=1):
        a[i, : len(row)] = row
    return Tableau(name, order, source, Weights(a, np.array(weights), a.sum(axis=1)))
