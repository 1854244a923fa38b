"""All that a drive publishes, into a bag, as it comes."""

from __future__ import annotations

import functools
import time
from pathlib import Path
from typing import Any

from rclpy.node import Node

from ab_msgs_py import topics
from ab_sim.bags import BagWriter
from ab_sim.bags.contract import offered_qos
from ab_sim.nodes.inbox import Inbox


class BagRecorder:
    """Listens in a node's callbacks, and writes when asked to, from another thread.

    Messages stay the bytes that they came as; each is dated by when it was heard, on the clock on
    the wall. Those that a slow disk leaves no room for give way, oldest first, as in
    `Inbox`.

    Args:
        node: listens, in its namespace.
        path: of the bag's folder; if it is there, ``-2`` and so on is added to its name.
        length: messages of each topic kept while the disk is slow.

    Raises:
        RecordingError: the bag cannot be written. So do the methods.
    """

    def __init__(self, node: Node, path: Path, length: int) -> None:
        self.bag = BagWriter(_free(path))
        recorded = [topic for topic in topics.ALL if topic.type is not None]
        names = {topic.name: node.resolve_topic_name(topic.name) for topic in recorded}
        self._inbox = Inbox(names.values(), length)
        for topic in recorded:
            self.bag.topic(names[topic.name], topic.type_name, offered_qos(topic.qos))
            topic.bytes_of(node, functools.partial(self._put, names[topic.name]))

    @property
    def dropped(self) -> int:
        """Messages that gave way."""
        return sum(self._inbox.dropped.values())

    def write(self) -> None:
        """Write what has come, so that it is in the file."""
        for topic, (received, message) in self._inbox.take():
            self.bag.write(topic, received, message)
        self.bag.flush()

    def close(self) -> None:
        """Write the rest, and what makes the bag complete."""
        self.bag.close()

    def values(self) -> dict[str, Any]:
        """For the diagnostics."""
        return {
            "bag": self.bag.path,
            "bag messages written": self.bag.messages_written,
            "bag messages dropped": self.dropped,
        }

    def _put(self, topic: str, message: bytes) -> None:
        # The middleware knows it more exactly, but of EventsExecutor no callback may ask for that:
        # rclpy 9.1 then ends with a SystemError.
        self._inbox.put(topic, (time.time_ns(), message))


def _free(path: Path) -> Path:
    free, count = path, 1
    while free.exists():
        # Nothing that was recorded is ever overwritten.
        count += 1
        free = path.with_name(f"{path.name}-{count}")
    return free
