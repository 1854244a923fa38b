"""Keys of a scene that vary, and over what: as texts and as calls give them."""

import math
import sys
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ab_sim.errors import InputError, exact
from ab_sim.limited_yaml import read_yaml
from ab_sim.quoting import short
from ab_sim.scene.keys import scene_keys
from ab_sim.scene.units import NO_UNIT, has_unit, in_si, with_last_unit

MOST = 1_000_000
"""Values of one key."""
FORMS = (
    "must be KEY=FROM..TO:COUNT, KEY=log:FROM..TO:COUNT, KEY=FROM..TO (of a design) or "
    "KEY=V,V,..., e.g. balls.mass=0.5g..3g:26"
)


class Range(NamedTuple):
    """Values between two ends, of which a design takes some."""

    key: str
    low: float
    high: float
    log: bool = False
    """Whether they are spread evenly in their logarithm."""
    whole: bool = False
    """Whether the key takes whole numbers only."""

    def at(self, shares: np.ndarray) -> np.ndarray:
        """Values at shares of the way from the low end to the high one.

        Args:
            shares: from 0 to below 1, shape (n,).
        """
        if self.whole:
            first, count = round(self.low), round(self.high) - round(self.low) + 1
            return first + np.floor(shares * count).astype(np.int64)
        if self.log:
            low, high = math.log(self.low), math.log(self.high)
            return np.exp(low + shares * (high - low))
        return self.low + shares * (self.high - self.low)

    def share(self, value: float) -> float:
        """Of a value on the way from the low end to the high one; a whole number as it is."""
        if self.whole:
            return value
        if self.log:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)


class ListedValues(NamedTuple):
    """Values of a key, each of which a grid takes."""

    key: str
    values: tuple[Any, ...]
    """Numbers, or anything else that the scene takes there."""
    log: bool = False
    """Whether they are drawn over a logarithmic axis."""


Variable = Range | ListedValues


def variable_of(text: str) -> Variable:
    """What is written ``KEY=FROM..TO:COUNT``, ``KEY=log:FROM..TO:COUNT`` or ``KEY=V,V,...``.

    Without a count it is a range for a design. Listed values are YAML, so a value may be a list.
    Where only the last number of a range or a list has a unit, it is that of all.

    Raises:
        InputError: says what is wrong with it.
    """
    key, equals, given = (part.strip() for part in text.partition("="))
    if not equals or not key or not given:
        raise InputError(f"{short(text)}: {FORMS}")
    log = given.startswith("log:")
    low, dots, rest = given.removeprefix("log:").partition("..")
    if not dots:
        return values(key, _in_one_unit(text, key, _listed(text, given)))
    high, colon, count = rest.partition(":")
    low, high = _with_last_unit(text, [low, high])
    between = range_(key, _number(text, key, low), _number(text, key, high), log)
    return spaced(between, _count(text, count)) if colon else between


def range_(key: str, low: float, high: float, log: bool = False) -> Range:
    """A range of a key that takes numbers.

    Args:
        key: dotted.
        low, high: its ends [SI], both part of it.
        log: whether values are spread evenly in their logarithm.

    Raises:
        InputError: names key, value and what is allowed.
    """
    whole = _takes_whole_numbers(key)
    said = f"{key}: from {exact(low)} to {exact(high)}"
    largest = sys.float_info.max  # an int may be larger
    if not -largest <= low < high <= largest:
        raise InputError(f"{said}: must be two finite numbers, the lower one first")
    if log and low <= 0:
        raise InputError(f"{said}: must be above 0 for logarithmic steps")
    if whole and not (float(low).is_integer() and float(high).is_integer()):
        raise InputError(f"{said}: must be whole numbers")
    return Range(key, float(low), float(high), log, whole)


def spaced(between: Range, count: int) -> ListedValues:
    """So many values of a range, both ends among them; of whole numbers, those nearest to them.

    Raises:
        InputError: fewer than two, too many, or more than there are whole numbers.
    """
    key, low, high, log, whole = between
    most = round(high - low) + 1 if whole else MOST
    if not 2 <= count <= most:
        raise InputError(f"{key}: {count} values: must be from 2 to {most}")
    if log:
        steps = np.geomspace(low, high, count)
    else:
        steps = np.linspace(low, high, count)
    if whole:
        return ListedValues(key, tuple(dict.fromkeys(round(float(value)) for value in steps)), log)
    return ListedValues(key, tuple(float(value) for value in steps), log)


def values(key: str, given: Sequence[Any]) -> ListedValues:
    """Values of any kind.

    Raises:
        InputError: there are none, too many, or one is given twice.
    """
    unit = scene_keys(key)[0].unit
    if not 1 <= len(given) <= MOST:
        raise InputError(f"{key}: {len(given)} values: must be from 1 to {MOST}")
    found = tuple(_plain(key, unit, value) for value in given)
    seen: set[str] = set()
    for value in found:
        if not _fits(value):
            raise InputError(f"{key}: {short(value)}: must be finite, and whole numbers of 64 bits")
        if (said := repr(value)) in seen:
            raise InputError(f"{key}: {short(value)} is given twice")
        seen.add(said)
    return ListedValues(key, found)


def _fits(value: Any) -> bool:
    """Whether a table has a column for it."""
    if isinstance(value, Mapping):
        return all(map(_fits, value.values()))
    if isinstance(value, list | tuple):
        return all(map(_fits, value))
    if isinstance(value, int):
        return -(2**63) <= value < 2**63
    return not isinstance(value, float) or math.isfinite(value)


def _takes_whole_numbers(key: str) -> bool:
    return scene_keys(key)[0].range.startswith("whole")


def _in_one_unit(text: str, key: str, given: list[Any]) -> list[Any]:
    """Listed values, with the unit of the last where only that has one."""
    if scene_keys(key)[0].unit in NO_UNIT:
        return given
    if not any(isinstance(value, str) and has_unit(value) for value in given):
        return given
    return _with_last_unit(text, [str(value) for value in given])


def _with_last_unit(text: str, numbers: Sequence[str]) -> list[str]:
    try:
        return with_last_unit(numbers)
    except ValueError as error:
        raise InputError(f"{short(text)}: {short(numbers[-1].strip())} {error}") from None


def _number(text: str, key: str, part: str) -> float:
    """A number as it is written, with its unit or in SI."""
    part = part.strip()
    try:
        if has_unit(part):
            return in_si(part, scene_keys(key)[0].unit)
        return float(part)
    except ValueError as error:
        why = error if has_unit(part) else f"is no number; {FORMS}"
        raise InputError(f"{short(text)}: {short(part)} {why}") from None


def _plain(key: str, unit: str, value: Any) -> Any:
    """A value in SI where it is written with its unit, and a number where it reads like one."""
    if unit in NO_UNIT or not isinstance(value, str):
        return value
    return _number(f"{key}={value}", key, value)


def _count(text: str, part: str) -> int:
    if not part.strip().isdecimal() or len(part) > 9:
        raise InputError(f"{short(text)}: {short(part)} is no count of values; {FORMS}")
    return int(part)


def _listed(text: str, given: str) -> list[Any]:
    try:
        found = read_yaml(given if given.startswith("[") else f"[{given}]")
    except ValueError as error:
        raise InputError(f"{short(text)}: its values: {error}") from error
    if not isinstance(found, list):
        raise InputError(f"{short(text)}: {FORMS}")
    return found
