"""Colours that people with any kind of sight tell apart."""

BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
YELLOW, BLUE, VERMILION, PURPLE = "#F0E442", "#0072B2", "#D55E00", "#CC79A7"
GREY = "#737373"
"""Okabe and Ito, Color Universal Design (2008); yellow is left out of curves: it is too light."""

CURVES = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, BLACK)
"""Of the first curves of the same kind."""
MAP = "cividis"
"""Of maps: dark to light in one sense, made for colour-blind readers."""
