"""Messages of the contract in CDR, out of numbers; those that `ab_msgs_py` and ROS make, too."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from rosbags.typesys import Stores, get_typestore

from ab_sim.bags import contract
from ab_sim.scene import frames

TYPES = get_typestore(Stores.ROS2_KILTED)
"""ROS 2's standard messages; those that the contract uses are the same in Jazzy."""

HOUSING, DECK = frames.HOUSING, frames.DECK
LEVELS = {10: "DEBUG", 20: "INFO", 30: "WARN", 40: "ERROR", 50: "FATAL"}
_NUMBERS = {"TRACE": 10, "CRITICAL": 50, **{name: number for number, name in LEVELS.items()}}


def frame_of(namespace: str, name: str) -> str:
    """A frame's full name."""
    return f"{namespace}/{name}".lstrip("/")


def encoded(type_name: str, **fields: Any) -> bytes:
    """A message of a type in CDR."""
    return bytes(TYPES.serialize_cdr(_made(type_name, **fields), type_name))


def decoded(message: bytes, type_name: str) -> Any:
    """The message that is in CDR.

    Raises:
        ValueError: it is none of that type.
    """
    try:
        return TYPES.deserialize_cdr(message, type_name)
    except Exception as error:  # rosbags raises whatever it stumbles over
        raise ValueError(f"not a {type_name}: {error}") from error


def nanoseconds_of(stamp: Any) -> int:
    """A stamp in ns."""
    return int(stamp.sec) * 10**9 + int(stamp.nanosec)


def description_message(description: Mapping[str, Any]) -> bytes:
    """As ``drive_description``."""
    return encoded(contract.DESCRIPTION.type, data=json.dumps(dict(description)))


def text_message(text: str) -> bytes:
    """As ``profile_controller/status``."""
    return encoded(contract.PROFILE_STATUS.type, data=text)


def number_message(number: float) -> bytes:
    """As ``spindle/command``."""
    return encoded(contract.COMMAND.type, data=float(number))


def clock_message(time: int) -> bytes:
    """As ``/clock``; time [ns]."""
    return encoded(contract.CLOCK.type, clock=_stamp(time))


def block_message(channels: Sequence[str], samples: np.ndarray) -> bytes:
    """As ``vibration/block``; samples of shape (samples, channels)."""
    rows, columns = samples.shape
    dimension = "std_msgs/msg/MultiArrayDimension"
    dims = [
        _made(dimension, label="sample", size=rows, stride=rows * columns),
        _made(dimension, label=",".join(channels), size=columns, stride=columns),
    ]
    layout = _made("std_msgs/msg/MultiArrayLayout", dim=dims, data_offset=0)
    return encoded(contract.BLOCK.type, layout=layout, data=np.ascontiguousarray(samples).ravel())


def joint_message(
    time: int,
    frame: str,
    angles: np.ndarray,
    rates: np.ndarray,
    efforts: np.ndarray,
) -> bytes:
    """As ``joint_states``: the spindle's first, then those of the balls."""
    names = ["spindle", *(f"ball_{ball}" for ball in range(len(angles) - 1))]
    return encoded(
        contract.JOINT_STATES.type,
        header=_header(time, frame),
        name=names,
        position=angles,
        velocity=rates,
        effort=efforts,
    )


def vibration_message(
    time: int, frame: str, linear: np.ndarray, angular: np.ndarray | None = None
) -> bytes:
    """As ``vibration``; vectors of three."""
    turning = np.zeros(3) if angular is None else angular
    accel = _made("geometry_msgs/msg/Accel", linear=_vector(linear), angular=_vector(turning))
    return encoded(contract.VIBRATION.type, header=_header(time, frame), accel=accel)


def whirl_message(time: int, frame: str, place: np.ndarray) -> bytes:
    """As ``whirl``; a vector of three [m]."""
    return encoded(contract.WHIRL.type, header=_header(time, frame), point=_vector(place, "Point"))


def pose_message(time: int, frame: str, place: np.ndarray, turn: np.ndarray) -> bytes:
    """As ``deck_pose``; a place [m] and a quaternion, w first."""
    axes = dict(zip("wxyz", turn.tolist(), strict=True))
    quaternion = _made("geometry_msgs/msg/Quaternion", **axes)
    pose = _made("geometry_msgs/msg/Pose", position=_vector(place, "Point"), orientation=quaternion)
    return encoded(contract.DECK_POSE.type, header=_header(time, frame), pose=pose)


def log_message(time: int, level: str, logger: str, text: str) -> bytes:
    """As an entry of ``/rosout``."""
    return encoded(
        contract.EVENTS.type,
        stamp=_stamp(time),
        level=_NUMBERS.get(level, 20),
        name=logger,
        msg=text,
        file="",
        function="",
        line=0,
    )


def _made(type_name: str, **fields: Any) -> Any:
    return TYPES.types[type_name](**fields)


def _stamp(time: int) -> Any:
    return _made("builtin_interfaces/msg/Time", sec=time // 10**9, nanosec=time % 10**9)


def _header(time: int, frame: str) -> Any:
    return _made("std_msgs/msg/Header", stamp=_stamp(time), frame_id=frame)


def _vector(vector: np.ndarray, kind: str = "Vector3") -> Any:
    return _made(f"geometry_msgs/msg/{kind}", **dict(zip("xyz", vector.tolist(), strict=True)))
