"""Explicit Runge-Kutta methods, from their tableau."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numba.extending import overload

from ab_sim.dynamics.dispatch import INLINED, system_in
from ab_sim.dynamics.layout import state_count, states_in
from ab_sim.dynamics.numbers.abreast import copied, stepped
from ab_sim.dynamics.numbers.kinds import duals
from ab_sim.dynamics.slope import evaluate, inlined_evaluate
from ab_sim.integrate.on_stack import pairs_of, rates_of, trial_of
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
        pairs = pairs_of(plant.system, work)
        stages, states = self.b.size, state_count(plant.system, state)
        for stage in range(1, stages):
            stepped(self.a[stage], stage, slopes, length, state, trial, states, pairs)
            evaluate_stage(plant, begin + self.c[stage] * length, trial, slopes[stage], work)
        stepped(self.b, stages, slopes, length, state, work.trial, states, pairs)


def evaluate_stage(plant: Any, time: Any, state: Any, slope: Any, work: Any) -> None:
    """``slope.evaluate``, in registers up to its end where the kernel knows how many states."""
    raise TypeError("is called by compiled code only")


def _in_registers(plant, time, state, slope, work):  # type: ignore[no-untyped-def]
    rates = rates_of(plant.system, work)
    inlined_evaluate(plant, time, state, rates)
    copied(rates, slope, state_count(plant.system, state))


def _in_memory(plant, time, state, slope, work):  # type: ignore[no-untyped-def]
    inlined_evaluate(plant, time, state, slope)


def _with_duals(plant, time, state, slope, work):  # type: ignore[no-untyped-def]
    evaluate(plant, time, state, slope)


@overload(evaluate_stage, jit_options=INLINED, strict=False)
def _evaluate_stage(plant, time, state, slope, work):  # type: ignore[no-untyped-def]
    if state.dtype == duals:
        # One copy of the formulas, and no more: of duals it takes longest to compile.
        return _with_duals
    return _in_memory if states_in(system_in(plant)) is None else _in_registers


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
