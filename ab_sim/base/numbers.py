"""Numbers from texts and from stored files, which may have been edited: form, type and range."""

import math
import re
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from ab_sim.base.errors import NOT_AS_WRITTEN, short

T = TypeVar("T")

_MOST_WHOLE = 2**63 - 1
"""Largest number of steps or nanoseconds."""
MOST_TIME = 2.0**31
"""Largest time that the stamp of a ROS message can have [s]."""


def whole(value: Any, least: int = -_MOST_WHOLE, most: int = _MOST_WHOLE) -> int:
    """Return a value if it is a whole number within limits.

    Raises
    ------
    ValueError
        The value is not a whole number, or is outside the limits.
    """
    if not isinstance(value, int) or isinstance(value, bool) or not least <= value <= most:
        raise ValueError(f"{short(value)} is not a whole number from {least} to {most}")
    return value


def finite(value: Any, least: float = -math.inf, most: float = math.inf) -> float:
    """Return a value if it is a finite number within limits.

    Raises
    ------
    ValueError
        The value is not a finite number, or is outside the limits.
    """
    if not isinstance(value, int | float) or isinstance(value, bool) or not math.isfinite(value):
        raise ValueError(f"{short(value)} is not a finite number")
    if not least <= value <= most:
        raise ValueError(f"{short(value)}: must be {least:g} to {most:g}")
    return float(value)


def entry(values: Mapping[str, Any], name: str, parse: Callable[[Any], T]) -> T:
    """Return an entry of a stored state, converted by ``parse``.

    Raises
    ------
    ValueError
        The entry is missing, or ``parse`` refuses it.
    """
    if not isinstance(values, Mapping) or name not in values:
        raise ValueError(f"{name}: is missing; save it again")
    try:
        return parse(values[name])
    except NOT_AS_WRITTEN as error:
        raise ValueError(
            f"{name} = {short(values[name])}: is not in the form that ab_sim writes; save it again"
        ) from error


def reason_of(error: Exception) -> str:
    """Return the reason why a stored state is refused, from an error in `NOT_AS_WRITTEN`."""
    if isinstance(error, ValueError):
        return str(error)
    return f"it is not in the form that ab_sim writes ({short(error)}); save it again"


_WRITTEN = re.compile(r"\s*[-+0-9a-zA-Z.]+\s*")
"""Characters of a number. Python's ``float`` would also accept 1_0 and digits of other scripts."""


def number_in(text: str) -> float:
    """Return the number in a text.

    Raises
    ------
    ValueError
        The text is not a number.
    """
    return float(_checked(text))


def whole_number_in(text: str) -> int:
    """Return the whole number in a text.

    Raises
    ------
    ValueError
        The text is not a whole number.
    """
    return int(_checked(text))


def _checked(text: str) -> str:
    if _WRITTEN.fullmatch(text) is None:
        raise ValueError(f"{text!r} is not a number with the digits 0 to 9")
    return text
