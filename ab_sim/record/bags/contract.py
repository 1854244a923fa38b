"""Topics in bags: those of the contract (`ab_msgs_py.topics`), and two kinds only for bags."""

from __future__ import annotations

from collections.abc import Iterable

from rosbags.interfaces import Qos as OfferedQos
from rosbags.interfaces import (
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)

from ab_msgs_py import Qos, Topic, topics
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
"""Topics that show that there is a drive in their namespace."""


def further_sensor(name: str, namespace: str) -> Topic | None:
    """Return the kind of topic if it is that of a sensor after the first one, else None."""
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
NOTE = "recording."
"""Prefix of the logger's name in log messages that contain an entry of `Recording.event`."""


def logger_name(namespace: str, name: str) -> str:
    """Return the full name of a node's logger, as in log messages: ``namespace.name``."""
    return f"{namespace.strip('/').replace('/', '.')}.{name}".lstrip(".")


def drive_namespaces(there: Iterable[tuple[str, str]]) -> list[str]:
    """Return the namespaces of drives, from names and types of topics."""
    return sorted(
        {
            name.removesuffix(f"/{topic.name}") or "/"
            for name, type_name in there
            for topic in OF_A_DRIVE
            if name.endswith(f"/{topic.name}") and type_name == topic.type_name
        }
    )
