"""Topics of the contract (`ab_msgs_py.topics`) as a bag has them, and those that only bags have."""

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
from ab_msgs_py.topics import BLOCK, COMMAND, DESCRIPTION, JOINT_STATES, VIBRATION, WHIRL

_FOREVER = QosTime(9223372036, 854775807)  # what ROS 2 means by no limit


def offered(qos: Qos) -> OfferedQos:
    """What a publisher offers."""
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


def topic_called(name: str) -> Topic | None:
    """The topic of the contract that has a full name, in whatever namespace."""
    known = [topic for topic in topics.ALL if name.endswith("/" + topic.name.lstrip("/"))]
    return max(known, key=lambda topic: len(topic.name)) if known else None


OF_A_DRIVE = (DESCRIPTION, BLOCK, JOINT_STATES, VIBRATION, WHIRL)
"""By these a drive is known to be in a bag."""

NUMBER = COMMAND._replace(name="recording/", qos=Qos())
"""Beside the contract: what `Recording.scalar` was given, each on a topic with its name."""
THINNED = BLOCK._replace(name="recording/thinned", qos=Qos())
"""Beside the contract: of a block of a run of which not every step was kept, just before it, how
many were left out by intent up to each row, and by which rule. Laid out like a block."""
THINNED_CHANNELS = ("step", "time", "left_out", "every", "around")
NOTE = "recording."
"""What `Recording.event` was given is a log entry of a node, or rather logger, that begins so."""


def logger(namespace: str, name: str) -> str:
    """The name of a node's logger, as log entries have it."""
    return f"{namespace.strip('/').replace('/', '.')}.{name}".lstrip(".")


def namespaces(there: Iterable[tuple[str, str]]) -> list[str]:
    """Where there are drives, by the names and types of the topics that there are."""
    return sorted(
        {
            name.removesuffix(f"/{topic.name}") or "/"
            for name, type_name in there
            for topic in OF_A_DRIVE
            if name.endswith(f"/{topic.name}") and type_name == topic.type_name
        }
    )
