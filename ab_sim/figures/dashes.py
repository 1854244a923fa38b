"""Line styles, for many curves to be told apart in another way than by their colours alone."""

DASHES: tuple[tuple[float, ...], ...] = (
    (), (6, 2), (2, 2), (6, 2, 2, 2), (10, 4), (6, 2, 2, 2, 2, 2), (2, 5), (12, 2, 3, 2), (4, 4),
    (10, 2, 2, 2, 2, 2, 2, 2),
)  # fmt: skip
"""Lengths of dashes and gaps in turn [line widths]; with seven colours and more, enough for the 64
balls that a scene may have."""


def dashes_of(number: int, colours: int) -> tuple[float, ...]:
    """Of the curve of that number; so many, each in a colour of its own, share a style."""
    return DASHES[number // colours % len(DASHES)]
