"""Integrators that are given a tolerance and choose their steps."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ab_sim.accuracy.deviation import Samples
from ab_sim.studies.accuracy_cost.methods import FailedError
from ab_sim.studies.accuracy_cost.right_hand_side import RightHandSide, SmoothInterval

ABSOLUTE = 0.01
"""Absolute tolerances are this share of the relative one, times each state's magnitude."""


class IntervalOutcome(NamedTuple):
    """One leg, integrated."""

    states: np.ndarray
    """At the leg's grid, shape (times, states)."""
    evaluations: int


LegSolver = Callable[[SmoothInterval, np.ndarray, float, np.ndarray], IntervalOutcome]
"""From a leg, the state at its begin, relative and absolute tolerances; raises FailedError."""


class ByTolerance:
    """One integrator at one relative tolerance.

    Args:
        f: the scene.
        with_energy_balance: makes the scene with an energy balance; called only for
            ``energy_error``. None where no energy balance can be kept.
        name: of the integrator.
        solver: integrates a leg.
        tolerance: relative.
    """

    peer: bool = True
    step: float | None = None

    def __init__(
        self,
        f: RightHandSide,
        with_energy_balance: Callable[[], RightHandSide] | None,
        name: str,
        solver: LegSolver,
        tolerance: float,
    ) -> None:
        self.f, self.with_energy_balance, self.name = f, with_energy_balance, name
        self.solver = solver
        self.tolerance: float | None = tolerance
        self.evaluations: int | None = None

    def prepare(self) -> None:
        """Nothing is kept from run to run."""

    def run(self) -> np.ndarray:
        """States at the sample times."""
        return self._run(self.f)

    def samples(self, kept: np.ndarray) -> Samples:
        """Those states as samples."""
        return self.f.samples(kept)

    def energy_error(self) -> float | None:
        """With the energy balance's states integrated along."""
        if self.with_energy_balance is None:
            return None
        f = self.with_energy_balance()
        before = self.evaluations
        try:
            return f.energy_error(self._run(f))
        except FailedError:
            return None
        finally:
            self.evaluations = before

    def _run(self, f: RightHandSide) -> np.ndarray:
        state, kept, evaluations, relative = f.start, [], 0, self.tolerance
        assert relative is not None
        absolute = relative * ABSOLUTE * f.scale
        for leg in f.legs:
            states, more = self.solver(leg, state, relative, absolute)
            if not np.isfinite(states).all():
                raise FailedError("diverged: states that are not finite")
            # Of a transposed array: code reads what lies side by side in memory.
            state = np.ascontiguousarray(states[-1])
            kept.append(states[leg.keep])
            evaluations += more
        self.evaluations = evaluations
        return np.concatenate(kept)
