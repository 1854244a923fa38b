"""As many colours as there are things to tell apart, far from each other as people see them.

Distances are those of OKLab (B. Ottosson, A perceptual color space for image processing, 2020), in
which equal steps look about equally large.
"""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

Colour = tuple[int, int, int]
"""Red, green and blue, 0 to 255 (sRGB)."""

ON_LIGHT, ON_DARK = (0.35, 0.76), (0.55, 0.9)
"""Lightness (0 black, 1 white) that is seen on a light and on a dark ground."""
GREATEST_CHROMA = 0.33
"""Of any colour that a screen shows."""
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


def distinct(
    count: int,
    first: Sequence[Colour] = (),
    *,
    avoid: Sequence[Colour] = (),
    lightness: tuple[float, float] = ON_LIGHT,
    hues: tuple[float, float] = (0.0, 360.0),
) -> list[Colour]:
    """Colours of which no two are alike; each next one is the farthest from those before it.

    So the first ones do not depend on how many are asked for.

    Args:
        count: how many.
        first: those to begin with.
        avoid: colours that mean something else.
        lightness: range of those after the first, 0 to 1.
        hues: range of those after the first [deg] in OKLab: 30 red, 70 orange, 110 yellow, 140
            green, 195 cyan, 265 blue, 325 purple.
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
    """Lightness, green to red, blue to yellow of colours: shape (colours, 3)."""
    encoded = np.asarray(colours, float).reshape(-1, 3) / 255.0
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    return np.asarray(np.cbrt(linear @ _CONES.T) @ _LAB.T)


@lru_cache
def _candidates(lightness: tuple[float, float], hues: tuple[float, float]) -> np.ndarray:
    """What a screen can show within the ranges, but for dull colours; shape (colours, 3)."""
    grid = np.arange(0, 256, 15)
    colours = np.stack(np.meshgrid(grid, grid, grid, indexing="ij"), axis=-1).reshape(-1, 3)
    light, a, b = oklab(colours).T
    hue = np.degrees(np.arctan2(b, a)) % 360.0
    vivid = np.hypot(a, b) > 0.2 * GREATEST_CHROMA
    fits = (lightness[0] <= light) & (light <= lightness[1])
    return np.asarray(colours[fits & vivid & (hues[0] <= hue) & (hue <= hues[1])])


def _from(places: np.ndarray, colour: Colour) -> np.ndarray:
    return np.asarray(np.linalg.norm(places - oklab([colour]), axis=1))
