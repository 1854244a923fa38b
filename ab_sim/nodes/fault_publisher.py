"""Publisher of the drive's faults: on their topic, in the log, in the diagnostics."""

from collections.abc import Sequence

from rclpy.node import Node

from ab_msgs_py import topics
from ab_sim.drive.faults.fault import Fault


class FaultPublisher:
    """Publisher of the drive's present faults.

    Args:
        node: publishing node.
    """

    def __init__(self, node: Node) -> None:
        self._node, self._topic = node, topics.FAULTS.publisher(node)
        self._texts: list[str] | None = None

    @property
    def words(self) -> str:
        """Present faults as one line of text."""
        return ", ".join(self._texts or []) or "none"

    def publish(self, faults: Sequence[Fault]) -> None:
        """Publish the present faults, and log a change."""
        before, self._texts = self._texts or [], [fault.text for fault in faults]
        # Also published without faults, because the topic is latched: late subscribers would
        # receive earlier faults.
        self._topic.publish(topics.FAULTS.message(self._texts))
        if self._texts != before:
            self._node.get_logger().warning(f"faults in force: {self.words}")

    def warnings(self) -> list[str]:
        """Return a warning for each fault."""
        return [f"fault: {text}" for text in self._texts or []]

    def values(self) -> dict[str, str]:
        """Return values for the diagnostics."""
        return {"faults": self.words}

    def close(self) -> None:
        """Destroy the publisher."""
        self._node.destroy_publisher(self._topic)
