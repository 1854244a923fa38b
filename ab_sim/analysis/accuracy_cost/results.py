"""Results of a study."""

import importlib.metadata
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

from ab_sim.analysis.accuracy_cost.reference import EQUATIONS
from ab_sim.analysis.effect_cost import Quartiles, conditions
from ab_sim.base.presentation import Column, Columns, Presented
from ab_sim.drive.accuracy.trials import Deviation


class ErrorBound(NamedTuple):
    """Error, or its upper bound if it is within the reference's uncertainty."""

    value: float
    """Error, or the uncertainty if that is larger."""
    at_most: bool
    """True if the value is only an upper bound."""

    @classmethod
    def of(cls, error: float, uncertainty: float) -> "ErrorBound":
        """Return the bound for an error against a reference with this uncertainty, in its unit."""
        return cls(max(error, uncertainty), error <= uncertainty)

    def __str__(self) -> str:
        return f"{'<= ' if self.at_most else ''}{self.value:.1e}"


class RunErrors(NamedTuple):
    """Errors of one run: the largest during the run, and those at its last sample."""

    angle: ErrorBound
    """Largest error of any ball's angle, over the run [rad]."""
    whirl: ErrorBound
    """Largest error of the deck's displacement, over the run [e]."""
    angle_end: ErrorBound
    """Error of the balls' angles at the end [rad]."""
    whirl_end: ErrorBound
    """Error of the deck's displacement at the end [e]."""
    energy: float | None
    """Relative error of the energy balance over the run; None without a balance."""

    @classmethod
    def of(cls, deviation: Deviation, uncertainty: Deviation, energy: float | None) -> "RunErrors":
        """Return the errors of a run.

        Parameters
        ----------
        deviation
            Deviation from the reference.
        uncertainty
            Uncertainty of the reference.
        energy
            Relative error of the energy balance; None without a balance.
        """
        angle, whirl, angle_end, whirl_end = map(ErrorBound.of, deviation, uncertainty)
        return cls(angle, whirl, angle_end, whirl_end, energy)


class SettingCost(NamedTuple):
    """Cost and errors of a method at one setting."""

    method: str
    """Display name of the method."""
    peer: bool
    """True if the method is another package's."""
    step: float | None
    """Step [s]; None for methods that choose their steps by a tolerance."""
    tolerance: float | None
    """Relative tolerance; None for fixed steps."""
    errors: RunErrors | None
    """Errors; None if the method failed."""
    cpu: Quartiles | None
    """CPU seconds per simulated second: the fraction of a core that a run in real time takes."""
    repeats: int
    """Number of timed runs; fewer than requested if a run takes long."""
    evaluations: float | None
    """Evaluations of the right-hand side per simulated second, for peers that count them."""
    failure: str = ""
    """Error message of a method that failed; otherwise empty."""

    @property
    def setting(self) -> str:
        """Step or tolerance as text."""
        if self.step is not None:
            return f"{1e3 * self.step:g} ms"
        return f"rtol {self.tolerance:g}"

    def report(self) -> dict[str, Any]:
        """Return the row as JSON-able values."""
        errors = None
        if self.errors is not None:
            bounds = {
                name: bound._asdict() if isinstance(bound, ErrorBound) else bound
                for name, bound in self.errors._asdict().items()
            }
            errors = bounds
        cpu = None if self.cpu is None else self.cpu._asdict()
        return {**self._asdict(), "errors": errors, "cpu": cpu}


class OmittedMethod(NamedTuple):
    """Method, or a method at one setting, that was not measured."""

    method: str
    """Name of the method, with its settings if only those were not measured."""
    reason: str
    """Reason why there are no measurements, in words."""


@dataclass(frozen=True, repr=False)
class AccuracyCost(Presented):
    """Study of one scene; see ``ab_sim.accuracy_cost``."""

    _picture = "accuracy_cost"

    scene: str
    """Name of the scene."""
    effects: tuple[str, ...]
    """Effects of the scene."""
    balls: int
    """Number of balls."""
    duration: float
    """Time that was simulated and compared [s]."""
    period: float
    """Period of the samples at which all methods are compared [s]."""
    reference_period: float
    """Period of the reference's samples [s]; steppers are compared at all of those where a step
    ends."""
    unit_length: float
    """Unit of errors in whirl [m]: e, or the race's radius for a rotor without unbalance."""
    unit: str
    """Symbol of ``unit_length``, e or R."""
    as_scene_says: str
    """Stepper and step that the unchanged scene uses, as text."""
    reference: str
    """Description of the reference solution."""
    reference_shares: tuple[str, ...]
    """Code that the reference shares with the package's methods."""
    uncertainty: Deviation
    """Uncertainty of the reference's integration, not of the equations."""
    repeats: int
    """Requested number of timed runs per setting."""
    rows: tuple[SettingCost, ...]
    """Cost and errors, one row per method and setting."""
    omitted: tuple[OmittedMethod, ...]
    """Methods and settings that were not measured, with reasons."""
    notes: tuple[str, ...]
    """Notes on the conditions of the study, for the user."""

    @property
    def independent(self) -> bool:
        """True if the reference shares only the equations with the methods it judges."""
        return self.reference_shares == EQUATIONS

    def by_error(self) -> list[SettingCost]:
        """Return all rows that ran, sorted by error, then by CPU time."""
        return sorted((row for row in self.rows if row.errors and row.cpu), key=self._order)

    def error_of(self, row: SettingCost) -> float:
        """Return the error for comparison: in ball angle [rad], without balls in whirl [e]."""
        assert row.errors is not None
        return (row.errors.angle if self.balls else row.errors.whirl).value

    def front(self) -> list[SettingCost]:
        """Return the Pareto front of error and CPU time, the most accurate row first."""
        best: list[SettingCost] = []
        for row in self.by_error():
            assert row.cpu is not None
            if not best or row.cpu.median < _median(best[-1]):
                best.append(row)
        return best

    def cheapest(self, error: float, peer: bool | None = None) -> SettingCost | None:
        """Return the row with the least CPU time and at most this error; None if there is none.

        Parameters
        ----------
        error
            Error in ball angle [rad]; without balls in whirl [e].
        peer
            True for peers only, False for this package's methods only, None for both.
        """
        accurate = [
            row
            for row in self.by_error()
            if self.error_of(row) <= error and peer in (None, row.peer)
        ]
        return min(accurate, key=_median, default=None)

    def _facts(self) -> dict[str, str]:
        front = self.front()
        facts = {"scene": self.scene, "settings": str(len(self.by_error()))}
        if front:
            unit = "rad" if self.balls else self.unit
            facts["least error"] = f"{self.error_of(front[0]):.2g} {unit}"
            facts["by"] = f"{front[0].method} at {front[0].setting}"
        return facts

    def _columns(self) -> Columns:
        rows = [
            (row, row.errors, row.cpu)
            for row in self.by_error()
            if row.errors is not None and row.cpu is not None
        ]
        return {
            "method": Column(None, [row.method for row, _, _ in rows]),
            "peer": Column(None, [row.peer for row, _, _ in rows]),
            "step": Column("s", [row.step for row, _, _ in rows]),
            "tolerance": Column("1", [row.tolerance for row, _, _ in rows]),
            "cpu": Column("s/s", [cpu.median for _, _, cpu in rows]),
            "angle_error": Column("rad", [errors.angle.value for _, errors, _ in rows]),
            "whirl_error": Column(self.unit, [errors.whirl.value for _, errors, _ in rows]),
        }

    def report(self) -> dict[str, object]:
        """Return the study as JSON-able values, with machine, versions and date."""
        measured = conditions()
        measured["versions"].update(peer_versions())
        return {
            **measured,
            **{field.name: getattr(self, field.name) for field in fields(self)},
            "reference_independent": self.independent,
            "uncertainty": self.uncertainty._asdict(),
            "rows": [row.report() for row in self.rows],
            "left_out": [omission._asdict() for omission in self.omitted],
        }

    def _order(self, row: SettingCost) -> tuple[float, float]:
        """Return the sort key of a row: its error, then its CPU time."""
        return self.error_of(row), _median(row)


def _median(row: SettingCost) -> float:
    """Return the median CPU seconds per simulated second of a row that ran."""
    assert row.cpu is not None
    return row.cpu.median


def peer_versions() -> dict[str, str]:
    """Return the versions of the installed peers, by distribution name."""
    installed = {}
    for name in ("scipy", "scikit-sundae", "mujoco"):
        try:
            installed[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            continue
    return installed
