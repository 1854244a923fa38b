"""Numbers with their unit, ``12 mm``, converted to SI by pint; units of displayed values.

A text must be a number and a product of powers of units. That is checked before pint reads it,
because pint evaluates its input. Pint is imported on first use, as that takes a quarter of a
second.
"""

import functools
import math
import re
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from decimal import Context, Decimal, localcontext
from typing import TYPE_CHECKING, Any, NamedTuple

from ab_sim.base.errors import InputError, short

if TYPE_CHECKING:
    import pint


NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?"
NO_UNIT = ("1", "-")
"""Entries in place of a unit: of dimensionless numbers, and of keys that take no number."""
MOST = 100
"""Largest length of a text that states a number with its unit [characters]."""

_NAME = r"[A-Za-zµμ°][A-Za-z0-9_]*"
# No powers of powers: their exponents would multiply to numbers of any length.
_FACTOR = rf"(?:sqrt\(\s*{_NAME}\s*\)|{_NAME}(?:(?:\^|\*\*)[+-]?\d(?:\.\d{{1,2}})?)?)"
_JOIN = r"(?:\s*[*/·]\s*|\s+)"
_PRODUCT = rf"{_FACTOR}(?:{_JOIN}{_FACTOR})*"
_PART = rf"(?:{_FACTOR}|\(\s*{_PRODUCT}\s*\))"
_UNIT = re.compile(rf"{_PART}(?:{_JOIN}{_PART})*")
_TEXT = re.compile(rf"({NUMBER})\s*([^\s\d.+-].*)")
_POWERS = str.maketrans({"²": "^2", "³": "^3"})
_DIGITS = 50
"""Digits of decimal arithmetic: enough to convert a written number to the nearest float."""
_MAKING = threading.Lock()
"""Lock for the creation of the registry: two registries would not accept each other's units."""


class Kind(NamedTuple):
    """Quantity that a unit measures, and a number with such a unit as an example for messages."""

    name: str
    example: str


KINDS = {
    "kg": Kind("a mass", "1 g"),
    "m": Kind("a length", "12 mm"),
    "s": Kind("a time", "500 ms"),
    "rad": Kind("an angle", "45 deg"),
    "rad/s": Kind("an angular speed", "2500 rpm"),
    "rad/s^2": Kind("an angular acceleration", "500 rpm/s"),
    "Hz": Kind("a frequency", "1 kHz"),
    "m/s": Kind("a speed", "10 mm/s"),
    "m/s^2": Kind("an acceleration", "16 g_0"),
    "(m/s^2)/sqrt(Hz)": Kind("a noise density", "70 ug_0/sqrt(Hz)"),
    "m/sqrt(Hz)": Kind("a noise density", "10 nm/sqrt(Hz)"),
    "kg m": Kind("an unbalance", "0.3 g cm"),
    "kg m^2": Kind("a moment of inertia", "25 g cm^2"),
    "N": Kind("a force", "1 N"),
    "N/m": Kind("a stiffness", "1 N/mm"),
    "N s/m": Kind("a damping", "0.2 N s/m"),
    "N/m^3": Kind("a cubic stiffness", "1 N/mm^3"),
    "N m": Kind("a torque", "5 mN m"),
    "N m/rad": Kind("a torque per angle", "5 mN m/rad"),
    "N m s/rad": Kind("a torque per angular speed", "5 mN m/rpm"),
}
"""Quantities by SI unit, as in the keys of scenes."""
_NOTES = {
    ("Hz", "rad/s"): "Hz may mean turns or radians: write rev/s, rpm or rad/s",
    ("rad/s", "Hz"): "60 rpm are one turn a second: write 1 Hz",
    ("kg", "m/s^2"): "g is the gram: write g_0 for the acceleration of free fall",
    ("N m", "N m/rad"): "say per what angle: write N m/rad",
}
"""Notes on units that are easily confused."""


def has_unit(text: str) -> bool:
    """Return whether a text is a number followed by a possible unit; the unit is not checked."""
    if len(text) > MOST or _TEXT.fullmatch(text.strip()) is None:
        return False
    try:
        float(text)
    except ValueError:
        return True
    return False  # 1e3 and 1_000 end like a unit


def with_last_unit(texts: Sequence[str]) -> list[str]:
    """Append the unit of the last number to all numbers of a range or list, as in ``80..1000 rpm``.

    Parameters
    ----------
    texts
        The numbers in order; if only the last one has a unit, all take it.

    Raises
    ------
    ValueError
        Another number has a unit and the last one has none; the message continues a sentence that
        begins with the last one.
    """
    units = [_TEXT.fullmatch(text.strip()) if has_unit(text) else None for text in texts]
    last = units[-1]
    if last is None and any(units):
        raise ValueError("must have a unit, because another number of the list has one")
    if last is None or any(units[:-1]):
        return list(texts)
    return [*(f"{text.strip()} {last[2]}" for text in texts[:-1]), texts[-1]]


def in_si(text: str, unit: str) -> float:
    """Convert a text with number and unit to a number in the SI unit of a key.

    Parameters
    ----------
    text
        Number with a unit, e.g. ``2500 rpm``, ``0.3 g cm``, ``1 N/mm``, ``70 ug_0/sqrt(Hz)``.
    unit
        Unit of the key, e.g. ``rad/s``; "1" or "-" if it has none.

    Returns
    -------
    float
        The float nearest to the written number.

    Raises
    ------
    ValueError
        The text has another form, an unknown unit or one of another quantity, or the number is too
        large; the message continues a sentence that begins with the value.
    """
    if unit in NO_UNIT:
        raise ValueError("must be a number without unit")
    match = _TEXT.fullmatch(text.strip()) if len(text) <= MOST else None
    if match is None:
        raise ValueError(f"must be a number, in {unit} or with a unit{_example(unit)}")
    number, written = match.groups()
    with _many_digits():
        try:
            with _MAKING:
                _registry()
        except ImportError:  # if the dependencies came with ROS
            raise ValueError(
                "has a unit, for which pint is needed: pip install 'pint>=0.24', or give the "
                f"number in {unit}"
            ) from None
        unit_, wanted = _units(written), _units(unit)
        if wanted is None:  # unit of a user's own effect
            raise ValueError(f"must be a number in {unit}, written without unit")
        if unit_ is None:
            raise ValueError(f"{short(written)} is not a known unit; {_must_be(unit)}")
        if _root(unit_) != _root(wanted):
            raise ValueError(_misfit(unit_, unit))
        try:
            value = float(_registry().Quantity(Decimal(number), unit_).m_as(wanted))
        except ArithmeticError:
            value = math.inf
        except (TypeError, ValueError):  # decibels
            raise ValueError(f"cannot be computed from that unit; {_must_be(unit)}") from None
    if not math.isfinite(value):
        raise ValueError(f"is too large for a float; {_must_be(unit)}")
    return value


def _si_unit(written: str) -> str | None:
    """Return the SI unit of the quantity that a unit measures; None if scenes do not have it.

    Parameters
    ----------
    written
        Unit as users write it, e.g. ``rpm`` or ``g mm``.

    Raises
    ------
    ImportError
        Pint is not installed.
    """
    if len(written) > MOST:
        return None
    with _many_digits():
        with _MAKING:
            _registry()
        unit = _units(written)
        if unit is None:
            return None
        return next(
            (kind_unit for kind_unit in KINDS if _root(_units(kind_unit)) == _root(unit)), None
        )


def _must_be(unit: str) -> str:
    """Return the end of a message: the quantity that a key wants, with an example."""
    kind = KINDS.get(unit)
    what = f"{kind.name} [{unit}]" if kind else f"in [{unit}]"
    return f"must be {what}{_example(unit)}"


def _example(unit: str) -> str:
    """Return an example of a number in a unit, for messages."""
    return f", e.g. {KINDS[unit].example if unit in KINDS else f'0.5 {unit}'}"


def _misfit(unit_: Any, unit: str) -> str:
    """Return the message on a unit that measures another quantity than the key's."""
    root = _root(unit_)
    alike = next((kind_unit for kind_unit in KINDS if _root(_units(kind_unit)) == root), None)
    if alike is not None:
        message = f"is {KINDS[alike].name} [{alike}], {_must_be(unit)}"
        note = _NOTES.get((alike, unit))
        return f"{message}; {note}" if note else message
    base = f"{_registry().get_base_units(unit_)[1]:~C}".replace("**", "^").replace("*", " ")
    return f"is in [{base}], {_must_be(unit)}" if base else f"has no dimension, {_must_be(unit)}"


@contextmanager
def _many_digits() -> Iterator[None]:
    """Return a context in which decimal arithmetic has ``_DIGITS`` digits."""
    with localcontext(Context(prec=_DIGITS)):
        yield


@functools.cache
def _registry() -> "pint.UnitRegistry[Any]":
    """Return pint's registry of units, which computes with decimal numbers."""
    import pint

    registry: pint.UnitRegistry[Any] = pint.UnitRegistry(non_int_type=Decimal)
    registry.define("@alias turn = rev")
    return registry


def _root(units: Any) -> Any:
    """Return a unit's base units as pint gives them, with the radian, which has no dimension.

    So turns per second differ from Hz, and an angle from a plain number.
    """
    return _registry().get_root_units(units)[1]


@functools.lru_cache(maxsize=256)
def _units(text: str) -> Any:
    """Return pint's units; None if they are written wrongly or unknown."""
    import pint

    text = text.strip().translate(_POWERS)
    if _UNIT.fullmatch(text) is None:
        return None
    text = re.sub(rf"sqrt\(\s*({_NAME})\s*\)", r"\1^0.5", text).replace("^", "**")
    text = re.sub(r"\(\s+", "(", re.sub(r"\s+\)", ")", text)).replace("·", "*")
    text = re.sub(r"\s*([*/])\s*|\s+", lambda join: join[1] or "*", text)
    try:
        units = _registry().parse_units(text)
        _root(units)
    except (pint.PintError, ArithmeticError, ValueError, TypeError, AssertionError):
        return None
    return units


class ShownUnit(NamedTuple):
    """A unit for display."""

    text: str
    factor: float
    """Factor by which a number in SI is multiplied to be shown in this unit."""


ShownUnits = dict[str, ShownUnit]
"""Units for display by SI unit; other quantities are shown in SI."""
_METRICS_OWN = {"mm/s": ("m/s", 1e-3)}
"""Units of metrics that are not SI: the SI unit and the factor from this unit to it."""


def shown_units(text: str) -> ShownUnits:
    """Parse a list of units for display, such as ``rpm,g mm,deg``.

    Parameters
    ----------
    text
        Units separated by commas, at most one of each kind; empty: all quantities are shown in SI.

    Raises
    ------
    InputError
        A text is not a unit of a quantity of scenes or metrics, two units measure the same
        quantity, or pint is not installed.
    """
    units_shown: ShownUnits = {}
    for written in map(str.strip, text.split(",") if text.strip() else []):
        try:
            unit = _si_unit(written)
        except ImportError:
            raise InputError(f"units {short(text)}: need pint: pip install 'pint>=0.24'") from None
        if unit is None:
            raise InputError(
                f"units {short(text)}: {short(written)} is not a unit of a displayed quantity; "
                "give units separated by commas, e.g. rpm,g mm,deg, of "
                + ", ".join(
                    kind.name.removeprefix("a ").removeprefix("an ") for kind in KINDS.values()
                )
            )
        if unit in units_shown:
            raise InputError(
                f"units {short(text)}: {units_shown[unit].text} and {written} both show "
                f"{KINDS[unit].name}; give one of them"
            )
        units_shown[unit] = ShownUnit(written, 1.0 / in_si(f"1 {written}", unit))
    for unit_name, (unit, factor) in _METRICS_OWN.items():
        if unit in units_shown:
            units_shown[unit_name] = units_shown[unit]._replace(
                factor=factor * units_shown[unit].factor
            )
    return units_shown
