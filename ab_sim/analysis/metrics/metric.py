"""Declaration of metrics for reports, tables, documentation pages and comparisons.

A run is evaluated with the metrics of ``declared.Metrics`` and with those that a program registers.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum, IntEnum
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, NoReturn, TypeVar, cast, overload

import numpy as np

from ab_sim.base.errors import InputError, nearest
from ab_sim.base.named_entries import NamedEntries
from ab_sim.base.plug_ins import load_installed
from ab_sim.scene.model import Scene
from ab_sim.scene.units import ShownUnit

T = TypeVar("T")

NOTHING, NO = "-", "no"
"""Table cells: no value available, and an event that did not occur."""


class Better(str, Enum):
    """Preferred values of a metric; false counts as smaller than true."""

    SMALLER = "smaller"
    LARGER = "larger"
    NEITHER = "neither"
    """No preference: the metric only describes a run."""


class MetricKind(str, Enum):
    """Type of a metric's value, which may also be null."""

    NUMBER = "number"
    TRUTH = "true or false"
    WORDS = "words"
    STRUCTURE = "structure"
    """List or other structure, which cannot be averaged or plotted over a parameter."""


class Quantity(NamedTuple):
    """Quantity of a row's numbers: its SI unit, and the unit for display."""

    si: str
    """SI unit of the values."""
    shown: ShownUnit
    """Default unit for display."""


class Display(NamedTuple):
    """Units in which metrics are displayed; the first four fields are the whirl's."""

    factor: float
    """Factor from m to the whirl's unit."""
    unit: str
    """Unit of the whirl, as text."""
    symbol: str
    """Symbol of the whirl in the head of a row."""
    suffix: str = ""
    """Text after a number in a cell; empty if the row's head has the unit."""
    units: Mapping[str, ShownUnit] = {}
    """Requested units of other quantities, by SI unit."""

    def of(self, quantity: Quantity) -> ShownUnit:
        """Return the unit in which a quantity is displayed."""
        return self.units.get(quantity.si, quantity.shown)


DEFAULT_UNITS = Display(1.0, "m", "W")
"""Display with whirls in m; other quantities have their default units."""


class Place(IntEnum):
    """Section of a row in the terminal's table; within a section rows keep their order."""

    AMOUNT = 0
    COURSE = 1
    END = 2


class Row(NamedTuple):
    """Row of a table for users, with a cell per run."""

    label: str
    """Label; ``{W}`` in it stands for the symbol of the whirl."""
    text: Callable[[Any, Display], str]
    """Function that returns the cell's text for a run's metrics."""
    applies: Callable[[Scene], bool] | None = None
    """Condition on a scene for the row in the terminal; None shows it if any cell has content."""
    place: Place = Place.AMOUNT
    """Section of the row."""
    in_reports: bool = True
    """True if reports of recordings have the row; they leave out rows without content."""
    note: str = ""
    """Explanation of the row, printed below the terminal's table."""
    caution: str = ""
    """Caution for runs with content in this cell; starts in lower case."""
    quantity: Quantity | None = None
    """Quantity whose unit stands after the label; None if the cells have their units."""

    def head(self, display: Display) -> str:
        """Return the row's label with the whirl's symbol and the unit in brackets."""
        head = self.label.replace("{W}", display.symbol)
        return head if self.quantity is None else f"{head} [{display.of(self.quantity).text}]"

    def has_content(self, cells: Iterable[str]) -> bool:
        """Return whether any cell of the row has content, not just ``NOTHING`` or ``NO``."""
        return any(cell not in (NOTHING, NO) for cell in cells)


class Relative(NamedTuple):
    """Ratio of a metric to the metric of the run without balls."""

    key: str
    """Name in reports."""
    label: str
    """Label of the row in tables."""


class MetricInWords(NamedTuple):
    """Description of a metric for lists and pages."""

    name: str
    """Key in reports."""
    unit: str
    """Unit in reports; "-" if the value is not a number."""
    better: str
    """Preference: smaller, larger or neither."""
    kind: str
    """Type: number, true or false, words, structure."""
    meaning: str
    """Meaning in a sentence."""
    equation: str
    """Equation in one line; empty if not given."""
    taken_by: str
    """Commands that accept the name: all, or only ``run``."""


def _as_it_is(value: Any) -> object:
    """Return a value that is JSON-able already."""
    return value


@dataclass(frozen=True, eq=False)
class Metric(Generic[T]):
    """Metric of a run.

    A descriptor: assigned in a subclass of ``MetricValues``, it registers the metric, and reading
    the attribute returns the run's value.
    """

    key: str
    """Name in reports."""
    unit: str
    """Unit in reports.

    SI unit; "mm/s" for values in m/s, "e" for values in m, "1" for dimensionless values, "-" for
    values that are not numbers.
    """
    meaning: str
    """Meaning in a sentence, for lists."""
    equation: str
    """Equation in one line, symbols as in docs/conventions.md; empty if not given."""
    accumulator: type[Any]
    """Class of the accumulator that computes the metric; see ``judging``."""
    find: Callable[[Any], Sequence[T] | np.ndarray]
    """Function that takes the values of all runs from the accumulator."""
    row: Row | None = None
    """Row in tables; None for no row."""
    better: Better = Better.NEITHER
    """Preferred values."""
    kind: MetricKind = MetricKind.NUMBER
    """Type of the values."""
    plain: Callable[[Any], object] = _as_it_is
    """Function that makes the value JSON-able."""
    relative: Relative | None = None
    """Ratio to the run without balls; None if it is not reported."""
    reported: bool = True
    """True if reports have the metric; others are used in texts and pictures."""
    stepwise: bool = False
    """True if the value is the time of a sample, which changes in steps."""
    of_balanced: bool = False
    """True if the metric can be compared among balanced runs only."""

    def __set_name__(self, owner: type[Any], name: str) -> None:
        METRICS.add(self.key, self)

    @overload
    def __get__(self, instance: None, owner: type[Any]) -> "Metric[T]": ...

    @overload
    def __get__(self, instance: "MetricValues", owner: type[Any]) -> T: ...

    def __get__(self, instance: "MetricValues | None", owner: type[Any]) -> "Metric[T] | T":
        return self if instance is None else instance.of(self)

    def values(self, accumulator: Any) -> list[T]:
        """Return the values of all runs of an accumulator as plain Python objects."""
        values = self.find(accumulator)
        return cast(list[T], values.tolist() if isinstance(values, np.ndarray) else list(values))

    @property
    def scalar(self) -> bool:
        """True if values can be compared by size: numbers, true or false, or null."""
        return self.kind in (MetricKind.NUMBER, MetricKind.TRUTH)

    @property
    def not_a_number(self) -> str:
        """Reason in words why a metric that is not ``scalar`` cannot be compared or plotted."""
        what = "a text" if self.kind is MetricKind.WORDS else "a list"
        return f"is {what}, not a number; `ab-sim metrics` lists the type of each metric"

    def described(self) -> list[MetricInWords]:
        """Return descriptions of the metric and of its ratio to the run without balls, if any."""
        better, kind = self.better.value, self.kind.value
        taken_by = "sweep, tune, robust" if self.scalar else "run only"
        description = MetricInWords(
            self.key, self.unit, better, kind, self.meaning, self.equation, taken_by
        )
        if self.relative is None:
            return [description]
        meaning = (
            f"{self.key} relative to the run without balls, which `ab-sim run` also computes; null "
            "if that value is 0 or the run fails"
        )
        equation = f"{self.key} / {self.key} without balls"
        return [
            description,
            MetricInWords(self.relative.key, "1", better, kind, meaning, equation, "run only"),
        ]

    def as_reported(self, value: Any, eccentricity: float) -> object:
        """Return a JSON-able value in the metric's unit.

        Parameters
        ----------
        value
            Value in SI units; None stays None.
        eccentricity
            Eccentricity e [m]; if it is 0, a whirl in e is None.
        """
        if value is None:
            return None
        if self.unit == "e":
            return value / eccentricity if eccentricity > 0 else None
        if self.unit == "mm/s":
            return 1e3 * value
        return self.plain(value)

    def all_as_reported(self, values: list[T], eccentricities: np.ndarray) -> list[Any]:
        """Return JSON-able values of runs, see ``as_reported``.

        Parameters
        ----------
        values
            Value of each run.
        eccentricities
            Eccentricity e of each run [m], shape (runs,).
        """
        if self.plain is _as_it_is and self.unit not in ("e", "mm/s"):
            return list(values)
        if self.unit == "e" and None not in values and np.all(eccentricities > 0.0):
            reported: list[Any] = (np.array(values, float) / eccentricities).tolist()
            return reported
        pairs = zip(values, eccentricities.tolist(), strict=True)
        return [self.as_reported(value, e) for value, e in pairs]


METRICS = NamedEntries[Metric[Any]]("metric")
"""Registered metrics; ``reported_metrics`` registers those of plug-ins first."""


def reported_metrics() -> list[Metric[Any]]:
    """Return all metrics in reports, in their order."""
    load_installed()
    return [metric for metric in METRICS.values() if metric.reported]


def described_metrics(name: str | None = None) -> list[MetricInWords]:
    """Return descriptions of all metrics in reports, or of the one with this name.

    Raises
    ------
    InputError
        The name is unknown; the message names the nearest, and all.
    """
    metrics = [description for metric in reported_metrics() for description in metric.described()]
    if name is None:
        return metrics
    named = [metric for metric in metrics if metric.name == name]
    if not named:
        raise _unknown(name, [metric.name for metric in metrics])
    return named


def metrics_named(keys: Iterable[str] | None) -> list[Metric[Any]]:
    """Return the metrics with these keys; if None, all metrics, including unreported ones.

    Raises
    ------
    InputError
        A key is unknown; the message names the nearest, and all.
    """
    load_installed()
    if keys is None:
        return list(METRICS.values())
    if isinstance(keys, str):
        raise InputError(f"keys = {keys!r}: must be a list of names; write [{keys!r}]")
    return [_named(key) for key in keys]


def _named(key: str) -> Metric[Any]:
    """Return the metric with a key.

    Raises
    ------
    InputError
        The key is unknown, or that of a ratio, which only ``ab-sim run`` computes.
    """
    if key in METRICS:
        return METRICS[key]
    for metric in METRICS.values():
        if metric.relative is not None and metric.relative.key == key:
            raise InputError(
                f"metric {key!r}: compares with a run without balls, which only `ab-sim run` "
                f"makes; use {metric.key}"
            )
    raise _unknown(key, [metric.key for metric in reported_metrics()])


def _unknown(name: str, names: list[str]) -> InputError:
    """Return the error for an unknown name of a metric; ``names`` are the known ones."""
    return InputError(
        f"metric {name!r}: no such metric{nearest(name, names)}; there are: {', '.join(names)}"
    )


class MetricValues:
    """Values of metrics for one run.

    Parameters
    ----------
    values
        Values by key, whirls in m.
    eccentricity
        Eccentricity e of the scene [m].
    """

    def __init__(self, values: Mapping[str, object], eccentricity: float) -> None:
        self.values: Mapping[str, object] = dict(values)
        """Values by key, whirls in m."""
        self._eccentricity = eccentricity

    def of(self, metric: Metric[T]) -> T:
        """Return the value of a metric in SI units.

        Raises
        ------
        InputError
            The metric was not computed for this run.
        """
        if metric.key not in self.values:
            raise InputError(
                f"metric {metric.key!r}: was not computed for this run, which has: "
                + ", ".join(self.values)
            )
        return cast(T, self.values[metric.key])

    def __getitem__(self, key: str) -> object:
        """Return the reported value of a metric by its key.

        Raises
        ------
        InputError
            The key is unknown, or the metric was not computed for this run.
        """
        metric = _named(key)
        return metric.as_reported(self.of(metric), self._eccentricity)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, MetricValues) and self.values == other.values

    def __repr__(self) -> str:
        # The keys differ from the attributes' names, and their values are in reported units.
        return f"{type(self).__name__}({self.report()!r})"

    if not TYPE_CHECKING:  # a type checker would accept any attribute name

        def __getattr__(self, name: str) -> NoReturn:
            hint = f"; write metrics[{name!r}]" if name in METRICS else ""
            raise AttributeError(f"{type(self).__name__!r} has no attribute {name!r}{hint}")

    def report(self, eccentricity: float | None = None) -> dict[str, object]:
        """Return JSON-able values by key, whirls in units of the eccentricity.

        Parameters
        ----------
        eccentricity
            Eccentricity e [m]; None for the scene's. If it is 0, whirls in e are None.
        """
        e = self._eccentricity if eccentricity is None else eccentricity
        return {
            key: metric.as_reported(value, e)
            for key, value in self.values.items()
            if (metric := _named(key)).reported
        }

    def cautions(self) -> list[str]:
        """Return cautions that apply to this run."""
        rows = [metric.row for metric in map(_named, self.values) if metric.row is not None]
        return [
            row.caution
            for row in rows
            if row.caution and row.has_content([row.text(self, DEFAULT_UNITS)])
        ]
