"""Colours and line styles of pictures."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.colors import to_rgb

from ab_sim.base import palette
from ab_sim.base.palette import ON_LIGHT, Colour, ball_colour, distinct, hexadecimal

BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILION = (
    hexadecimal(colour)
    for colour in (
        palette.BLUE, palette.GREEN, palette.GREY, palette.ORANGE, palette.PURPLE, palette.SKY,
        palette.VERMILION,
    )
)  # fmt: skip
RUN, LIMIT = hexadecimal(palette.RUN), hexadecimal(palette.LIMIT)
WITHOUT_BALLS = hexadecimal(palette.WITHOUT_BALLS)
WITHOUT_PERIOD = hexadecimal(palette.WITHOUT_PERIOD)
COMMANDED = "black"
SERIES = tuple(map(hexadecimal, palette.SERIES))
MAP = "cividis"
"""Colour map: monotonically from dark to light, suitable for colour-blind readers."""


def _ball_colours(count: int) -> list[str]:
    """Return the colours of the first balls."""
    return [hexadecimal(ball_colour(ball)) for ball in range(count)]


def distinct_colours(
    count: int,
    first: Sequence[str],
    *,
    avoid: Sequence[str] = (),
    lightness: tuple[float, float] = ON_LIGHT,
    hues: tuple[float, float] = (0.0, 360.0),
) -> list[str]:
    """Return ``count`` distinct colours, the given ``first`` ones first; see ``palette.distinct``.

    Parameters
    ----------
    count
        Number of colours.
    first
        Colours to start with, in matplotlib's notation.
    avoid
        Colours from which further ones must differ.
    lightness
        Range of lightness of further colours, 0 to 1.
    hues
        Range of hues of further colours [deg].
    """
    colours = distinct(
        count, [_of(one) for one in first], avoid=[_of(one) for one in avoid],
        lightness=lightness, hues=hues,
    )  # fmt: skip
    return [*first[:count], *map(hexadecimal, colours[len(first) :])]


def _of(name: str) -> Colour:
    """Return a colour in matplotlib's notation as red, green and blue, 0 to 255."""
    red, green, blue = (round(255.0 * part) for part in to_rgb(name))
    return red, green, blue


DASHES: tuple[tuple[float, ...], ...] = (
    (), (6, 2), (2, 2), (6, 2, 2, 2), (10, 4), (6, 2, 2, 2, 2, 2), (2, 5), (12, 2, 3, 2), (4, 4),
    (10, 2, 2, 2, 2, 2, 2, 2),
)  # fmt: skip
"""Alternating lengths of dashes and gaps, in line widths; enough for the 64 balls of a scene."""
COLOURS = 7
"""Number of consecutive curves with the same dashes; their colours differ."""


def _dashes_of(number: int) -> tuple[float, ...]:
    """Return the dashes of the curve with a number, counted from 0; empty for a solid line."""
    return DASHES[number // COLOURS % len(DASHES)]


def ball_styles(balls: int) -> list[dict[str, Any]]:
    """Return a style per ball; later ones are thinner, so that coinciding curves remain visible."""
    widths = np.linspace(3.0, 1.0, balls) if balls > 1 else [1.8]
    return [
        {"color": colour, "lw": width, "dashes": _dashes_of(ball)}
        for ball, (colour, width) in enumerate(zip(_ball_colours(balls), widths, strict=True))
    ]
