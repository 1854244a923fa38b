"""What the thesis states, and whether our runs say so, too."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ab_sim.papers.page import Table

HOLDS, FAILS = "holds", "does not hold"
OPPOSITE = 30.0
"""[deg]: "in the vicinity of -180 degrees" is -150 to -210; the thesis calls -200 so."""
ABOUT = 0.15
"""What "about", of ratios and values read off a figure, may be off by, relative."""


class Claim(NamedTuple):
    """A statement with a verdict."""

    figure: str
    """Of the thesis; or its section."""
    printed: str
    """What it says."""
    ours: str
    """What our runs say."""
    holds: bool
    why: str = ""
    """Where it does not hold: the reason, as far as it is known."""

    @property
    def verdict(self) -> str:
        """In words."""
        return HOLDS if self.holds else FAILS + (f": {self.why}" if self.why else "")


def table_of(title: str, claims: Sequence[Claim]) -> Table:
    """Claims as a table of the page."""
    rows = tuple((c.figure, c.printed, c.ours, c.verdict) for c in claims)
    return Table(title, ("figure", "the thesis", "ours", "verdict"), rows)


def value(
    figure: str,
    what: str,
    printed: float,
    ours: float,
    unit: str = "",
    within: float = ABOUT,
    why: str = "",
) -> Claim:
    """A printed number beside ours: holds where they differ by a share of the printed at most."""
    holds = abs(ours - printed) <= within * abs(printed)
    off = f"{100 * (ours / printed - 1):+.0f} %"
    return Claim(
        figure,
        f"{what}: about {printed:.3g}{unit}",
        f"{ours:.3g}{unit}",
        holds,
        f"{off}; {why}" if why else off,
    )


def opposite(angles: np.ndarray) -> np.ndarray:
    """Which balls are in the vicinity of -180 deg."""
    return np.asarray(np.abs(angles + 180.0) <= OPPOSITE)


def degrees(angles: np.ndarray) -> str:
    """The balls' angles in words."""
    return ", ".join(f"{angle:.0f}" for angle in angles) + " deg"
