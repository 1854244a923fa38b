"""Declaration of a topic, and its publishers and subscriptions."""

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

from ab_msgs_py.ros_messages import Fields, class_of, filled

if TYPE_CHECKING:  # bag files use the topics without ROS
    from rclpy.node import Node
    from rclpy.publisher import Publisher
    from rclpy.qos import QoSProfile
    from rclpy.subscription import Subscription


class Qos(NamedTuple):
    """Quality of service of a publisher or subscription, which keeps the last messages."""

    depth: int = 10
    latched: bool = False
    """True if late subscribers also get the last messages (durability transient local)."""
    reliable: bool = True
    """True for reliable, False for best effort; a best-effort publisher does not match a reliable
    subscription."""

    @property
    def reliability(self) -> str:
        """Return the reliability in DDS terms."""
        return "reliable" if self.reliable else "best effort"

    @property
    def durability(self) -> str:
        """Return the durability in DDS terms."""
        return "transient local" if self.latched else "volatile"

    @property
    def profile(self) -> "QoSProfile":
        """Return a new rclpy profile; rclpy writes overrides into it."""
        from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

        return QoSProfile(
            depth=self.depth,
            reliability=ReliabilityPolicy[self.reliability.replace(" ", "_").upper()],
            durability=DurabilityPolicy[self.durability.replace(" ", "_").upper()],
        )


class Conversion(NamedTuple):
    """Conversion between samples and message fields."""

    fields: Callable[[Any], Fields]
    """Function from a sample to message fields."""
    sample: Callable[[Any], Any]
    """Function from a message of rclpy or rosbags to a sample; raises MalformedMessage."""


class Topic(NamedTuple):
    """Topic of the contract, with everything that the contract specifies."""

    name: str
    """Name, relative to the node's namespace unless the name begins with a slash."""
    type_name: str
    """Type of the messages in ROS notation: ``std_msgs/msg/Float64``."""
    conversion: Conversion
    meaning: str
    """Content of the topic, for the table in the documentation."""
    unit: str = ""
    source: str = "`drive_sim`"
    """Publisher of the topic."""
    rate: str = "`publish_rate`"
    """Rate of publication."""
    qos: Qos = Qos()

    @property
    def type(self) -> Any:
        """Return the class of the messages; None if it is not installed and cannot be published."""
        try:
            return class_of(self.type_name)
        except ImportError:
            return None

    def message(self, sample: Any) -> Any:
        """Return a sample as a ROS message."""
        return filled(class_of(self.type_name)(), self.conversion.fields(sample))

    def sample(self, message: Any) -> Any:
        """Return the sample in a message.

        Raises
        ------
        MalformedMessage
            The message breaks the contract.
        """
        return self.conversion.sample(message)

    def within(self, namespace: str) -> str:
        """Return the topic's full name for a drive in a namespace."""
        return self.name if self.name.startswith("/") else f"{namespace.rstrip('/')}/{self.name}"

    def publisher(self, node: "Node") -> "Publisher[Any]":
        """Create a publisher whose QoS may be overridden by parameters."""
        from rclpy.qos_overriding_options import QoSOverridingOptions

        options = QoSOverridingOptions.with_default_policies()
        return node.create_publisher(
            self.type, self.name, self.qos.profile, qos_overriding_options=options
        )

    def subscription(self, node: "Node", callback: Any) -> "Subscription[Any]":
        """Create a subscription whose QoS may be overridden by parameters."""
        from rclpy.qos_overriding_options import QoSOverridingOptions

        options = QoSOverridingOptions.with_default_policies()
        return node.create_subscription(
            self.type, self.name, callback, self.qos.profile, qos_overriding_options=options
        )

    def bytes_of(self, node: "Node", callback: Any) -> "Subscription[Any]":
        """Create a subscription that passes on the serialised messages (CDR)."""
        return node.create_subscription(self.type, self.name, callback, self.qos.profile, raw=True)

    def publishers(self, node: "Node") -> int:
        """Return the number of publishers of this topic that a node has discovered."""
        return node.count_publishers(node.resolve_topic_name(self.name))


GID_LENGTH = 16
"""Length of a publisher's identifier in DDS; the first 12 bytes are those of its participant."""


def arrived(subscription: "Subscription[Any]", most: int) -> Iterator[tuple[Any, int, bytes]]:
    """Take the messages that have arrived at a subscription, oldest first, without an executor.

    Parameters
    ----------
    subscription
        Subscription that no executor serves.
    most
        Largest number of messages; without it, a flood would never end.

    Yields
    ------
    tuple[Any, int, bytes]
        Message; its time of reception by the system clock [ns], 0 if unknown; and the publisher's
        identifier, which is empty in ROS 2 Jazzy.
    """
    with subscription.handle:
        for _ in range(most):
            taken = subscription.handle.take_message(subscription.msg_type, subscription.raw)
            if taken is None:
                return
            gid = taken[1].get("publisher_gid")
            sender = gid["data"][:GID_LENGTH] if gid else b""
            yield taken[0], int(taken[1]["received_timestamp"]), sender
