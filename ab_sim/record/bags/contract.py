"""Topics in bags: those of the contract (`ab_msgs_py.topics`), and two that only bags have."""

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
    """Return the topic of the contract with this full name, in any namespace; None without one."""
    matching = [topic for topic in topics.ALL if name.endswith("/" + topic.name.lstrip("/"))]
    return max(matching, key=lambda topic: len(topic.name)) if matching else None


OF_A_DRIVE = (DESCRIPTION, BLOCK, JOINT_STATES, VIBRATION, WHIRL, IMU, PROBE)
"""A namespace with one of these topics has a drive."""


def further_sensor(name: str, namespace: str) -> Topic | None:
    """Return the kind of the topic of a sensor after the first one; None of any other topic."""
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
"""Topics of bags only: numbers of `Recording.scalar`, each on a topic with its name."""
DECIMATED = BLOCK._replace(name="recording/decimated", qos=Qos())
"""Topic of bags only: for a block of a decimated run, just before it, the number of rows left out
by intent up to each row, and the rule of decimation. The layout is that of a block."""
DECIMATED_CHANNELS = ("step", "time", "left_out", "every", "around")
NOTE = "recording."
"""Prefix of the logger of log messages that hold an entry of `Recording.event`."""


def logger_name(namespace: str, name: str) -> str:
    """Return the full name of a node's logger, as in log messages."""
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
