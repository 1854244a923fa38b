"""Colours of all pictures: colours with a meaning, of the balls, and of any number of curves.

All pictures, by matplotlib, plotly and Rerun, use this table. The colours are visible on light and
dark backgrounds (contrast of at least 3 to white and to Rerun's dark grey), because Rerun's views
follow the viewer's theme.

Distances of colours are those of OKLab (B. Ottosson, A perceptual color space for image processing,
2020), in which equal distances look about equally large.
"""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

Colour = tuple[int, int, int]
"""Red, green and blue, 0 to 255 (sRGB)."""

BLUE: Colour = (40, 120, 215)
ORANGE: Colour = (205, 132, 0)
PURPLE: Colour = (190, 95, 190)
GREEN: Colour = (0, 158, 115)
VERMILION: Colour = (213, 84, 20)
SKY: Colour = (50, 150, 205)
_LIME: Colour = (112, 150, 20)
GREY: Colour = (128, 128, 128)

RUN = RESIDUAL = BLUE
"""Colour of the shown run's speed, whirl, torque and residual unbalance."""
UNBALANCE = VERMILION
"""Colour of the rotor's unbalance, and of once-per-turn vibration."""
RESULTANT = GREEN
"""Colour of the balls' sum of m R."""
BALANCED = _LIME
"""Colour of positions in which balls balance the rotor."""
WITHOUT_BALLS = LIMIT = GREY
"""Colour of the run without balls, of critical speeds, and of the side opposite the unbalance."""
WITHOUT_PERIOD = GREEN
"""Colour of the run without its variable-speed period."""
FIRST_BALLS = (ORANGE, PURPLE, SKY)
"""Colours of the first balls; `ball_colour` gives all."""

SERIES = (BLUE, GREEN, VERMILION)
"""Colours of up to three curves of one kind, other than balls, such as the three tilts."""

GOOD: Colour = (44, 154, 85)
"""Colour of drives that balance."""
GOOD_IN_PART: Colour = (166, 217, 106)
"""Colour of parameters at which some of the stable states are balanced."""
RINGING: Colour = (159, 211, 169)
"""Colour of drives that will balance, but still ring down."""
BAD: Colour = (215, 64, 58)
"""Colour of drives that do not balance, of single runs whose balls circulate, and of bounds."""
CHANGING: Colour = (232, 139, 45)
"""Colour of drives that have not settled, and of a scene before it is tuned."""
STILL_CHANGING: Colour = (242, 180, 71)
"""Colour of areas in which drives have not settled."""
CIRCULATING: Colour = (106, 81, 163)
"""Colour of areas in which balls circulate."""
STOPPED: Colour = (122, 79, 163)
"""Colour of runs that were aborted, or have no value."""
NO_STATE: Colour = (59, 59, 59)
"""Colour of parameters without a resting state, and of diverged runs."""
DARK: Colour = (26, 26, 26)
MEDIUM: Colour = (90, 90, 90)
"""Colours of marks and hatches."""
UNDECIDED: Colour = (189, 189, 189)
OUTSIDE: Colour = (201, 201, 201)
NO_VALUE: Colour = (217, 217, 217)
LEFT_OUT: Colour = (228, 228, 228)
"""Colours of areas that are undecided, out of bounds, without a value, or not computed."""
PREDICTED: Colour = (136, 136, 136)
DOT: Colour = (154, 154, 154)
MAIN: Colour = (43, 108, 163)
"""Colour of the main curve or bar of a study of many runs."""
MAIN_DARK: Colour = (31, 78, 140)
MAIN_PALE: Colour = (185, 207, 227)
"""Darker and paler variant of ``MAIN``, for further curves or bars."""
OPPOSITE: Colour = (196, 98, 45)
"""Colour of bars that show a change opposite to that of the bars in ``MAIN_DARK``."""
BEST: Colour = (179, 0, 125)
WINDOW: Colour = (127, 191, 123)
CHOSEN: Colour = (27, 110, 46)
"""Colours of the best run, of a window of possible values, and of the chosen value."""
UNBALANCED_STATES: Sequence[Colour] = (
    (242, 180, 71), (232, 139, 45), (201, 143, 85), (239, 208, 140),
)  # fmt: skip
"""Colours of areas whose stable states are all unbalanced."""
BALANCED_TOO: Sequence[Colour] = (
    (79, 163, 181), (127, 199, 196), (75, 127, 176), (155, 184, 221),
)  # fmt: skip
"""Colours of areas with stable balance and other stable states."""

ON_LIGHT, _ON_BOTH = (0.35, 0.76), (0.45, 0.8)
"""Lightness (0 black, 1 white) that is visible on a light background, and on light and dark
ones."""
_GREATEST_CHROMA = 0.33
"""Largest chroma of any colour that a screen shows."""
_CONES = np.array([
    [0.4122214708, 0.5363325363, 0.0514459929],
    [0.2119034982, 0.6806995451, 0.1073969566],
    [0.0883024619, 0.2817188376, 0.6299787005],
])  # fmt: skip
_LAB = np.array([
    [0.2104542553, 0.7936177850, -0.0040720468],
    [1.9779984951, -2.4285922050, 0.4505937099],
    [0.0259040371, 0.7827717662, -0.8086757660],
])  # fmt: skip


@lru_cache
def ball_colour(number: int) -> Colour:
    """Return the colour of a ball by its number, from 0; it is the same in all pictures."""
    meant = (RUN, UNBALANCE, RESULTANT, BALANCED, GREY)
    return distinct(number + 1, FIRST_BALLS, avoid=meant, lightness=_ON_BOTH)[number]


def series_colours(count: int) -> list[Colour]:
    """Return the colours of a number of curves that do not belong to balls."""
    return distinct(count, SERIES, avoid=(GREY,), lightness=_ON_BOTH)


def hexadecimal(colour: Colour) -> str:
    """Return a colour in the notation of matplotlib, plotly and HTML: ``#rrggbb``."""
    return "#{:02x}{:02x}{:02x}".format(*colour)


def distinct(
    count: int,
    first: Sequence[Colour] = (),
    *,
    avoid: Sequence[Colour] = (),
    lightness: tuple[float, float] = ON_LIGHT,
    hues: tuple[float, float] = (0.0, 360.0),
) -> list[Colour]:
    """Return distinct colours; each one is as far as possible from those before it.

    So the first colours do not depend on the number of colours.

    Parameters
    ----------
    count
        Number of colours.
    first
        Colours to begin with.
    avoid
        Colours with other meanings.
    lightness
        Range of the lightness of colours after ``first``, 0 (black) to 1 (white).
    hues
        Range of the hues of colours after ``first``, in OKLab [deg]: 30 red, 70 orange, 110 yellow,
        140 green, 195 cyan, 265 blue, 325 purple.
    """
    chosen = list(first[:count])
    candidates = _candidates(lightness, hues)
    places = oklab(candidates)
    nearest = np.full(len(candidates), np.inf)
    for taken in (*chosen, *avoid):
        nearest = np.minimum(nearest, _from(places, taken))
    while len(chosen) < count:
        red, green, blue = candidates[int(np.argmax(nearest))].tolist()
        chosen.append((red, green, blue))
        nearest = np.minimum(nearest, _from(places, chosen[-1]))
    return chosen


def oklab(colours: Sequence[Colour] | np.ndarray) -> np.ndarray:
    """Return lightness, green to red, and blue to yellow of colours: shape (colours, 3)."""
    encoded = np.asarray(colours, float).reshape(-1, 3) / 255.0
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    return np.asarray(np.cbrt(linear @ _CONES.T) @ _LAB.T)


@lru_cache
def _candidates(lightness: tuple[float, float], hues: tuple[float, float]) -> np.ndarray:
    """Return a grid of vivid colours within ranges of lightness and hue, of shape (colours, 3)."""
    grid = np.arange(0, 256, 15)
    colours = np.stack(np.meshgrid(grid, grid, grid, indexing="ij"), axis=-1).reshape(-1, 3)
    light, a, b = oklab(colours).T
    hue = np.degrees(np.arctan2(b, a)) % 360.0
    vivid = np.hypot(a, b) > 0.2 * _GREATEST_CHROMA
    fits = (lightness[0] <= light) & (light <= lightness[1])
    return np.asarray(colours[fits & vivid & (hues[0] <= hue) & (hue <= hues[1])])


def _from(places: np.ndarray, colour: Colour) -> np.ndarray:
    """Return the distances in OKLab of colours from one colour, shape (colours,)."""
    return np.asarray(np.linalg.norm(places - oklab([colour]), axis=1))
