"""Create explicit Runge-Kutta methods from their tableaus."""

from collections.abc import Sequence

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

    def growth(z: complex) -> complex:
        ones = np.ones(stages, dtype=complex)
        return complex(1 + z * (b @ np.linalg.solve(np.eye(stages) - z * a, ones)))

    tableau = Tableau(a, b, a.sum(axis=1))
    return Stepper(name, order, source, tableau, stages, growth, takes_lanes=True)
