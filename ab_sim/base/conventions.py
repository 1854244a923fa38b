"""Conventions of all outputs: notation, range of displayed angles, and span of final values."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    import numpy as np

    Angles = TypeVar("Angles", float, np.ndarray)

PAGE = "docs/conventions.md"
ANGLES = f"{PAGE}#angles"
WHIRL = f"{PAGE}#whirl-and-we"
MASSES = f"{PAGE}#where-masses-are"
NOTATION = f"Symbols, signs, angles: {PAGE}"
"""Note under tables, pictures and pages with symbols."""

TURN = 2.0 * math.pi
LAST_ANGLE = math.radians(30.0)
"""End of the turn in which ball angles are shown [rad]."""

LAST = 0.1
"""Fraction of the run at its end over which final values are computed."""


def last_stretch(samples: int) -> int:
    """Return the number of samples at the end of a run over which final values are computed."""
    return max(1, round(LAST * samples))


def in_one_turn(angles: Angles) -> Angles:
    """Shift ball angles [rad] by whole turns into the range from -330 (exclusive) to 30 deg.

    Angles in this range are unchanged. Balls start and rest near the unbalance (0) or opposite to
    it (-180), so they rarely pass the end of the range, 30 deg ahead of the unbalance.
    """
    return angles + TURN * ((LAST_ANGLE - angles) // TURN)
