"""Colours that people of all kinds of colour vision tell apart (Okabe and Ito), on dark ground."""

from functools import lru_cache

from ab_sim.palette import ON_DARK, Colour, distinct
from ab_sim.scene.sections import MAX_BALLS

GROUND: Colour = (14, 17, 19)
"""Of the drawings, whatever the viewer's theme: white is to be seen on it."""
GREY: Colour = (150, 150, 150)
DARK: Colour = (95, 95, 95)
WHITE: Colour = (240, 240, 240)
VERMILLION: Colour = (230, 85, 30)
GREEN: Colour = (0, 180, 130)
SKY: Colour = (86, 180, 233)
ORANGE: Colour = (240, 165, 0)
PURPLE: Colour = (210, 130, 175)
YELLOW: Colour = (240, 228, 66)
BLUE: Colour = (60, 130, 215)

SAND: Colour = (195, 165, 120)

UNBALANCE, RESULTANT, RESIDUAL = VERMILLION, GREEN, WHITE
BALANCED = YELLOW
"""Where balls balance."""
HUES = (SKY, ORANGE, PURPLE, BLUE, SAND)
"""Of the first balls and curves; none that has a meaning above."""


def hue(number: int) -> Colour:
    """Of the ball or curve of that number."""
    return _hues(max(MAX_BALLS, number + 1))[number]


@lru_cache
def _hues(count: int) -> list[Colour]:
    meant = (UNBALANCE, RESULTANT, RESIDUAL, BALANCED, GREY, DARK)
    return distinct(count, HUES, avoid=meant, lightness=ON_DARK)
