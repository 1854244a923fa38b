"""Typed samples, to and from standard messages. Stamps are integer nanoseconds."""

import json
import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from builtin_interfaces.msg import Time
from geometry_msgs.msg import (
    AccelStamped,
    Point,
    PointStamped,
    PoseStamped,
    Quaternion,
    TransformStamped,
    Vector3,
)
from rcl_interfaces.msg import Log
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, String

from ab_msgs_py.errors import MalformedMessage

HOUSING = "drive_housing"
"""Frame of inertial axes at the shaft's rest position, x and y across the shaft (REP-103)."""
DECK = "deck"
"""Frame of the deck's own axes, z along the shaft; at rest they are those of HOUSING."""

Triple = tuple[float, float, float]
Turn = tuple[float, float, float, float]
"""A quaternion, w first."""


def frame_of(namespace: str, name: str) -> str:
    """A frame's name: frames are not relative to a node's namespace by themselves.

    Args:
        namespace: of the node that speaks of it.
        name: as in HOUSING, DECK, or an accelerometer's.
    """
    return f"{namespace}/{name}".lstrip("/")


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
    except (ValueError, RecursionError) as error:
        raise MalformedMessage(f"drive_description is not JSON: {error}") from error
    if not isinstance(description, dict):
        raise MalformedMessage("drive_description must be a JSON object")
    return description


def faults_message(faults: Iterable[str]) -> String:
    """Faults in force, each as it is asked for."""
    return String(data=json.dumps(list(faults)))


def faults_of(message: String) -> list[str]:
    """Faults in force.

    Raises:
        MalformedMessage: it is no list of texts.
    """
    try:
        faults = json.loads(message.data)
    except (ValueError, RecursionError) as error:
        raise MalformedMessage(f"faults must be a JSON list: {error}") from error
    if not isinstance(faults, list) or not all(isinstance(fault, str) for fault in faults):
        raise MalformedMessage(f"faults must be a JSON list of texts, not {message.data!r}")
    return faults


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
    frame: str = HOUSING

    def message(self) -> JointState:
        """As JointState; the spindle's effort is NaN where no motor is modelled."""
        message = JointState()
        message.header.stamp = stamp(self.time)
        message.header.frame_id = self.frame
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
            str(message.header.frame_id),
        )


@dataclass(frozen=True)
class WhirlSample:
    """The deck's displacement at one instant, as ``whirl``."""

    time: int
    """Simulated time [ns]."""
    place: Triple
    """From the shaft's rest position [m]."""
    frame: str = HOUSING

    def message(self) -> PointStamped:
        """As PointStamped."""
        message = PointStamped(point=Point(**_axes(self.place)))
        _head(message, self.time, self.frame)
        return message

    @classmethod
    def of(cls, message: PointStamped) -> "WhirlSample":
        """Out of a PointStamped."""
        return cls(*_headed(message, _triple(message.point)))


@dataclass(frozen=True)
class VibrationSample:
    """The deck's acceleration, or what an accelerometer on it reads, as ``vibration``."""

    time: int
    """Simulated time [ns]."""
    linear: Triple
    """m/s^2."""
    angular: Triple = (0.0, 0.0, 0.0)
    """rad/s^2; an accelerometer reads none."""
    frame: str = HOUSING
    """Its axes: the housing's, or an accelerometer's own."""

    def message(self) -> AccelStamped:
        """As AccelStamped."""
        message = AccelStamped()
        message.accel.linear = Vector3(**_axes(self.linear))
        message.accel.angular = Vector3(**_axes(self.angular))
        _head(message, self.time, self.frame)
        return message

    @classmethod
    def of(cls, message: AccelStamped) -> "VibrationSample":
        """Out of an AccelStamped."""
        accel = message.accel
        time, linear, frame = _headed(message, _triple(accel.linear))
        return cls(time, linear, _triple(accel.angular), frame)


@dataclass(frozen=True)
class PoseSample:
    """Where the deck is and how it is turned at one instant, as ``deck_pose`` and as tf."""

    time: int
    """Simulated time [ns]."""
    place: Triple
    """Of the origin of its axes [m]."""
    turn: Turn
    """From its axes to those of ``frame``, of unit length."""
    frame: str = HOUSING

    def message(self) -> PoseStamped:
        """As PoseStamped."""
        message = PoseStamped()
        message.pose.position = Point(**_axes(self.place))
        message.pose.orientation = _quaternion(self.turn)
        _head(message, self.time, self.frame)
        return message

    def transform(self, child: str) -> TransformStamped:
        """As the pose of the frame ``child``, for tf."""
        message = TransformStamped(child_frame_id=child)
        message.transform.translation = Vector3(**_axes(self.place))
        message.transform.rotation = _quaternion(self.turn)
        _head(message, self.time, self.frame)
        return message

    @classmethod
    def of(cls, message: PoseStamped) -> "PoseSample":
        """Out of a PoseStamped."""
        time, place, frame = _headed(message, _triple(message.pose.position))
        return cls(time, place, _turn(message.pose.orientation), frame)

    @classmethod
    def of_transform(cls, message: TransformStamped) -> "PoseSample":
        """Out of tf."""
        transform = message.transform
        time, place, frame = _headed(message, _triple(transform.translation))
        return cls(time, place, _turn(transform.rotation), frame)


def _axes(vector: Triple) -> dict[str, float]:
    return dict(zip("xyz", vector, strict=True))


def _triple(vector: Any) -> Triple:
    return vector.x, vector.y, vector.z


def _quaternion(turn: Turn) -> Quaternion:
    return Quaternion(**dict(zip("wxyz", turn, strict=True)))


def _turn(quaternion: Any) -> Turn:
    return quaternion.w, quaternion.x, quaternion.y, quaternion.z


def _head(message: Any, time: int, frame: str) -> None:
    message.header.stamp = stamp(time)
    message.header.frame_id = frame


def _headed(message: Any, content: Triple) -> tuple[int, Triple, str]:
    return nanoseconds_of(message.header.stamp), content, str(message.header.frame_id)
