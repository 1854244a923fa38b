"""The spindle's speed: profiles as piecewise functions with breakpoints, and the speed servo."""

from ab_sim.spindle.profile import Piece, SpeedProfile, top_speed_of
from ab_sim.spindle.segments import RaisedCosine, Ramp
from ab_sim.spindle.servo import SpeedServo

__all__ = ["Piece", "RaisedCosine", "Ramp", "SpeedProfile", "SpeedServo", "top_speed_of"]
