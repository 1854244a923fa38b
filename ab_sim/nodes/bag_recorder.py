"""Recorder of all messages of a drive into a bag."""

from __future__ import annotations

import functools
import time
from pathlib import Path
from typing import Any

from rclpy.node import Node

from ab_msgs_py import topics
from ab_sim.nodes.inbox import Inbox
from ab_sim.record.bags import BagWriter
from ab_sim.record.bags.contract import offered_qos


class BagRecorder:
    """Records messages: receives them in a node's callbacks, and writes them from another thread.

    Messages are stored as received bytes, each with its reception time on the system clock. If the
    disk is slow, the oldest messages are dropped, as in `Inbox`.

    Args:
        node: subscriber; the topics are those of its namespace.
        path: folder of the bag; if it exists, ``-2`` and so on is added to its name.
        length: number of messages of each topic that are kept while the disk is slow.

    Raises:
        RecordingError: the bag cannot be written; the methods raise it, too.
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
        """Number of dropped messages."""
        return sum(self._inbox.dropped.values())

    def write(self) -> None:
        """Write all received messages to the file."""
        for topic, (received, message) in self._inbox.take():
            self.bag.write(topic, received, message)
        self.bag.flush()

    def close(self) -> None:
        """Complete the bag, after the last ``write``."""
        self.bag.close()

    def values(self) -> dict[str, Any]:
        """Return values for the diagnostics."""
        return {
            "bag": self.bag.path,
            "bag messages written": self.bag.messages_written,
            "bag messages dropped": self.dropped,
        }

    def _put(self, topic: str, message: bytes) -> None:
        # The middleware knows the time more exactly, but under EventsExecutor a callback with
        # message info makes rclpy 9.1 end with a SystemError.
        self._inbox.put(topic, (time.time_ns(), message))


def _free(path: Path) -> Path:
    free, count = path, 1
    while free.exists():
        # A recording is never overwritten.
        count += 1
        free = path.with_name(f"{path.name}-{count}")
    return free
