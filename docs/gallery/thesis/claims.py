"""What the thesis states, and whether our runs say so, too."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gallery.page import Table
from gallery.thesis.drive import OPPOSITE

HOLDS, FAILS = "holds", "does not hold"
ABOUT = 0.15
"""What "about", "almost the same", "hardly changes", "in proportion" and "corresponds" may be off
by, relative: so far goes the thesis' own rounding of one figure (0.06 and 0.07 N are told apart, 55
and 53 are one peak); one for all rows, but for times."""
TIMED = 0.05
"""What a time of two digits may be off by, relative."""
MUCH = 0.8
""""Much less" is at most this share; ours."""
READ = 5.0
"""[deg]: less cannot be read off a figure whose axis has hundreds of degrees; one for all rows."""
FAR = 60.0
"""[deg]: what is "greatly" farther is so by more, what does "not change much" does so by less;
ours, a third of the way from one balanced position to the next."""
BALANCED = 0.1
"""Of the disc's unbalance at most: the unbalance is eliminated, cancelled; ours."""
ODD = (1, 3, 5)
"""Multiples of -180 deg that are opposite to the unbalance."""
BY_CONSTRUCTION = "by construction, not a result"
UNDECIDED = "undecided"
ENGLISH_ONLY = "the English only, not counted"
OWN = "ours, not counted"
"""Verdict of what the thesis does not say itself."""


class Claim(NamedTuple):
    """A statement with a verdict."""

    figure: str
    """Of the thesis; or its section."""
    printed: str
    """What it says."""
    ours: str
    """What our runs say."""
    holds: bool | None
    """None: our runs cannot decide it, or it is not a result; ``why`` says which."""
    why: str = ""
    """Where it does not hold: the reason, as far as it is known."""

    @property
    def verdict(self) -> str:
        """In words; what is not decided is not counted."""
        if self.holds is None:
            return self.why
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
    """A printed number beside ours: holds where they differ by a share of the printed at most.

    The page's text names the usual share; a row names its own where it has another.
    """
    criterion = "" if within == ABOUT else f" (ours: to {within:.0%})"
    holds = abs(ours - printed) <= within * abs(printed)
    off = f"{100 * (ours / printed - 1):+.0f} %"
    return Claim(
        figure,
        f"{what}: about {printed:.3g}{unit}",
        f"{ours:.3g}{unit}{criterion}",
        holds,
        f"{off}; {why}" if why else off,
    )


def bound(figure: str, what: str, printed: float, ours: float, less: bool) -> Claim:
    """A printed number that ours is to be at most, or at least."""
    words = "or less" if less else "or more"
    return Claim(
        figure, f"{what}: about {printed:.3g} {words}", f"{ours:.3g}",
        ours <= printed if less else ours >= printed, f"{100 * (ours / printed - 1):+.0f} %",
    )  # fmt: skip


def angle(figure: str, what: str, printed: float, ours: float, why: str = "") -> Claim:
    """A printed angle [deg] beside ours: as near as what is in the vicinity."""
    return Claim(
        figure, f"{what}: about {printed:.0f} deg", f"{ours:.0f} deg",
        abs(ours - printed) <= OPPOSITE, why or f"by {ours - printed:+.0f} deg",
    )  # fmt: skip


def own(figure: str, asked: str, ours: str, found: str) -> Claim:
    """What is ours to ask: it is not counted.

    Parameters
    ----------
    figure
        Of the thesis.
    asked
        what.
    ours
        What our runs say.
    found
        The answer, in short.
    """
    return Claim(figure, f"ours: {asked}", ours, None, f"{OWN}: {found}")


def stretches(values: np.ndarray, good: np.ndarray) -> list[tuple[int, int]]:
    """Indices of the first and the last value of each stretch that is good."""
    padded = np.diff(np.concatenate([[0], np.asarray(good, int), [0]]))
    firsts, ends = np.flatnonzero(padded > 0), np.flatnonzero(padded < 0)
    assert len(good) == len(values)
    return [(int(first), int(end) - 1) for first, end in zip(firsts, ends, strict=True)]


def opposite(angles: np.ndarray) -> np.ndarray:
    """Which balls are in the vicinity of -180 deg."""
    return np.asarray(np.abs(angles + 180.0) <= OPPOSITE)


def barely_opposite(angles: np.ndarray) -> bool:
    """Whether all balls are in the vicinity, and its border is as near as can be read off."""
    short = float(np.abs(angles + 180.0).max())
    return OPPOSITE - READ < short <= OPPOSITE


def at_odd(angles: np.ndarray) -> np.ndarray:
    """Which balls are in the vicinity of an odd multiple of -180 deg."""
    return np.any([np.abs(angles + 180.0 * odd) <= OPPOSITE for odd in ODD], axis=0)


def degrees(angles: np.ndarray) -> str:
    """The balls' angles in words."""
    return ", ".join(f"{angle:.0f}" for angle in angles) + " deg"
