"""Typed samples and their conversion to and from the fields of standard messages.

Stamps are integer nanoseconds.
"""

import json
import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

from ab_msgs_py.ros_messages import Fields, MalformedMessage

HOUSING = "drive_housing"
"""Name of the frame with inertial axes at the shaft's rest position, x and y across the shaft
(REP-103)."""
DECK = "deck"
"""Name of the frame with the deck's axes, z along the shaft; at rest they are those of HOUSING."""

Triple = tuple[float, float, float]
Turn = tuple[float, float, float, float]
"""Quaternion, w first."""


def frame_of(namespace: str, name: str) -> str:
    """Return the full name of a frame. ROS does not apply a node's namespace to frames.

    Parameters
    ----------
    namespace
        Namespace of the node that publishes the frame.
    name
        HOUSING, DECK, or the name of an accelerometer.
    """
    return f"{namespace}/{name}".lstrip("/")


def stamp(nanoseconds: int) -> Fields:
    """Return the fields of a stamp for a simulated time [ns]."""
    sec, nanosec = divmod(nanoseconds, 10**9)
    return {"sec": sec, "nanosec": nanosec}


def header(time: int, frame: str) -> Fields:
    """Return the fields of a header, from a time [ns] and a frame."""
    return {"stamp": stamp(time), "frame_id": frame}


def axes(vector: Triple) -> Fields:
    """Return the fields of a point or a vector."""
    return dict(zip("xyz", vector, strict=True))


def nanoseconds_of(time: Any) -> int:
    """Return the simulated time [ns] of a stamp."""
    return int(time.sec) * 10**9 + int(time.nanosec)


def number_fields(number: float) -> Fields:
    """Return the fields of a single number, such as a command [rad/s]."""
    return {"data": float(number)}


def number_of(message: Any) -> float:
    """Return the number in a message, unchecked, because the drive checks commands."""
    return float(message.data)


def joint_speed_fields(speed: float) -> Fields:
    """Return the fields of a JointState that commands the spindle's speed [rad/s]."""
    return {
        "header": header(0, ""),
        "name": ["spindle"],
        "position": [],
        "velocity": [float(speed)],
        "effort": [],
    }


def joint_speed_of(message: Any) -> float:
    """Return the spindle's speed [rad/s] in a JointState that commands it.

    Raises
    ------
    MalformedMessage
        Another joint, position or effort is commanded, or the speed is NaN.
    """
    if list(message.name) != ["spindle"]:
        raise MalformedMessage(f"name = {list(message.name)}: must be ['spindle']")
    if len(message.velocity) != 1 or len(message.position) or len(message.effort):
        raise MalformedMessage("must have one velocity, and neither position nor effort")
    if math.isnan(message.velocity[0]):
        raise MalformedMessage("velocity of spindle is NaN: no controller commands it yet")
    return float(message.velocity[0])


def text_fields(text: str) -> Fields:
    """Return the fields of a single text, such as the profile controller's state."""
    return {"data": text}


def text_of(message: Any) -> str:
    """Return the text in a message."""
    return str(message.data)


def json_fields(value: Any) -> Fields:
    """Return the fields of a text message that contains a value as JSON."""
    return {"data": json.dumps(value)}


def description_of(message: Any) -> dict[str, Any]:
    """Return the description of the simulated drive.

    Raises
    ------
    MalformedMessage
        The message is not a JSON object.
    """
    try:
        description = json.loads(message.data)
    except (ValueError, RecursionError) as error:
        raise MalformedMessage(f"drive_description is not JSON: {error}") from error
    if not isinstance(description, dict):
        raise MalformedMessage("drive_description must be a JSON object")
    return description


def faults_of(message: Any) -> list[str]:
    """Return the drive's present faults, as texts.

    Raises
    ------
    MalformedMessage
        The message is not a JSON list of texts.
    """
    try:
        faults = json.loads(message.data)
    except (ValueError, RecursionError) as error:
        raise MalformedMessage(f"faults must be a JSON list: {error}") from error
    if not isinstance(faults, list) or not all(isinstance(fault, str) for fault in faults):
        raise MalformedMessage(f"faults must be a JSON list of texts, not {message.data!r}")
    return faults


def clock_fields(nanoseconds: int) -> Fields:
    """Return the fields of a Clock message for a simulated time [ns]."""
    return {"clock": stamp(nanoseconds)}


def clock_of(message: Any) -> int:
    """Return the simulated time [ns] in a Clock message."""
    return nanoseconds_of(message.clock)


class Event(NamedTuple):
    """Entry of a node's log."""

    time: int
    """Stamp of the entry [ns]."""
    level: str
    """DEBUG, INFO, WARN, ERROR or FATAL."""
    node: str
    """Name of the node's logger."""
    text: str


_LEVELS = {10: "DEBUG", 20: "INFO", 30: "WARN", 40: "ERROR", 50: "FATAL"}
_NUMBERS = {"TRACE": 10, "CRITICAL": 50, **{name: number for number, name in _LEVELS.items()}}


def event_fields(event: Event) -> Fields:
    """Return the fields of a log entry; a level unknown to ROS becomes INFO."""
    return {
        "stamp": stamp(event.time),
        "level": _NUMBERS.get(event.level, 20),
        "name": event.node,
        "msg": event.text,
        "file": "",
        "function": "",
        "line": 0,
    }


def event_of(message: Any) -> Event:
    """Return the log entry in a message."""
    level = _LEVELS.get(int(message.level), "INFO")
    return Event(nanoseconds_of(message.stamp), level, str(message.name), str(message.msg))


@dataclass(frozen=True)
class JointSample:
    """Spindle and balls at one instant, as ``joint_states``."""

    time: int
    """Simulated time [ns]."""
    spindle_angle: float
    """Angle psi [rad], unwrapped."""
    spindle_speed: float
    """Speed w [rad/s]."""
    ball_angles: tuple[float, ...]
    """Angles from the unbalance, unwrapped [rad]."""
    ball_rates: tuple[float, ...]
    """Angular velocities relative to the race [rad/s]."""
    ball_torques: tuple[float, ...]
    """Driving torques about the shaft, in the direction of increasing angle [N m]."""
    spindle_torque: float | None = None
    """Torque of the motor [N m]; None without a motor model."""
    frame: str = HOUSING

    def fields(self) -> Fields:
        """Return the fields of a JointState; the spindle's effort is NaN without a motor model."""
        torque = math.nan if self.spindle_torque is None else self.spindle_torque
        return {
            "header": header(self.time, self.frame),
            "name": ["spindle", *(f"ball_{i}" for i in range(len(self.ball_angles)))],
            "position": [self.spindle_angle, *self.ball_angles],
            "velocity": [self.spindle_speed, *self.ball_rates],
            "effort": [torque, *self.ball_torques],
        }

    @classmethod
    def of(cls, message: Any) -> "JointSample":
        """Return the sample in a JointState.

        Raises
        ------
        MalformedMessage
            The joints are not a spindle and its balls.
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


def spindle_of(message: Any) -> tuple[int, float, float] | None:
    """Return time [ns], angle [rad] and speed [rad/s] of the spindle in a JointState.

    A controller board gets only these values. Return None for a message of another machine.
    """
    names = list(message.name)
    if "spindle" not in names or not len(message.position) == len(message.velocity) == len(names):
        return None
    at = names.index("spindle")
    return nanoseconds_of(message.header.stamp), message.position[at], message.velocity[at]


@dataclass(frozen=True)
class WhirlSample:
    """Displacement of the deck at one instant, as ``whirl``."""

    time: int
    """Simulated time [ns]."""
    place: Triple
    """Displacement from the shaft's rest position [m]."""
    frame: str = HOUSING

    def fields(self) -> Fields:
        """Return the fields of a PointStamped."""
        return {"header": header(self.time, self.frame), "point": axes(self.place)}

    @classmethod
    def of(cls, message: Any) -> "WhirlSample":
        """Return the sample in a PointStamped."""
        return cls(*_headed(message, _triple(message.point)))


@dataclass(frozen=True)
class VibrationSample:
    """Sample of ``vibration``: acceleration of the deck, or reading of an accelerometer."""

    time: int
    """Simulated time [ns]."""
    linear: Triple
    """Linear acceleration [m/s^2]."""
    angular: Triple = (0.0, 0.0, 0.0)
    """Angular acceleration [rad/s^2]; zero from an accelerometer, which does not measure it."""
    frame: str = HOUSING
    """Frame of the axes: the housing's, or an accelerometer's."""

    def fields(self) -> Fields:
        """Return the fields of an AccelStamped."""
        accel = {"linear": axes(self.linear), "angular": axes(self.angular)}
        return {"header": header(self.time, self.frame), "accel": accel}

    @classmethod
    def of(cls, message: Any) -> "VibrationSample":
        """Return the sample in an AccelStamped."""
        accel = message.accel
        time, linear, frame = _headed(message, _triple(accel.linear))
        return cls(time, linear, _triple(accel.angular), frame)


@dataclass(frozen=True)
class PoseSample:
    """Position and orientation of the deck at one instant, as ``deck_pose`` and as tf."""

    time: int
    """Simulated time [ns]."""
    place: Triple
    """Position of the origin of the deck's axes [m]."""
    turn: Turn
    """Unit quaternion from the deck's axes to those of ``frame``."""
    frame: str = HOUSING

    def fields(self) -> Fields:
        """Return the fields of a PoseStamped."""
        pose = {"position": axes(self.place), "orientation": _quaternion(self.turn)}
        return {"header": header(self.time, self.frame), "pose": pose}

    @classmethod
    def of(cls, message: Any) -> "PoseSample":
        """Return the sample in a PoseStamped."""
        time, place, frame = _headed(message, _triple(message.pose.position))
        return cls(time, place, _turn(message.pose.orientation), frame)


Frames = Iterable[tuple[str, PoseSample]]
"""Frames: each with its name and its pose in the parent frame."""


def frames_fields(frames: Frames) -> Fields:
    """Return the fields of a TFMessage."""
    return {
        "transforms": [
            {
                "header": header(pose.time, pose.frame),
                "child_frame_id": child,
                "transform": {
                    "translation": axes(pose.place),
                    "rotation": _quaternion(pose.turn),
                },
            }
            for child, pose in frames
        ]
    }


def frames_of(message: Any) -> list[tuple[str, PoseSample]]:
    """Return the frames and poses in a TFMessage."""
    frames = []
    for transform in message.transforms:
        time, place, frame = _headed(transform, _triple(transform.transform.translation))
        pose = PoseSample(time, place, _turn(transform.transform.rotation), frame)
        frames.append((str(transform.child_frame_id), pose))
    return frames


def _triple(vector: Any) -> Triple:
    return vector.x, vector.y, vector.z


def _quaternion(turn: Turn) -> Fields:
    return dict(zip("wxyz", turn, strict=True))


def _turn(quaternion: Any) -> Turn:
    return quaternion.w, quaternion.x, quaternion.y, quaternion.z


def _headed(message: Any, content: Triple) -> tuple[int, Triple, str]:
    return nanoseconds_of(message.header.stamp), content, str(message.header.frame_id)


FORCE = slice(25, 28)
"""Positions of the acceleration among the floating-point numbers of an Imu message."""


@dataclass(frozen=True)
class ImuSample:
    """Reading of an accelerometer at one instant as ``imu/data_raw`` (REP-145).

    The axes are the sensor's. Orientation and angular velocity are marked as not reported: their
    covariance begins with -1.
    """

    time: int
    """Simulated time [ns]."""
    force: Triple
    """Specific force on the sensor's axes [m/s^2]."""
    variance: float
    """Variance of the noise on each axis [(m/s^2)^2]; 0: unknown."""
    frame: str

    def fields(self) -> Fields:
        """Return the fields of an Imu."""
        unknown = [-1.0] + [0.0] * 8
        nothing = axes((0.0, 0.0, 0.0))
        return {
            "header": header(self.time, self.frame),
            "orientation": {**nothing, "w": 1.0},
            "orientation_covariance": unknown,
            "angular_velocity": nothing,
            "angular_velocity_covariance": unknown,
            "linear_acceleration": axes(self.force),
            "linear_acceleration_covariance": [
                self.variance if k % 4 == 0 else 0.0 for k in range(9)
            ],
        }

    @classmethod
    def of(cls, message: Any) -> "ImuSample":
        """Return the sample in an Imu."""
        force = message.linear_acceleration
        return cls(
            nanoseconds_of(message.header.stamp),
            (force.x, force.y, force.z),
            float(message.linear_acceleration_covariance[0]),
            str(message.header.frame_id),
        )
