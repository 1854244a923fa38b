"""Numbers from files, which anybody can have changed: of their kind, and within bounds."""

import math
from typing import Any

from ab_sim.base.quoting import short

MOST_WHOLE = 2**63 - 1
"""Largest number of steps or nanoseconds."""
MOST_TIME = 2.0**31
"""s; a message's stamp cannot say more."""


def whole(value: Any, least: int = -MOST_WHOLE, most: int = MOST_WHOLE) -> int:
    """Return a whole number.

    Raises:
        ValueError: it is none, or out of bounds.
    """
    if not isinstance(value, int) or isinstance(value, bool) or not least <= value <= most:
        raise ValueError(f"{short(value)} is not a whole number from {least} to {most}")
    return value


def finite(value: Any, least: float = -math.inf, most: float = math.inf) -> float:
    """Return a finite number.

    Raises:
        ValueError: it is none, or out of bounds.
    """
    if not isinstance(value, int | float) or isinstance(value, bool) or not math.isfinite(value):
        raise ValueError(f"{short(value)} is not a finite number")
    if not least <= value <= most:
        raise ValueError(f"{short(value)}: must be {least:g} to {most:g}")
    return float(value)
