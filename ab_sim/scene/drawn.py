"""Stand-ins for sizes missing in a scene, for pictures only; physics does not use them."""

PLATE = 1.7
"""Half the side of the square plate that stands for a deck without mounts, in race radii."""
DISC = 1.3
"""Radius of the disc, in race radii."""
MARK, MARK_PLACE = 0.07, 1.1
"""Radius of the mark in the direction of the unbalance, and its distance from the shaft, in race
radii."""


def ball_radius(race: float, count: int) -> float:
    """Return the radius at which balls without one are drawn, in the unit of ``race``; all fit."""
    return race * min(0.1, 2.5 / max(count, 1))
