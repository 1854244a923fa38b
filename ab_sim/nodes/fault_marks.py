"""Marks of the faults in force: on their topic, in the log, in the diagnostics."""

from collections.abc import Sequence

from rclpy.node import Node

from ab_msgs_py import topics
from ab_sim.drive.faults.fault import Fault


class FaultMarks:
    """Tells which faults there are.

    Args:
        node: it publishes as.
    """

    def __init__(self, node: Node) -> None:
        self._node, self._topic = node, topics.FAULTS.publisher(node)
        self._texts: list[str] | None = None

    @property
    def words(self) -> str:
        """For people."""
        return ", ".join(self._texts or []) or "none"

    def tell(self, faults: Sequence[Fault]) -> None:
        """These from now on."""
        before, self._texts = self._texts or [], [fault.text for fault in faults]
        # Latched: who comes late, and who has never heard of faults, is told of none, too.
        self._topic.publish(topics.FAULTS.message(self._texts))
        if self._texts != before:
            self._node.get_logger().warning(f"faults in force: {self.words}")

    def news(self) -> list[str]:
        """Each, as a warning."""
        return [f"fault: {text}" for text in self._texts or []]

    def values(self) -> dict[str, str]:
        """For the diagnostics."""
        return {"faults": self.words}

    def close(self) -> None:
        """Nothing is told of any more."""
        self._node.destroy_publisher(self._topic)
