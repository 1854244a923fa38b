"""Periodic solutions at a constant spindle speed, and their stability (Floquet)."""

from ab_sim.analysis.floquet.follow import Border, Followed, FollowedPoint, follow
from ab_sim.analysis.floquet.stability import (
    Stability,
    held_speed,
    largest_of,
    none_found,
    solutions_of,
)
from ab_sim.analysis.floquet.turn import STARTS, Orbit, TurnMap

__all__ = [
    "STARTS",
    "Border",
    "Followed",
    "Orbit",
    "FollowedPoint",
    "Stability",
    "TurnMap",
    "follow",
    "held_speed",
    "largest_of",
    "none_found",
    "solutions_of",
]
