"""The topics of `ab_msgs_py` as a bag has them: names of types, and quality of service.

`ab_msgs_py` needs ROS, and files do not; a test holds the two to each other.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)

_FOREVER = QosTime(9223372036, 854775807)  # what ROS 2 means by no limit


class TopicKind(NamedTuple):
    """A topic of the contract; names that begin with a slash are outside of namespaces."""

    name: str
    type: str
    latched: bool = False
    depth: int = 10

    @property
    def qos(self) -> Qos:
        """What its publisher offers."""
        durability = QosDurability.TRANSIENT_LOCAL if self.latched else QosDurability.VOLATILE
        return Qos(
            QosHistory.KEEP_LAST,
            self.depth,
            QosReliability.RELIABLE,
            durability,
            _FOREVER,
            _FOREVER,
            QosLiveliness.AUTOMATIC,
            _FOREVER,
            False,
        )

    def within(self, namespace: str) -> str:
        """Its full name for a drive in a namespace."""
        return self.name if self.name.startswith("/") else f"{namespace.rstrip('/')}/{self.name}"


COMMAND = TopicKind("spindle/command", "std_msgs/msg/Float64", depth=5000)
JOINT_STATES = TopicKind("joint_states", "sensor_msgs/msg/JointState")
VIBRATION = TopicKind("vibration", "geometry_msgs/msg/AccelStamped")
WHIRL = TopicKind("whirl", "geometry_msgs/msg/PointStamped")
DECK_POSE = TopicKind("deck_pose", "geometry_msgs/msg/PoseStamped")
TF = TopicKind("/tf", "tf2_msgs/msg/TFMessage", depth=100)
TF_STATIC = TopicKind("/tf_static", "tf2_msgs/msg/TFMessage", True, 1)
BLOCK = TopicKind("vibration/block", "std_msgs/msg/Float64MultiArray", depth=1000)
IMU = TopicKind("imu/data_raw", "sensor_msgs/msg/Imu", depth=1000)
MODEL = TopicKind("robot_description", "std_msgs/msg/String", True, 1)
DESCRIPTION = TopicKind("drive_description", "std_msgs/msg/String", True, 1)
FAULTS = TopicKind("faults", "std_msgs/msg/String", True, 1)
PROFILE_STATUS = TopicKind("profile_controller/status", "std_msgs/msg/String", True, 1)
CLOCK = TopicKind("/clock", "rosgraph_msgs/msg/Clock")
DIAGNOSTICS = TopicKind("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray")
EVENTS = TopicKind("/rosout", "rcl_interfaces/msg/Log", True, 1000)

KINDS = {
    kind.name: kind
    for kind in (
        COMMAND,
        JOINT_STATES,
        VIBRATION,
        WHIRL,
        DECK_POSE,
        TF,
        TF_STATIC,
        BLOCK,
        IMU,
        MODEL,
        DESCRIPTION,
        FAULTS,
        PROFILE_STATUS,
        CLOCK,
        DIAGNOSTICS,
        EVENTS,
    )
}
OF_A_DRIVE = (DESCRIPTION, BLOCK, JOINT_STATES, VIBRATION, WHIRL)
"""By these a drive is known to be in a bag."""

TASKS = ("real time", "profile", "recording")
"""What the names of our nodes' diagnostics end with."""

NUMBER = TopicKind("recording/", "std_msgs/msg/Float64")
"""Beside the contract: what `Recording.scalar` was given, each on a topic with its name."""
THINNED = TopicKind("recording/thinned", "std_msgs/msg/Float64MultiArray")
"""Beside the contract: of a block of a run of which not every step was kept, just before it, how
many were left out by intent up to each row, and by which rule. Laid out like a block."""
THINNED_CHANNELS = ("step", "time", "left_out", "every", "around")
NOTE = "recording."
"""What `Recording.event` was given is a log entry of a node, or rather logger, that begins so."""


def logger(namespace: str, name: str) -> str:
    """The name of a node's logger, as log entries have it."""
    return f"{namespace.strip('/').replace('/', '.')}.{name}".lstrip(".")


def namespaces(topics: Iterable[tuple[str, str]]) -> list[str]:
    """Where there are drives, by the topics' names and types."""
    return sorted(
        {
            name.removesuffix(f"/{kind.name}") or "/"
            for name, type_name in topics
            for kind in OF_A_DRIVE
            if name.endswith(f"/{kind.name}") and type_name == kind.type
        }
    )
