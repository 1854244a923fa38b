"""Line styles that distinguish many curves not by colour alone."""

DASHES: tuple[tuple[float, ...], ...] = (
    (), (6, 2), (2, 2), (6, 2, 2, 2), (10, 4), (6, 2, 2, 2, 2, 2), (2, 5), (12, 2, 3, 2), (4, 4),
    (10, 2, 2, 2, 2, 2, 2, 2),
)  # fmt: skip
"""Alternating lengths of dashes and gaps, in line widths; enough for the 64 balls of a scene."""
COLOURS = 7
"""Number of consecutive curves that share a style, each with its own colour."""


def dashes_of(number: int) -> tuple[float, ...]:
    """Return the style of a curve, counted from 0."""
    return DASHES[number // COLOURS % len(DASHES)]
