"""Sizes of what a scene does not give, for pictures of it; no physics knows them."""

PLATE = 1.7
"""Half the side of a deck's plate whose mounts are not known, in race radii."""
DISC = 1.3
"""Radius of the disc, in race radii."""
MARK, MARK_PLACE = 0.07, 1.1
"""Radius of the mark in the direction of the unbalance, and its distance from the shaft, in race
radii."""


def ball_radius(race: float, count: int) -> float:
    """Of balls whose radius is not given, in the unit of the race's: they have room."""
    return race * min(0.1, 2.5 / max(count, 1))
