"""Balls that stall in one bunch near the critical speed: motion, stability and limits."""

from ab_sim.analysis.circulating.bunch import (
    BunchDrive,
    CirculatingBunch,
    bunches,
    drive_of,
    reason_not_covered,
    stalled,
)
from ab_sim.analysis.circulating.lasting import lasting_speed, state_of_bunch
from ab_sim.analysis.circulating.ranges import BunchRange, drag_ranges, speed_ranges

__all__ = [
    "BunchDrive",
    "CirculatingBunch",
    "BunchRange",
    "bunches",
    "drive_of",
    "lasting_speed",
    "drag_ranges",
    "speed_ranges",
    "stalled",
    "state_of_bunch",
    "reason_not_covered",
]
