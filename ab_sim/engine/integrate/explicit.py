"""Create explicit Runge-Kutta methods from their tableaus."""

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np

from ab_sim.engine.integrate.registry import Stepper
from ab_sim.engine.kernels.runge_kutta import Tableau


def explicit(
    name: str, order: int, source: str, rows: Sequence[Sequence[float]], weights: Sequence[float]
) -> Stepper:
    """Return a method from its Butcher tableau.

    Parameters
    ----------
    name
        Name in scenes.
    order
        Order of the method.
    source
        Publication of the coefficients.
    rows
        Stage weights from the second stage on, up to the diagonal; the stage times are their sums.
    weights
        Weights of the stages in the step.
    """
    stages = len(weights)
    a, b = np.zeros((stages, stages)), np.array(weights)
    for i, row in enumerate(rows, start=1):
        a[i, : len(row)] = row

    # Coefficients b a^k 1 of the stability polynomial, the highest power first.
    powers = [b @ np.linalg.matrix_power(a, k) @ np.ones(stages) for k in range(stages)]
    coefficients = [*map(complex, reversed(powers)), 1.0 + 0j]

    def growth(z: Any) -> Any:
        return functools.reduce(lambda total, one: total * z + one, coefficients)

    tableau = Tableau(a, b, a.sum(axis=1))
    return Stepper(name, order, source, tableau, stages, growth, takes_lanes=True)
