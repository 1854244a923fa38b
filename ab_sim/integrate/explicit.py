"""Explicit Runge-Kutta methods, from their tableau."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ab_sim.dynamics.layout import state_size
from ab_sim.dynamics.numbers.multiply_add import multiply_add
from ab_sim.dynamics.slope import inlined_evaluate
from ab_sim.integrate.on_stack import trial_of
from ab_sim.integrate.stepper import Stepper


class Weights(NamedTuple):
    """The Butcher tableau as arrays, as the compiled loop takes it."""

    a: np.ndarray
    """Stage weights, shape (s, s), strictly lower triangular."""
    b: np.ndarray
    """Weights of the stages in the step, shape (s,)."""
    c: np.ndarray
    """Stage times as fractions of the step, shape (s,)."""

    def step(self, plant: Any, begin: Any, length: Any, state: Any, work: Any) -> None:
        """See ``Stepper.weights``."""
        slopes, trial = work.slopes, trial_of(plant.system, work)
        stages, states = self.b.size, state_size(plant.system, state)
        for stage in range(1, stages):
            for j in range(states):
                trial[j] = 0.0
            for earlier in range(stage):
                weight = self.a[stage, earlier]
                if weight != 0.0:
                    for j in range(states):
                        trial[j] = multiply_add(weight, slopes[earlier, j], trial[j])
            for j in range(states):
                trial[j] = multiply_add(length, trial[j], state[j])
            inlined_evaluate(plant, begin + self.c[stage] * length, trial, slopes[stage])
        for j in range(states):
            trial[j] = 0.0
        for stage in range(stages):
            for j in range(states):
                trial[j] = multiply_add(self.b[stage], slopes[stage, j], trial[j])
        for j in range(states):
            work.trial[j] = multiply_add(length, trial[j], state[j])


def explicit(
    name: str, order: int, source: str, rows: Sequence[Sequence[float]], weights: Sequence[float]
) -> Stepper:
    """A method from the rows below its tableau's diagonal; stage times are the row sums."""
    stages = len(weights)
    a, b = np.zeros((stages, stages)), np.array(weights)
    for i, row in enumerate(rows, start=1):
        a[i, : len(row)] = row

    def growth(z: complex) -> complex:
        ones = np.ones(stages, dtype=complex)
        return complex(1 + z * (b @ np.linalg.solve(np.eye(stages) - z * a, ones)))

    made = Weights(a, b, a.sum(axis=1))
    return Stepper(name, order, source, made, stages, growth, slopes=stages, takes_lanes=True)
