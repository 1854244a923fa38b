"""The spindle's speed over time: schedules of profiles, set-points, and the speed servo."""

from ab_sim.model.spindle.schedule import ScheduledSegment, SpeedSchedule, top_speed_of
from ab_sim.model.spindle.servo import SpeedServo
from ab_sim.model.spindle.speed_laws import RaisedCosine, Ramp

__all__ = [
    "ScheduledSegment",
    "RaisedCosine",
    "Ramp",
    "SpeedSchedule",
    "SpeedServo",
    "top_speed_of",
]
