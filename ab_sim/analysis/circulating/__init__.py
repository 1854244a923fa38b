"""Balls that stall in one bunch near the critical speed: motion, stability and limits."""

from ab_sim.analysis.circulating.bunch import (
    BunchDrive,
    CirculatingBunch,
    bunches,
    drive_of,
    stalled,
    why_not,
)
from ab_sim.analysis.circulating.lasting import lasting_speed, state_of_bunch
from ab_sim.analysis.circulating.reach import Reach, reach_over_drag, reach_over_speed

__all__ = [
    "BunchDrive",
    "CirculatingBunch",
    "Reach",
    "bunches",
    "drive_of",
    "lasting_speed",
    "reach_over_drag",
    "reach_over_speed",
    "stalled",
    "state_of_bunch",
    "why_not",
]
