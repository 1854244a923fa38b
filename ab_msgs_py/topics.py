"""Topics of the contract: name, message type and quality of service, each in one place."""

import copy
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import AccelStamped, PointStamped, PoseStamped, TransformStamped
from rcl_interfaces.msg import Log
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.subscription import Subscription
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64, Float64MultiArray, String

try:
    from tf2_msgs.msg import TFMessage
except ImportError:  # PyPI has no wheel of it; a distribution's ROS 2 has it
    TFMessage = None

# Reliable throughout: a best-effort publisher is invisible to a reliable subscriber.
_STREAM = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)
# All publishers share a subscription's queue: one that floods it evicts what the others have sent.
# This is room for 50,000/s while the drive waits for a processor for a tenth of a second. Of a
# deeper queue Fast DDS fills no more, and then refuses what is new instead of dropping what is old.
_BURSTS = QoSProfile(depth=5000, reliability=ReliabilityPolicy.RELIABLE)
# As tf2's own broadcasters.
_TRANSFORMS = QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE)
# Blocks for a recorder that is away for some seconds are kept, and a wake-up's samples of a sensor.
_DEEP = QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE)
_LATCHED = QoSProfile(
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
_LOG = QoSProfile(
    depth=1000,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)


class Topic(NamedTuple):
    """A topic of the contract."""

    name: str
    type: Any
    qos: QoSProfile

    @property
    def type_name(self) -> str:
        """Of its messages, as ROS writes it: ``std_msgs/msg/Float64``."""
        package, kind = self.type.__module__.split(".")[:2]
        return f"{package}/{kind}/{self.type.__name__}"

    def publisher(self, node: Node) -> Publisher[Any]:
        """A publisher whose QoS may be overridden by parameters."""
        return node.create_publisher(
            self.type,
            self.name,
            copy.copy(self.qos),  # rclpy writes the overrides into it
            qos_overriding_options=QoSOverridingOptions.with_default_policies(),
        )

    def subscription(self, node: Node, callback: Any) -> Subscription[Any]:
        """A subscription whose QoS may be overridden by parameters."""
        return node.create_subscription(
            self.type,
            self.name,
            callback,
            copy.copy(self.qos),  # rclpy writes the overrides into it
            qos_overriding_options=QoSOverridingOptions.with_default_policies(),
        )

    def bytes_of(self, node: Node, callback: Any) -> Subscription[Any]:
        """A subscription that hands on each message as it came, in CDR."""
        return node.create_subscription(self.type, self.name, callback, self.qos, raw=True)

    def publishers(self, node: Node) -> int:
        """How many publish it, under the name that the topic has for a node."""
        return node.count_publishers(node.resolve_topic_name(self.name))


def arrived(subscription: Subscription[Any], most: int) -> Iterator[tuple[Any, int]]:
    """Take what has arrived, oldest first and at most so many, without an executor.

    Without a limit there might be no end of it: messages go on arriving.

    Yields:
        A message, and when the system's clock said that it was received [ns]; 0 where the
        middleware does not know.
    """
    with subscription.handle:
        for _ in range(most):
            taken = subscription.handle.take_message(subscription.msg_type, subscription.raw)
            if taken is None:
                return
            yield taken[0], int(taken[1]["received_timestamp"])


def transforms(each: Iterable[TransformStamped]) -> Any:
    """A message for tf; only where its type is installed."""
    return TFMessage(transforms=list(each))


def imu_of(sensor: str, first: bool) -> Topic:
    """On which a sensor's samples are: those beside the first in ``imu_NAME`` (REP-145)."""
    return IMU if first else IMU._replace(name=f"imu_{sensor}/data_raw")


COMMAND = Topic("spindle/command", Float64, _BURSTS)
"""Commanded spindle speed [rad/s]."""
JOINT_STATES = Topic("joint_states", JointState, _STREAM)
"""Spindle and balls: angle, rate, effort."""
VIBRATION = Topic("vibration", AccelStamped, _STREAM)
"""What accelerometers on the deck read, each on its axes, or in a scene without any the deck's
acceleration on inertial ones [m/s^2], and its angular one [rad/s^2]; the message's frame says
which."""
WHIRL = Topic("whirl", PointStamped, _STREAM)
"""Deck displacement, inertial axes [m]."""
DECK_POSE = Topic("deck_pose", PoseStamped, _STREAM)
"""Where the deck is and how it is turned, inertial axes [m]."""
TF = Topic("/tf", TFMessage, _TRANSFORMS)
TF_STATIC = Topic("/tf_static", TFMessage, _LATCHED)
"""The deck's frame in the housing's, and those of accelerometers in the deck's; latched. Of a type
that is None where tf2_msgs is not installed: nobody can publish or hear them there."""
BLOCK = Topic("vibration/block", Float64MultiArray, _DEEP)
"""Every integration sample since the last block."""
IMU = Topic("imu/data_raw", Imu, _DEEP)
"""Every sample of the scene's first accelerometer (REP-145); see ``imu_of``."""
MODEL = Topic("robot_description", String, _LATCHED)
"""The drive as a URDF; latched, as robot_state_publisher does it."""
DESCRIPTION = Topic("drive_description", String, _LATCHED)
"""What is being simulated, as JSON; latched."""
FAULTS = Topic("faults", String, _LATCHED)
"""Faults that are in force, as a JSON list of texts; latched."""
PROFILE_STATUS = Topic("profile_controller/status", String, _LATCHED)
"""State of the profile controller: idle, waiting, running, done, aborting or aborted, perhaps with
more behind a colon; latched."""
CLOCK = Topic("/clock", Clock, _STREAM)
"""Simulated time; the simulator is its authority."""
DIAGNOSTICS = Topic("/diagnostics", DiagnosticArray, _STREAM)
"""Health of every node, once a second."""
EVENTS = Topic("/rosout", Log, _LOG)
"""What every node logs."""

ALL = (
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
