"""Motion of the spindle: prescribed by its speed profile, or driven by a motor of finite torque."""

from typing import Any, NamedTuple

from ab_sim.model.equations.motion import SpindleMotion
from ab_sim.model.equations.sums import Number, over_effects
from ab_sim.tracing.functions import cos, sin, where


class SegmentInputs(NamedTuple):
    """Position of a run on the speed profile."""

    segment: Any
    """Segment of the profile: speed, acceleration and angle as functions of local time."""
    phase: Number
    """Spindle angle at the segment's beginning [rad], without whole turns."""
    angle: Number
    """Spindle angle at the segment's beginning [rad], with whole turns: for samples."""


class MotorState(NamedTuple):
    """State of a spindle that a motor drives."""

    psi: Number
    """Angle [rad]."""
    speed: Number
    """Speed w [rad/s]."""
    integral: Number
    """Integral of the speed loop [rad]."""
    limit: Number
    """Limit branch: 1 or -1 while the motor is at its torque limit in that direction, else 0."""


class Torques(NamedTuple):
    """Torques from which a motor's events are located."""

    commanded: Number
    limit: Number
    """Torque commanded by the speed loop, and largest torque of the motor [N m]."""


def prescribed(
    effects: Any, place: SegmentInputs, time: Number, angle_needed: bool
) -> SpindleMotion:
    """Return the spindle's motion at a local time [s] of a segment."""
    acceleration = over_effects(
        effects, "spindle_acceleration", 0.0, place.segment.acceleration(time)
    )
    c, s = 1.0, 0.0
    if angle_needed:
        psi = place.phase + place.segment.angle(time)
        c, s = cos(psi), sin(psi)
    return SpindleMotion(place.segment.speed(time), acceleration, c, s, 0.0, 0.0)


def motor_driven(
    effects: Any, place: SegmentInputs, time: Number, at: MotorState, angle_needed: bool
) -> tuple[SpindleMotion, Torques]:
    """Return the motion of a spindle with a motor, and the torques from which events are located.

    The acceleration is 0 here, because the equations of motion determine it.
    """
    error = place.segment.speed(time) - at.speed
    commanded = over_effects(effects, "loop_torque", 0.0, error, at.integral)
    limit = over_effects(effects, "largest_torque", 0.0)
    delivered = where(abs(at.limit) > 0.5, at.limit * limit, commanded)
    rate = over_effects(effects, "integral_rate", 0.0, error, commanded - delivered)
    torque = delivered - over_effects(effects, "back_torque", 0.0, at.speed)
    c, s = (cos(at.psi), sin(at.psi)) if angle_needed else (1.0, 0.0)
    return SpindleMotion(at.speed, 0.0, c, s, torque, rate), Torques(commanded, limit)
