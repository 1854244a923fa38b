"""Results of functions that combine several analyses."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ab_sim.analysis.equilibria import Equilibria
from ab_sim.analysis.equilibria.over_speed import OverSpeed
from ab_sim.analysis.floquet import Stability
from ab_sim.base.errors import InputError
from ab_sim.base.presentation import Column, Columns, Presented, drawn, ends, number
from ab_sim.scene.model import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False)
class BranchesOverSpeed(Presented):
    """Resting states over the spindle's speed; see ``ab_sim.branches``."""

    scene: Scene
    at_speed: Equilibria
    """Equilibria at the speed that the picture marks."""
    over_speed: OverSpeed
    """Branches, folds, crossings of the border of stability, and ranges without stable states."""

    def plot(self) -> Figure:
        """Draw W and ball angles of all branches over speed.

        Returns
        -------
        matplotlib.figure.Figure
            The figure of ``ab-sim equilibria --plot``.
        """
        return drawn("branches", self.scene, self.at_speed, self.over_speed)

    def report(self) -> dict[str, object]:
        """Return JSON-able values: ``over_speed`` of ``ab-sim equilibria --json``."""
        return dict(self.over_speed.report())

    def _facts(self) -> dict[str, str]:
        over_speed = self.over_speed
        unstable = ", ".join(
            f"{low:.4g} to {high:.4g}" for low, high in over_speed.without_stable_state
        )
        return {
            "scene": self.scene.name,
            "speeds": ends(*over_speed.speeds, "rad/s"),
            "branches": str(len(over_speed.intervals)),
            "folds": str(len(over_speed.folds)),
            "nothing stable": f"{unstable} rad/s" if unstable else "nowhere",
        }

    def _columns(self) -> Columns:
        """Return a row for each computed speed of a branch."""
        rows = [
            (interval.label, float(speed), state)
            for interval in self.over_speed.intervals
            for speed, state in zip(interval.speeds, interval.states, strict=True)
        ]
        return {
            "label": Column(None, [label for label, _, _ in rows]),
            "speed": Column("rad/s", [speed for _, speed, _ in rows]),
            "W": Column("m", [state.W for _, _, state in rows]),
            "lambda_max": Column("1/s", [state.lambda_max for _, _, state in rows]),
            "stable": Column(None, [state.stable for _, _, state in rows]),
            "theta": Column("rad", [tuple(state.theta) for _, _, state in rows]),
        }


@dataclass(frozen=True, repr=False)
class PeriodicSolutions(Presented):
    """Motions that repeat with every turn of the spindle; see ``ab_sim.floquet``.

    It is a sequence of solutions, each with its ``multipliers``, ``verdict`` and ``orbit``.
    """

    scene: Scene
    speed: float
    """Constant speed of the spindle [rad/s]."""
    solutions: tuple[Stability, ...]
    """Distinct solutions; if it is empty, none was found, but some may exist."""

    def __len__(self) -> int:
        return len(self.solutions)

    def __iter__(self) -> Iterator[Stability]:
        return iter(self.solutions)

    def __getitem__(self, index: int) -> Stability:
        return self.solutions[index]

    @property
    def stable(self) -> tuple[Stability, ...]:
        """Stable solutions, to which nearby motions return."""
        return tuple(solution for solution in self.solutions if solution.stable)

    def plot(self) -> Figure:
        """Draw the multipliers in the complex plane, and the unit circle.

        Returns
        -------
        matplotlib.figure.Figure
            The figure of ``ab-sim floquet --plot``.

        Raises
        ------
        InputError
            There is no solution to draw.
        """
        if not self.solutions:
            raise InputError(f"{self.scene.name}: no periodic solution was found; none to draw")
        return drawn("periodic_solutions", self.solutions)

    def report(self) -> list[dict[str, object]]:
        """Return JSON-able values, one mapping for each: see docs/reference/json.md."""
        return [dict(solution.report()) for solution in self.solutions]

    def _facts(self) -> dict[str, str]:
        return {
            "scene": self.scene.name,
            "speed": number(self.speed, "rad/s"),
            "solutions": "; ".join(
                f"{solution.found_from}: {solution.verdict}, largest {solution.largest:.6g}"
                for solution in self
            )
            or "none found",
        }

    def _columns(self) -> Columns:
        solutions: Sequence[Stability] = self.solutions
        return {
            "found_from": Column(None, [one.found_from for one in solutions]),
            "verdict": Column(None, [one.verdict for one in solutions]),
            "largest": Column("1", [one.largest for one in solutions]),
            "balanced": Column(None, [one.balanced for one in solutions]),
            "whirl_min": Column("m", [one.whirl[0] for one in solutions]),
            "whirl_max": Column("m", [one.whirl[1] for one in solutions]),
            "ball_angles": Column("rad", [tuple(one.angles.tolist()) for one in solutions]),
        }
