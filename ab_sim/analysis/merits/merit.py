"""A merit, declared once: for reports, tables, pages of the documentation and comparisons.

A run is judged by those of ``declared.Merits``, and by what a program registers.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum, IntEnum
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, NoReturn, TypeVar, cast, overload

import numpy as np

from ab_sim.errors import InputError, nearest
from ab_sim.scene.model import Scene

T = TypeVar("T")

NOTHING, NO = "-", "no"
"""In a table: there is nothing to say; what was looked for is not there."""


class Better(str, Enum):
    """Which values of a merit are wanted; false is smaller than true."""

    SMALLER = "smaller"
    LARGER = "larger"
    NEITHER = "neither"
    """It describes a run, and judges nothing."""


class MeritKind(str, Enum):
    """What a merit's value is, where it is not null."""

    NUMBER = "number"
    TRUTH = "true or false"
    WORDS = "words"
    STRUCTURE = "structure"
    """A list or more; it cannot be averaged, or drawn over a parameter."""


class WhirlScale(NamedTuple):
    """How a whirl is shown."""

    factor: float
    """Turns m into the unit."""
    unit: str
    symbol: str
    """For the head of a row."""
    suffix: str = ""
    """Behind a number in a cell; empty where the row's head says the unit."""


class Place(IntEnum):
    """Where in the terminal's table a row stands; those of one place as they were declared."""

    AMOUNT = 0
    COURSE = 1
    END = 2


class Row(NamedTuple):
    """A row of the tables for people: a cell for each run."""

    label: str
    """``{W}`` in it stands for the whirl's symbol."""
    text: Callable[[Any, WhirlScale], str]
    """From the run's merits to the cell."""
    applies: Callable[[Scene], bool] | None = None
    """In the terminal: for which scenes it is shown. None: where a run has something to say."""
    place: Place = Place.AMOUNT
    in_reports: bool = True
    """Whether reports of recordings show it; they leave out what no run has."""
    note: str = ""
    """Explains the row below the terminal's table."""
    caution: str = ""
    """Of runs of which the cell says something: what to bear in mind. It begins in lower case."""

    def head(self, symbol: str) -> str:
        """Its label, with the whirl's symbol."""
        return self.label.replace("{W}", symbol)

    def says(self, cells: Iterable[str]) -> bool:
        """Whether one of its cells says something."""
        return any(cell not in (NOTHING, NO) for cell in cells)


class Relative(NamedTuple):
    """The share of a merit in that of the run without balls."""

    key: str
    label: str


class MeritInWords(NamedTuple):
    """What a merit is, in words, for lists and pages."""

    name: str
    """Its key in reports."""
    unit: str
    """As reports give it; "-" of what is no number."""
    better: str
    """smaller, larger or neither."""
    kind: str
    """number, true or false, words, structure."""
    meaning: str
    equation: str
    taken_by: str
    """Commands that take the name: all, or run alone."""


def _as_it_is(value: Any) -> object:
    return value


@dataclass(frozen=True, eq=False)
class Merit(Generic[T]):
    """A number, or something else, that a run is judged by.

    As an attribute of a class of ``MeritValues`` it is registered, and is the run's value.
    """

    key: str
    """Name in reports."""
    unit: str
    """As reports give it: SI, "mm/s" of values in m/s, "e" of such in m, "1" of what has no
    dimension, "-" of what is no number."""
    meaning: str
    equation: str
    """One line, symbols as in docs/conventions.md; empty where a program gave none."""
    watch: type[Any]
    """Looks at runs; see ``judging``."""
    find: Callable[[Any], Sequence[T] | np.ndarray]
    """Takes the values of all runs from the watch."""
    row: Row | None = None
    better: Better = Better.NEITHER
    kind: MeritKind = MeritKind.NUMBER
    plain: Callable[[Any], object] = _as_it_is
    """Makes the value JSON-able."""
    relative: Relative | None = None
    reported: bool = True
    """Whether it stands in reports; others serve texts and pictures."""
    stepwise: bool = False
    """Whether it is the time of a sample, which jumps from one to the next."""
    of_balanced: bool = False
    """Whether its values are worth comparing among balanced runs only."""

    def __set_name__(self, owner: type[Any], name: str) -> None:
        register(self)

    @overload
    def __get__(self, instance: None, owner: type[Any]) -> "Merit[T]": ...

    @overload
    def __get__(self, instance: "MeritValues", owner: type[Any]) -> T: ...

    def __get__(self, instance: "MeritValues | None", owner: type[Any]) -> "Merit[T] | T":
        return self if instance is None else instance.of(self)

    def values(self, watch: Any) -> list[T]:
        """Of all runs that a watch has looked at, in plain Python's kinds."""
        found = self.find(watch)
        return cast(list[T], found.tolist() if isinstance(found, np.ndarray) else list(found))

    @property
    def scalar(self) -> bool:
        """Whether reports give a number, true or false, or null: what can be compared by size."""
        return self.kind in (MeritKind.NUMBER, MeritKind.TRUTH)

    @property
    def not_a_number(self) -> str:
        """Why a merit that is not ``scalar`` cannot be compared or drawn, in words."""
        what = "a text" if self.kind is MeritKind.WORDS else "a list"
        return f"is {what}, not a number; `ab-sim merits` says which are"

    def described(self) -> list[MeritInWords]:
        """In words: itself, and then its share in that of the run without balls, if it has one."""
        better, kind = self.better.value, self.kind.value
        taken_by = "sweep, tune, robust" if self.scalar else "run only"
        own = MeritInWords(self.key, self.unit, better, kind, self.meaning, self.equation, taken_by)
        if self.relative is None:
            return [own]
        meaning = (
            f"{self.key} in that of the run without balls, which `ab-sim run` makes beside; null "
            "if that is 0 or cannot run"
        )
        equation = f"{self.key} / {self.key} without balls"
        return [
            own,
            MeritInWords(self.relative.key, "1", better, kind, meaning, equation, "run only"),
        ]

    def as_reported(self, value: Any, eccentricity: float) -> object:
        """A value as JSON-able one: a whirl in e [m], None if that is 0."""
        if value is None:
            return None
        if self.unit == "e":
            return value / eccentricity if eccentricity > 0 else None
        if self.unit == "mm/s":
            return 1e3 * value
        return self.plain(value)

    def all_as_reported(self, values: list[T], eccentricities: np.ndarray) -> list[Any]:
        """Values of runs, each as ``as_reported`` has it.

        Args:
            values: of each run.
            eccentricities: e of each [m], shape (runs,).
        """
        if self.plain is _as_it_is and self.unit not in ("e", "mm/s"):
            return list(values)
        if self.unit == "e" and None not in values and np.all(eccentricities > 0.0):
            found: list[Any] = (np.array(values, float) / eccentricities).tolist()
            return found
        each = zip(values, eccentricities.tolist(), strict=True)
        return [self.as_reported(value, e) for value, e in each]


_merits: dict[str, Merit[Any]] = {}


def register(merit: Merit[T]) -> Merit[T]:
    """Make a merit known; returns it.

    Raises:
        ValueError: another one has the key.
    """
    if merit.key in _merits:
        raise ValueError(f"merit {merit.key!r} is registered twice")
    _merits[merit.key] = merit
    return merit


def reported_merits() -> list[Merit[Any]]:
    """All that stand in reports, in their order."""
    return [merit for merit in _merits.values() if merit.reported]


def described_merits(name: str | None = None) -> list[MeritInWords]:
    """In words, all that stand in reports, in their order; or the one of that name.

    Raises:
        InputError: there is none of that name; names the nearest, and all.
    """
    found = [each for merit in reported_merits() for each in merit.described()]
    if name is None:
        return found
    named = [each for each in found if each.name == name]
    if not named:
        raise _unknown(name, [each.name for each in found])
    return named


def merits_named(keys: Iterable[str] | None) -> list[Merit[Any]]:
    """Those of these keys; all, others than reported ones too, if None.

    Raises:
        InputError: there is none of that key; names the nearest, and all.
    """
    if keys is None:
        return list(_merits.values())
    if isinstance(keys, str):
        raise InputError(f"keys = {keys!r}: must be a list of names; write [{keys!r}]")
    return [_named(key) for key in keys]


def _named(key: str) -> Merit[Any]:
    if key in _merits:
        return _merits[key]
    for merit in _merits.values():
        if merit.relative is not None and merit.relative.key == key:
            raise InputError(
                f"merit {key!r}: compares with a run without balls, which only `ab-sim run` makes; "
                f"use {merit.key}"
            )
    raise _unknown(key, [merit.key for merit in reported_merits()])


def _unknown(name: str, known: list[str]) -> InputError:
    return InputError(
        f"merit {name!r}: no such merit{nearest(name, known)}; there are: {', '.join(known)}"
    )


class MeritValues:
    """What merits are in one run.

    Args:
        values: by key, whirls in m.
        eccentricity: e of the scene [m].
    """

    def __init__(self, values: Mapping[str, object], eccentricity: float) -> None:
        self.values: Mapping[str, object] = dict(values)
        """By key, whirls in m."""
        self._eccentricity = eccentricity

    def of(self, merit: Merit[T]) -> T:
        """Of a merit: SI units.

        Raises:
            InputError: the run was not judged by it.
        """
        if merit.key not in self.values:
            raise InputError(
                f"merit {merit.key!r}: this run was not judged by it, but by: "
                + ", ".join(self.values)
            )
        return cast(T, self.values[merit.key])

    def __getitem__(self, key: str) -> object:
        """A merit as ``report`` gives it, by its key.

        Raises:
            InputError: there is none of that key, or the run was not judged by it.
        """
        merit = _named(key)
        return merit.as_reported(self.of(merit), self._eccentricity)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, MeritValues) and self.values == other.values

    def __repr__(self) -> str:
        # By keys, which are not the attributes' names, and in the keys' units.
        return f"{type(self).__name__}({self.report()!r})"

    if not TYPE_CHECKING:  # to which each name would be an attribute

        def __getattr__(self, name: str) -> NoReturn:
            hint = f"; write merits[{name!r}]" if name in _merits else ""
            raise AttributeError(f"{type(self).__name__!r} has no attribute {name!r}{hint}")

    def report(self, eccentricity: float | None = None) -> dict[str, object]:
        """As JSON-able values, by key: whirl in eccentricities.

        Args:
            eccentricity: e [m]; None: the scene's. If it is 0, whirl in it is None.
        """
        e = self._eccentricity if eccentricity is None else eccentricity
        return {
            key: merit.as_reported(value, e)
            for key, value in self.values.items()
            if (merit := _named(key)).reported
        }

    def cautions(self) -> list[str]:
        """What to bear in mind of this run."""
        rows = [merit.row for merit in map(_named, self.values) if merit.row is not None]
        anyhow = WhirlScale(1.0, "m", "W")
        return [row.caution for row in rows if row.caution and row.says([row.text(self, anyhow)])]
