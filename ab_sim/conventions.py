"""The notation of all outputs: the page that explains it, and the turn that angles are shown in."""

import math
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    import numpy as np

Angles = TypeVar("Angles", float, "np.ndarray")

PAGE = "docs/conventions.md"
ANGLES = f"{PAGE}#angles"
WHIRL = f"{PAGE}#whirl-and-we"
MASSES = f"{PAGE}#where-masses-are"
NOTATION = f"Symbols, signs, angles: {PAGE}"
"""Said under tables, pictures and pages that are full of them."""

BEYOND = 30.0
"""The turn that is shown ends this far beyond 0 [deg]: balls at the unbalance are not to leap."""


def in_one_turn(angles: Angles) -> Angles:
    """Fold angles [rad] into -330 to 30 deg: the way from the unbalance to its opposite."""
    return BEYOND - (BEYOND - angles * (180.0 / math.pi)) % 360.0
