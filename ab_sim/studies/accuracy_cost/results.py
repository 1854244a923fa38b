"""What a study found."""

import importlib.metadata
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

from ab_sim.accuracy.deviation import Deviation
from ab_sim.presentation import Column, Columns, Presented
from ab_sim.studies.accuracy_cost.reference import EQUATIONS
from ab_sim.studies.effect_cost import Quartiles, conditions


class ErrorBound(NamedTuple):
    """An error, or what it is at most, where the reference itself is no better."""

    value: float
    at_most: bool

    @classmethod
    def of(cls, error: float, uncertainty: float) -> "ErrorBound":
        """An error that was seen against a reference of that uncertainty."""
        return cls(max(error, uncertainty), error <= uncertainty)

    def __str__(self) -> str:
        return f"{'<= ' if self.at_most else ''}{self.value:.1e}"


class RunErrors(NamedTuple):
    """Of one run, over the run and at its end."""

    angle: ErrorBound
    """Of any ball's angle, over the run [rad]."""
    whirl: ErrorBound
    """Of the deck's displacement, over the run [e]."""
    angle_end: ErrorBound
    """As ``angle``, at the end."""
    whirl_end: ErrorBound
    """As ``whirl``, at the end."""
    energy: float | None
    """Of the energy balance over the run, relative; None where no energy balance is kept."""

    @classmethod
    def of(cls, found: Deviation, uncertainty: Deviation, energy: float | None) -> "RunErrors":
        """From what was seen."""
        angle, whirl, angle_end, whirl_end = map(ErrorBound.of, found, uncertainty)
        return cls(angle, whirl, angle_end, whirl_end, energy)


class SettingCost(NamedTuple):
    """One method at one setting."""

    method: str
    peer: bool
    """Whether it is not the package's."""
    step: float | None
    """s; None for methods that choose their steps by a tolerance."""
    tolerance: float | None
    """Relative; None for fixed steps."""
    errors: RunErrors | None
    """None where it failed."""
    cpu: Quartiles | None
    """CPU seconds per simulated second, which is the fraction of one core that real time takes."""
    repeats: int
    """Runs timed; fewer than asked for where one takes long."""
    evaluations: float | None
    """Of the right-hand side per simulated second, for peers that count them."""
    failure: str = ""

    @property
    def setting(self) -> str:
        """Step or tolerance, for people."""
        if self.step is not None:
            return f"{1e3 * self.step:g} ms"
        return f"rtol {self.tolerance:g}"

    def report(self) -> dict[str, Any]:
        """As JSON-able values."""
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
    """A method, or a setting of it, that was not measured."""

    method: str
    reason: str


@dataclass(frozen=True, repr=False)
class AccuracyCost(Presented):
    """The study of one scene; see ``ab_sim.accuracy_cost``."""

    _picture = "accuracy_cost"

    scene: str
    effects: tuple[str, ...]
    balls: int
    duration: float
    """What was simulated and compared [s]."""
    period: float
    """Between samples of peers that were compared [s]; also of steppers, whose steps do not end at
    the reference's other instants."""
    reference_period: float
    """Between instants of the reference [s]: steppers are compared at those at which a step ends.
    """
    unit_length: float
    """m, of errors in whirl: e, or the race's radius for a rotor without unbalance."""
    unit: str
    """Its symbol, e or R."""
    as_scene_says: str
    """The stepper that the scene itself takes, and its step."""
    reference: str
    reference_shares: tuple[str, ...]
    """What the reference has in common with the package's methods."""
    uncertainty: Deviation
    """Of the reference: of its integration, not of the equations."""
    repeats: int
    rows: tuple[SettingCost, ...]
    omitted: tuple[OmittedMethod, ...]
    notes: tuple[str, ...]

    @property
    def independent(self) -> bool:
        """Whether the reference has no more than the equations in common with what it judges."""
        return self.reference_shares == EQUATIONS

    def by_error(self) -> list[SettingCost]:
        """All that ran, the most accurate first, and among equals the cheapest."""
        return sorted((row for row in self.rows if row.errors and row.cpu), key=self._order)

    def error_of(self, row: SettingCost) -> float:
        """What rows are compared by: the ball angle's largest error, without balls the whirl's."""
        assert row.errors is not None
        return (row.errors.angle if self.balls else row.errors.whirl).value

    def front(self) -> list[SettingCost]:
        """Rows that no other one beats at both error and time, the most accurate first."""
        best: list[SettingCost] = []
        for row in self.by_error():
            assert row.cpu is not None
            if not best or row.cpu.median < _median(best[-1]):
                best.append(row)
        return best

    def cheapest(self, error: float, peer: bool | None = None) -> SettingCost | None:
        """The row with the least CPU time that has at most this error; None if there is none.

        Args:
            error: rad, or in whirl [e] without balls.
            peer: only peers, or only the package's; None for both.
        """
        good = [
            row
            for row in self.by_error()
            if self.error_of(row) <= error and peer in (None, row.peer)
        ]
        return min(good, key=_median, default=None)

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
        """As JSON-able values, with where and when it was measured."""
        where = conditions()
        where["versions"].update(peer_versions())
        return {
            **where,
            **{each.name: getattr(self, each.name) for each in fields(self)},
            "reference_independent": self.independent,
            "uncertainty": self.uncertainty._asdict(),
            "rows": [row.report() for row in self.rows],
            "left_out": [each._asdict() for each in self.omitted],
        }

    def _order(self, row: SettingCost) -> tuple[float, float]:
        return self.error_of(row), _median(row)


def _median(row: SettingCost) -> float:
    assert row.cpu is not None
    return row.cpu.median


def peer_versions() -> dict[str, str]:
    """Versions of the peers that are installed."""
    found = {}
    for name in ("scipy", "scikit-sundae", "mujoco"):
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            continue
    return found
