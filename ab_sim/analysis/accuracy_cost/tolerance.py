"""Integrators with step size control, by tolerance."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ab_sim.analysis.accuracy_cost.methods import FailedError
from ab_sim.analysis.accuracy_cost.right_hand_side import RightHandSide, SmoothInterval
from ab_sim.drive.accuracy.deviation import Samples

ABSOLUTE = 0.01
"""Absolute tolerance, divided by the relative tolerance and the state's magnitude."""


class IntervalOutcome(NamedTuple):
    """Result of integrating one leg."""

    states: np.ndarray
    """States on the leg's grid, shape (times, states)."""
    evaluations: int


LegSolver = Callable[[SmoothInterval, np.ndarray, float, np.ndarray], IntervalOutcome]
"""Function of a leg, the state at its begin, and relative and absolute tolerances.

It raises FailedError if it cannot finish.
"""


class ByTolerance:
    """Integrator at one relative tolerance.

    Args:
        f: right-hand side of the scene.
        with_energy_balance: factory of the right-hand side with an energy balance, called only by
            ``energy_error``; None if the scene has no energy balance.
        name: name of the integrator.
        solver: function that integrates a leg.
        tolerance: relative tolerance.
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
        """Do nothing: no state is kept between runs."""

    def run(self) -> np.ndarray:
        """Return the states at the sample times."""
        return self._run(self.f)

    def samples(self, kept: np.ndarray) -> Samples:
        """Convert the states to samples."""
        return self.f.samples(kept)

    def energy_error(self) -> float | None:
        """Return the energy balance's error, from a run that integrates its states too."""
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
            # Solvers may return a transposed array, but compiled code reads contiguous memory.
            state = np.ascontiguousarray(states[-1])
            kept.append(states[leg.keep])
            evaluations += more
        self.evaluations = evaluations
        return np.concatenate(kept)
