"""What a topic's declaration says, and publishers and subscriptions of it."""

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

from ab_msgs_py.ros_messages import Fields, class_of, filled

if TYPE_CHECKING:  # files know the topics, too, and need no ROS
    from rclpy.node import Node
    from rclpy.publisher import Publisher
    from rclpy.qos import QoSProfile
    from rclpy.subscription import Subscription


class Qos(NamedTuple):
    """Quality of service of our end; the last messages are kept."""

    depth: int = 10
    latched: bool = False
    """Who comes late gets the last messages, too: durability is transient local."""
    reliable: bool = True
    """A best-effort publisher is invisible to a reliable subscriber."""

    @property
    def reliability(self) -> str:
        """In DDS' words."""
        return "reliable" if self.reliable else "best effort"

    @property
    def durability(self) -> str:
        """In DDS' words."""
        return "transient local" if self.latched else "volatile"

    @property
    def profile(self) -> "QoSProfile":
        """For rclpy, which writes overrides into it: each time another one."""
        from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

        return QoSProfile(
            depth=self.depth,
            reliability=ReliabilityPolicy[self.reliability.replace(" ", "_").upper()],
            durability=DurabilityPolicy[self.durability.replace(" ", "_").upper()],
        )


class Conversion(NamedTuple):
    """Between a sample and a message's fields."""

    fields: Callable[[Any], Fields]
    """A sample's fields."""
    sample: Callable[[Any], Any]
    """The sample in a message, whoever has decoded it; raises MalformedMessage."""


class Topic(NamedTuple):
    """A topic of the contract. All that is said of it is said here."""

    name: str
    """Relative to the node's namespace, unless it begins with a slash."""
    type_name: str
    """Of its messages, as ROS writes it: ``std_msgs/msg/Float64``."""
    conversion: Conversion
    meaning: str
    """What it carries; a line of the contract's page."""
    unit: str = ""
    source: str = "`drive_sim`"
    """Who publishes it."""
    rate: str = "`wake_rate`"
    """How often."""
    qos: Qos = Qos()

    @property
    def type(self) -> Any:
        """Class of its messages; None where that is not installed: nobody can publish it there."""
        try:
            return class_of(self.type_name)
        except ImportError:
            return None

    def message(self, sample: Any) -> Any:
        """A sample as ROS's message."""
        return filled(class_of(self.type_name)(), self.conversion.fields(sample))

    def sample(self, message: Any) -> Any:
        """The sample in a message.

        Raises:
            MalformedMessage: it is not as the contract says.
        """
        return self.conversion.sample(message)

    def within(self, namespace: str) -> str:
        """Its full name for a drive in a namespace."""
        return self.name if self.name.startswith("/") else f"{namespace.rstrip('/')}/{self.name}"

    def publisher(self, node: "Node") -> "Publisher[Any]":
        """A publisher whose QoS may be overridden by parameters."""
        from rclpy.qos_overriding_options import QoSOverridingOptions

        options = QoSOverridingOptions.with_default_policies()
        return node.create_publisher(
            self.type, self.name, self.qos.profile, qos_overriding_options=options
        )

    def subscription(self, node: "Node", callback: Any) -> "Subscription[Any]":
        """A subscription whose QoS may be overridden by parameters."""
        from rclpy.qos_overriding_options import QoSOverridingOptions

        options = QoSOverridingOptions.with_default_policies()
        return node.create_subscription(
            self.type, self.name, callback, self.qos.profile, qos_overriding_options=options
        )

    def bytes_of(self, node: "Node", callback: Any) -> "Subscription[Any]":
        """A subscription that hands on each message as it came, in CDR."""
        return node.create_subscription(self.type, self.name, callback, self.qos.profile, raw=True)

    def publishers(self, node: "Node") -> int:
        """How many publish it, under the name that the topic has for a node."""
        return node.count_publishers(node.resolve_topic_name(self.name))


def arrived(subscription: "Subscription[Any]", most: int) -> Iterator[tuple[Any, int]]:
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
