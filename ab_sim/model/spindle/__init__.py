"""The spindle's speed over time: schedules of profiles, set-points, and the speed servo."""

from ab_sim.model.spindle.commands import SpeedServo
from ab_sim.model.spindle.schedule import (
    RaisedCosine,
    Ramp,
    ScheduledSegment,
    SpeedSchedule,
    top_speed_of,
)

__all__ = [
    "ScheduledSegment",
    "RaisedCosine",
    "Ramp",
    "SpeedSchedule",
    "SpeedServo",
    "top_speed_of",
]
