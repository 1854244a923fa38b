"""Varied keys of a scene with their values, and the points of a sweep over them."""

import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from ab_sim.base.errors import InputError, exact, short
from ab_sim.base.numbers import number_in
from ab_sim.base.yaml_files import read_yaml
from ab_sim.scene.keys import scene_keys
from ab_sim.scene.units import NO_UNIT, has_unit, in_si, with_last_unit

MOST_VALUES = 1_000_000
"""Largest number of values of one key."""
_FORMS = (
    "must be KEY=FROM..TO:COUNT, KEY=log:FROM..TO:COUNT, KEY=FROM..TO (for a design) or "
    "KEY=V,V,..., e.g. balls.mass=0.5g..3g:26"
)


class Range(NamedTuple):
    """Range of values that a design samples."""

    key: str
    """Dotted key."""
    low: float
    high: float
    """Ends of the range, SI, ``low`` and ``high``; both are included."""
    log: bool = False
    """True if values are spaced logarithmically."""
    whole: bool = False
    """True if the key takes whole numbers only."""

    def at(self, shares: np.ndarray) -> np.ndarray:
        """Return values at fractions of the range, shape (n,).

        Parameters
        ----------
        shares
            Fractions from 0 to below 1, shape (n,).
        """
        if self.whole:
            first, count = round(self.low), round(self.high) - round(self.low) + 1
            return first + np.floor(shares * count).astype(np.int64)
        if self.log:
            low, high = math.log(self.low), math.log(self.high)
            return np.exp(low + shares * (high - low))
        return self.low + shares * (self.high - self.low)

    def share(self, value: float) -> float:
        """Return the fraction of the range at a value, the inverse of ``at``.

        Whole numbers are returned unchanged: searches vary them directly.
        """
        if self.whole:
            return value
        if self.log:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)


class ListedValues(NamedTuple):
    """Values of a key, all of which a grid uses."""

    key: str
    """Dotted key."""
    values: tuple[Any, ...]
    """Numbers in SI, or other values that the key accepts."""
    log: bool = False
    """True if pictures show the key on a logarithmic axis."""


Variable = Range | ListedValues


def variable_of(text: str) -> Variable:
    """Parse ``KEY=FROM..TO:COUNT``, ``KEY=log:FROM..TO:COUNT`` or ``KEY=V,V,...``.

    Without a count it is a range for a design. Listed values are YAML, so that a value may be a
    list. If only the last number has a unit, the unit applies to all.

    Raises
    ------
    InputError
        The text is invalid; the message states the fault.
    """
    key, equals, values_text = (part.strip() for part in text.partition("="))
    if not equals or not key or not values_text:
        raise InputError(f"{short(text)}: {_FORMS}")
    log = values_text.startswith("log:")
    low, dots, rest = values_text.removeprefix("log:").partition("..")
    if not dots:
        return values(key, _in_one_unit(text, key, _listed(text, values_text)))
    high, colon, count = rest.partition(":")
    low, high = _with_last_unit(text, [low, high])
    between = range_(key, _number(text, key, low), _number(text, key, high), log)
    return spaced(between, _count(text, count)) if colon else between


def range_(key: str, low: float, high: float, log: bool = False) -> Range:
    """Return a range of a numeric key.

    Parameters
    ----------
    key
        Dotted key.
    low, high
        Ends of the range [SI], both included.
    log
        Whether values are spaced logarithmically.

    Raises
    ------
    InputError
        An end is not allowed; the message names key, value and allowed range.
    """
    whole = _takes_whole_numbers(key)
    text = f"{key}: from {exact(low)} to {exact(high)}"
    largest = sys.float_info.max  # an int may be larger
    if not -largest <= low < high <= largest:
        raise InputError(f"{text}: must be two finite numbers, the lower one first")
    if log and low <= 0:
        raise InputError(f"{text}: must be above 0 for logarithmic steps")
    if whole and not (float(low).is_integer() and float(high).is_integer()):
        raise InputError(f"{text}: must be whole numbers")
    return Range(key, float(low), float(high), log, whole)


def spaced(between: Range, count: int) -> ListedValues:
    """Return ``count`` values of a range including its ends; rounded for whole numbers.

    Raises
    ------
    InputError
        ``count`` is below two, too large, or exceeds the number of whole numbers.
    """
    key, low, high, log, whole = between
    most = round(high - low) + 1 if whole else MOST_VALUES
    if not 2 <= count <= most:
        raise InputError(f"{key}: {count} values: must be from 2 to {most}")
    if log:
        steps = np.geomspace(low, high, count)
    else:
        steps = np.linspace(low, high, count)
    if whole:
        return ListedValues(key, tuple(dict.fromkeys(round(float(value)) for value in steps)), log)
    return ListedValues(key, tuple(float(value) for value in steps), log)


def values(key: str, listed: Sequence[Any]) -> ListedValues:
    """Return the listed values of a key, of any kind, after a check.

    Raises
    ------
    InputError
        There are no values, too many, or duplicates.
    """
    unit = scene_keys(key)[0].unit
    if not 1 <= len(listed) <= MOST_VALUES:
        raise InputError(f"{key}: {len(listed)} values: must be from 1 to {MOST_VALUES}")
    numbers = tuple(_plain(key, unit, value) for value in listed)
    seen: set[str] = set()
    for value in numbers:
        if not _fits(value):
            raise InputError(
                f"{key}: {short(value)}: must be finite; whole numbers must lie within 64 bits"
            )
        if (text := repr(value)) in seen:
            raise InputError(f"{key}: {short(value)} is given twice")
        seen.add(text)
    return ListedValues(key, numbers)


def _fits(value: Any) -> bool:
    """Return whether a table can store a value."""
    if isinstance(value, Mapping):
        return all(map(_fits, value.values()))
    if isinstance(value, list | tuple):
        return all(map(_fits, value))
    if isinstance(value, int):
        return -(2**63) <= value < 2**63
    return not isinstance(value, float) or math.isfinite(value)


def _takes_whole_numbers(key: str) -> bool:
    """Return whether a scene's key accepts whole numbers only."""
    return scene_keys(key)[0].range.startswith("whole")


def _in_one_unit(text: str, key: str, listed: list[Any]) -> list[Any]:
    """Return listed values; if only the last one has a unit, it applies to all."""
    if scene_keys(key)[0].unit in NO_UNIT:
        return listed
    if not any(isinstance(value, str) and has_unit(value) for value in listed):
        return listed
    return _with_last_unit(text, [str(value) for value in listed])


def _with_last_unit(text: str, numbers: Sequence[str]) -> list[str]:
    """Return number texts, all with the unit of the last; ``text`` is for the error."""
    try:
        return with_last_unit(numbers)
    except ValueError as error:
        raise InputError(f"{short(text)}: {short(numbers[-1].strip())} {error}") from None


def _number(text: str, key: str, part: str) -> float:
    """Parse a number of a key to SI, with a unit or without; ``text`` is for the error."""
    part = part.strip()
    try:
        if has_unit(part):
            return in_si(part, scene_keys(key)[0].unit)
        return number_in(part)
    except ValueError as error:
        why = error if has_unit(part) else f"is not a number; {_FORMS}"
        raise InputError(f"{short(text)}: {short(part)} {why}") from None


def _plain(key: str, unit: str, value: Any) -> Any:
    """Return a value in SI; a text is parsed if the key is numeric, see ``_number``."""
    if unit in NO_UNIT or not isinstance(value, str):
        return value
    return _number(f"{key}={value}", key, value)


def _count(text: str, part: str) -> int:
    """Parse a number of values; ``text`` is for the error."""
    if not (part.isascii() and part.strip().isdecimal()) or len(part) > 9:
        raise InputError(f"{short(text)}: {short(part)} is not a number of values; {_FORMS}")
    return int(part)


def _listed(text: str, list_text: str) -> list[Any]:
    """Parse a list of values as YAML, with or without brackets; ``text`` is for the error."""
    try:
        numbers = read_yaml(list_text if list_text.startswith("[") else f"[{list_text}]")
    except ValueError as error:
        raise InputError(f"{short(text)}: its values: {error}") from error
    if not isinstance(numbers, list):
        raise InputError(f"{short(text)}: {_FORMS}")
    return numbers


MOST_RUNS = 10_000_000
"""Largest number of runs of a sweep."""


class Points(Protocol):
    """Values of keys for each of many runs."""

    @property
    def keys(self) -> tuple[str, ...]:
        """Varied keys, dotted."""

    def __len__(self) -> int:
        """Return the number of runs."""

    def at(self, run: int) -> tuple[Any, ...]:
        """Return the values of a run, in the order of the keys."""

    def report(self) -> dict[str, Any]:
        """Return the values that define the points, JSON-able; equal for equal points only."""


@dataclass(frozen=True)
class GridPoints:
    """All combinations of values; the last key changes fastest."""

    axes: tuple[ListedValues, ...]
    """Values of each key."""

    @property
    def keys(self) -> tuple[str, ...]:
        """Varied keys, dotted."""
        return tuple(axis.key for axis in self.axes)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values per key."""
        return tuple(len(axis.values) for axis in self.axes)

    def __len__(self) -> int:
        return math.prod(self.shape)

    def at(self, run: int) -> tuple[Any, ...]:
        """Return the values of a run, see ``Points``."""
        places = np.unravel_index(run, self.shape)
        return tuple(axis.values[int(place)] for axis, place in zip(self.axes, places, strict=True))

    def report(self) -> dict[str, Any]:
        """Return the defining values, see ``Points``."""
        return {"grid": {axis.key: list(axis.values) for axis in self.axes}}


class DesignPoints:
    """Points of a space-filling design over ranges, by scipy.stats.qmc.

    Parameters
    ----------
    ranges
        Ranges, one per key.
    design
        ``sobol`` or ``lhs``, Latin hypercube; scrambled.
    count
        Number of points; a power of 2 for ``sobol``.
    seed
        Seed of the design's random numbers.
    """

    def __init__(self, ranges: Sequence[Range], design: str, count: int, seed: int) -> None:
        from scipy.stats import qmc

        self.ranges, self.design, self._count, self._seed = tuple(ranges), design, count, seed
        if design == "sobol":
            engine: qmc.QMCEngine = qmc.Sobol(len(ranges), rng=np.random.default_rng(seed))
        else:
            engine = qmc.LatinHypercube(len(ranges), rng=np.random.default_rng(seed))
        shares = engine.random(count)
        self._columns = [range_.at(shares[:, k]) for k, range_ in enumerate(self.ranges)]

    @property
    def keys(self) -> tuple[str, ...]:
        """Varied keys, dotted."""
        return tuple(range_.key for range_ in self.ranges)

    def __len__(self) -> int:
        return self._count

    def at(self, run: int) -> tuple[Any, ...]:
        """Return the values of a run, see ``Points``."""
        return tuple(column[run].item() for column in self._columns)

    def report(self) -> dict[str, Any]:
        """Return the defining values, see ``Points``."""
        ranges = {
            range_.key: [range_.low, range_.high, range_.log, range_.whole]
            for range_ in self.ranges
        }
        return {"design": self.design, "count": self._count, "seed": self._seed, "ranges": ranges}


def points_of(variables: Sequence[Variable], design: str | None, seed: int = 0) -> Points:
    """Return points over variables.

    Parameters
    ----------
    variables
        At least one variable; all with values for a grid, all ranges for a design.
    design
        ``sobol:COUNT`` or ``lhs:COUNT``; None: a grid.
    seed
        Seed of a design's random numbers.

    Raises
    ------
    InputError
        The arguments do not fit together; the message states why.
    """
    if not variables:
        raise InputError("nothing varies; name a key and its values, e.g. balls.mass=0.001,0.002")
    check_keys([variable.key for variable in variables])
    if design is None:
        return _grid(variables)
    kind, colon, count = design.partition(":")
    if kind not in ("sobol", "lhs") or not colon or not count.isdecimal() or len(count) > 9:
        raise InputError(
            f"design {short(design)}: must be sobol:COUNT or lhs:COUNT, e.g. sobol:4096"
        )
    if kind == "sobol" and int(count).bit_count() != 1:
        raise InputError(f"design {design}: for sobol the count must be a power of 2, e.g. 1024")
    ranges = [variable for variable in variables if isinstance(variable, Range)]
    for variable in variables:
        if not isinstance(variable, Range):
            raise InputError(
                f"{variable.key}: is a list of values; a design takes ranges, "
                f"{variable.key}=FROM..TO"
            )
    _check_count(int(count))
    return DesignPoints(ranges, kind, int(count), seed)


def check_keys(keys: Sequence[str]) -> None:
    """Refuse a key that is named twice, or lies within another one.

    Raises
    ------
    InputError
        A key is refused; the message names it.
    """
    for key in keys:
        if keys.count(key) > 1:
            raise InputError(f"{key}: varies twice; name it once")
    check_within(keys)


def check_within(keys: Sequence[str]) -> None:
    """Refuse a key within another key: the result would depend on their order.

    Raises
    ------
    InputError
        A key is refused; the message names both.
    """
    for key in keys:
        for other in keys:
            if key.startswith(f"{other}."):
                raise InputError(f"{key}: lies within {other}, which varies, too; name one of them")


def _grid(variables: Sequence[Variable]) -> GridPoints:
    """Return a grid over variables; refuse a range without a number of values."""
    for variable in variables:
        if isinstance(variable, Range):
            raise InputError(
                f"{variable.key}: from {variable.low:g} to {variable.high:g}: needs a number of "
                f"values; write {variable.key}={variable.low:g}..{variable.high:g}:COUNT, or use a "
                "design"
            )
    grid = GridPoints(
        tuple(variable for variable in variables if isinstance(variable, ListedValues))
    )
    _check_count(len(grid))
    return grid


def _check_count(count: int) -> None:
    """Refuse a number of runs that is out of range."""
    if not 1 <= count <= MOST_RUNS:
        raise InputError(f"{count} runs: must be from 1 to {MOST_RUNS}; take fewer values")
