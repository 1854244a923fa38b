"""Topics in bags, and their serialised messages (CDR); rosbags replaces ROS.

The topics are those of the contract (`ab_msgs_py.topics`), and two kinds only for bags.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from rosbags.interfaces import (
    Nodetype,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.interfaces import Qos as OfferedQos
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_typestore

from ab_msgs_py import Qos, Topic, topics
from ab_msgs_py.prefilled import Prefilled
from ab_msgs_py.topics import (
    BLOCK,
    COMMAND,
    DESCRIPTION,
    IMU,
    JOINT_STATES,
    PROBE,
    VIBRATION,
    WHIRL,
    imu_of,
    probe_of,
)

_FOREVER = QosTime(9223372036, 854775807)  # ROS 2: infinite


def offered_qos(qos: Qos) -> OfferedQos:
    """Return the QoS profile that a publisher of a topic offers, in the form of rosbags."""
    return OfferedQos(
        QosHistory.KEEP_LAST,
        qos.depth,
        QosReliability.RELIABLE if qos.reliable else QosReliability.BEST_EFFORT,
        QosDurability.TRANSIENT_LOCAL if qos.latched else QosDurability.VOLATILE,
        _FOREVER,
        _FOREVER,
        QosLiveliness.AUTOMATIC,
        _FOREVER,
        False,
    )


def topic_by_name(name: str) -> Topic | None:
    """Return the topic of the contract with a full name in any namespace; None if there is none."""
    matching = [topic for topic in topics.ALL if name.endswith("/" + topic.name.lstrip("/"))]
    return max(matching, key=lambda topic: len(topic.name)) if matching else None


OF_A_DRIVE = (DESCRIPTION, BLOCK, JOINT_STATES, VIBRATION, WHIRL, IMU, PROBE)
"""Topics of a drive; a namespace with at least one of them has a drive."""


def further_sensor(name: str, namespace: str) -> Topic | None:
    """Return the kind of topic of a drive's second or a further sensor: ``IMU`` or ``PROBE``.

    Return None if the full name ``name`` is not that of such a topic in the namespace.
    """
    for kind, of in ((IMU, imu_of), (PROBE, probe_of)):
        before, _, behind = of("*", False).within(namespace).partition("*")
        if (
            name.startswith(before)
            and name.endswith(behind)
            and "/" not in (sensor := name.removeprefix(before).removesuffix(behind))
            and sensor
        ):
            return kind
    return None


NUMBER = COMMAND._replace(name="recording/", qos=Qos())
"""Kind of topic only for bags: values of `Recording.scalar`, each on a topic with its name."""
DECIMATED = BLOCK._replace(name="recording/decimated", qos=Qos())
"""Topic that only bags have. Before each block of a decimated run, it has a block with the number
of omitted rows up to each row, and the rule of decimation."""
DECIMATED_CHANNELS = ("step", "time", "left_out", "every", "around")
"""Channels of ``DECIMATED``: step and time [s] of a kept row, count of omitted rows, and rule."""
NOTE = "recording."
"""Prefix of the logger's name in log messages that contain an entry of `Recording.event`."""


def logger_name(namespace: str, name: str) -> str:
    """Return the full name of a node's logger, as in log messages: ``namespace.name``."""
    return f"{namespace.strip('/').replace('/', '.')}.{name}".lstrip(".")


def drive_namespaces(names_and_types: Iterable[tuple[str, str]]) -> list[str]:
    """Return the sorted namespaces of drives, from the full names and the types of topics."""
    return sorted(
        {
            name.removesuffix(f"/{topic.name}") or "/"
            for name, type_name in names_and_types
            for topic in OF_A_DRIVE
            if name.endswith(f"/{topic.name}") and type_name == topic.type_name
        }
    )


TYPES = get_typestore(Stores.ROS2_KILTED)
"""ROS 2's standard messages; those of the contract are the same in Jazzy."""

_ROS_TYPE_NAMES = {"float64": "double", "float32": "float", "bool": "boolean", "byte": "octet"}
"""ROS's names of numeric types by rosbags' names, where these differ."""


def encoded(topic: Topic, sample: Any) -> bytes:
    """Return a sample as a serialised message (CDR) for a topic."""
    message = _message_of(topic.type_name, topic.conversion.fields(sample))
    return bytes(TYPES.serialize_cdr(message, topic.type_name))


def prefilled(topic: Topic, sample: Any) -> Prefilled:
    """Return a message template from a sample, in which only stamp and numbers change."""
    message = _message_of(topic.type_name, topic.conversion.fields(sample))
    return Prefilled(message, fields_of=_fields_of)


def decoded(message: bytes, type_name: str) -> Any:
    """Return the message that CDR bytes contain.

    Raises
    ------
    ValueError
        The bytes are not a message of that type.
    """
    try:
        try:
            return TYPES.deserialize_cdr(message, type_name)
        except SerdeError:
            if type_name != topics.JOINT_COMMAND.type_name:
                raise
            # ROS appends 12 bytes if the last field is an empty list.
            return TYPES.deserialize_cdr(message[:-12], type_name)
    except Exception as error:  # rosbags raises various errors
        raise ValueError(f"not a {type_name}: {error}") from error


def _message_of(type_name: str, fields: Mapping[str, Any]) -> Any:
    """Return a message object of rosbags from field values; nested messages are mappings."""
    kinds = dict(TYPES.get_msgdef(type_name).fields)
    return TYPES.types[type_name](**{key: _value(kinds[key], fields[key]) for key in kinds})


def _value(kind: Any, value: Any) -> Any:
    """Return a field's value as rosbags stores it: a message, number, array or list."""
    node, inner = kind
    if node is Nodetype.NAME:
        return _message_of(inner, value)
    if node is Nodetype.BASE:
        return value[0] if isinstance(value, bytes) else value  # ROS stores a byte as bytes
    if inner[0][0] is Nodetype.BASE and inner[0][1][0] != "string":
        return np.asarray(value, dtype=inner[0][1][0])
    return [_value(inner[0], element) for element in value]


def _fields_of(message: Any) -> dict[str, str]:
    """Return names and types of a message's fields, in the notation of ROS's message classes."""
    return {
        name: _ros_type_name(kind) for name, kind in TYPES.get_msgdef(message.__msgtype__).fields
    }


def _ros_type_name(kind: Any) -> str:
    """Return a field's type in ROS's notation: ``double``, ``sequence<double>``, ``pkg/Type``."""
    node, inner = kind
    if node is Nodetype.NAME:
        return str(inner).replace("/msg/", "/")
    if node is Nodetype.BASE:
        return _ROS_TYPE_NAMES.get(inner[0], str(inner[0]))
    element = _ros_type_name(inner[0])
    return f"sequence<{element}>" if node is Nodetype.SEQUENCE else f"{element}[{inner[1]}]"


class IgnoredMessages:
    """Counter of unusable messages by topic, with the error of the last one."""

    def __init__(self) -> None:
        self.ignored: dict[str, tuple[int, str]] = {}

    def ignore(self, topic: str, reason: object) -> None:
        """Count a message that cannot be used."""
        self.ignored[topic] = self.ignored.get(topic, (0, ""))[0] + 1, str(reason)

    @property
    def summary(self) -> str:
        """Text on the ignored messages, to append to an error message."""
        return "".join(
            f"; ignored {count} messages on {topic}, the last one: {reason}"
            for topic, (count, reason) in self.ignored.items()
        )
