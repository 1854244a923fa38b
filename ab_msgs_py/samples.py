"""Typed samples, to and from standard messages. Stamps are integer nanoseconds."""

import json
import math
from dataclasses import dataclass
from typing import Any

from builtin_interfaces.msg import Time
from geometry_msgs.msg import AccelStamped, PointStamped
from rcl_interfaces.msg import Log
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, String

from ab_msgs_py.errors import MalformedMessage

FRAME = "drive_housing"
"""Inertial axes at the shaft's rest position, x and y across the shaft (REP-103)."""


def stamp(nanoseconds: int) -> Time:
    """A stamp out of simulated time [ns]."""
    return Time(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)


def nanoseconds_of(time: Time) -> int:
    """Simulated time [ns] of a stamp."""
    return int(time.sec) * 10**9 + int(time.nanosec)


def command_message(speed: float) -> Float64:
    """A command [rad/s]."""
    return Float64(data=float(speed))


def command_of(message: Float64) -> float:
    """The speed [rad/s] that a command asks for; whether it may be followed is the drive's say."""
    return float(message.data)


def text_message(text: str) -> String:
    """A latched word, such as the profile controller's state."""
    return String(data=text)


def text_of(message: String) -> str:
    """The word in a message."""
    return str(message.data)


def description_message(description: dict[str, Any]) -> String:
    """What is being simulated."""
    return String(data=json.dumps(description))


def description_of(message: String) -> dict[str, Any]:
    """What is being simulated.

    Raises:
        MalformedMessage: not a JSON object.
    """
    try:
        description = json.loads(message.data)
    except ValueError as error:
        raise MalformedMessage(f"drive_description is not JSON: {error}") from error
    if not isinstance(description, dict):
        raise MalformedMessage("drive_description must be a JSON object")
    return description


def clock_message(nanoseconds: int) -> Clock:
    """Simulated time."""
    return Clock(clock=stamp(nanoseconds))


def event_of(message: Log) -> tuple[int, str, str, str]:
    """A log entry: stamp [ns], level (DEBUG, INFO, WARN, ERROR, FATAL), node, text."""
    names = {10: "DEBUG", 20: "INFO", 30: "WARN", 40: "ERROR", 50: "FATAL"}
    level = names.get(int(message.level), "INFO")
    return nanoseconds_of(message.stamp), level, str(message.name), str(message.msg)


@dataclass(frozen=True)
class JointSample:
    """Spindle and balls at one instant, as ``joint_states``."""

    time: int
    """Simulated time [ns]."""
    spindle_angle: float
    """psi [rad], unwrapped."""
    spindle_speed: float
    """w [rad/s]."""
    ball_angles: tuple[float, ...]
    """From the unbalance, unwrapped [rad]."""
    ball_rates: tuple[float, ...]
    """Relative to the race [rad/s]."""
    ball_torques: tuple[float, ...]
    """Driving torque about the shaft, in the direction of growing angle [N m]."""
    spindle_torque: float | None = None
    """The motor's torque [N m]; None where no motor is modelled."""

    def message(self) -> JointState:
        """As JointState; the spindle's effort is NaN where no motor is modelled."""
        message = JointState()
        message.header.stamp = stamp(self.time)
        message.header.frame_id = FRAME
        message.name = ["spindle", *(f"ball_{i}" for i in range(len(self.ball_angles)))]
        message.position = [self.spindle_angle, *self.ball_angles]
        message.velocity = [self.spindle_speed, *self.ball_rates]
        torque = math.nan if self.spindle_torque is None else self.spindle_torque
        message.effort = [torque, *self.ball_torques]
        return message

    @classmethod
    def of(cls, message: JointState) -> "JointSample":
        """Out of a JointState.

        Raises:
            MalformedMessage: not a spindle and its balls.
        """
        names = list(message.name)
        if names != ["spindle", *(f"ball_{i}" for i in range(len(names) - 1))]:
            raise MalformedMessage(f"joint_states names {names}: expected spindle, ball_0, ...")
        for field in ("position", "velocity", "effort"):
            if len(getattr(message, field)) != len(names):
                raise MalformedMessage(f"joint_states.{field} must have {len(names)} entries")
        return cls(
            nanoseconds_of(message.header.stamp),
            message.position[0],
            message.velocity[0],
            tuple(message.position[1:]),
            tuple(message.velocity[1:]),
            tuple(message.effort[1:]),
            None if math.isnan(message.effort[0]) else message.effort[0],
        )


@dataclass(frozen=True)
class VectorSample:
    """A vector across the shaft at one instant: displacement, acceleration, or a reading."""

    time: int
    """Simulated time [ns]."""
    x: float
    y: float
    frame: str = FRAME
    """Its axes: FRAME, or the name of an accelerometer, whose first axis is x, the second y."""

    def whirl_message(self) -> PointStamped:
        """As ``whirl`` [m]."""
        message = PointStamped()
        message.header.stamp = stamp(self.time)
        message.header.frame_id = self.frame
        message.point.x, message.point.y = self.x, self.y
        return message

    def vibration_message(self) -> AccelStamped:
        """As ``vibration`` [m/s^2]."""
        message = AccelStamped()
        message.header.stamp = stamp(self.time)
        message.header.frame_id = self.frame
        message.accel.linear.x, message.accel.linear.y = self.x, self.y
        return message

    @classmethod
    def of_whirl(cls, message: PointStamped) -> "VectorSample":
        """Out of ``whirl``."""
        header = message.header
        return cls(nanoseconds_of(header.stamp), message.point.x, message.point.y, header.frame_id)

    @classmethod
    def of_vibration(cls, message: AccelStamped) -> "VectorSample":
        """Out of ``vibration``."""
        header, linear = message.header, message.accel.linear
        return cls(nanoseconds_of(header.stamp), linear.x, linear.y, header.frame_id)
