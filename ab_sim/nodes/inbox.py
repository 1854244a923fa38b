"""Queues of received messages between two threads."""

import threading
from collections import deque
from collections.abc import Iterable
from typing import Any


class Inbox:
    """Queues of received messages, one per topic, from a receiving to a processing thread.

    If a queue is full, its oldest message is dropped and counted in ``dropped``. A flood on one
    topic does not affect the others.

    Parameters
    ----------
    topics
        Names of the topics.
    length
        Largest number of messages in each queue.
    """

    def __init__(self, topics: Iterable[str], length: int) -> None:
        self._queues: dict[str, deque[tuple[int, str, Any]]] = {
            topic: deque(maxlen=length) for topic in topics
        }
        self.dropped = dict.fromkeys(self._queues, 0)
        """Number of dropped messages, by topic."""
        self._lock = threading.Lock()
        self._received = 0

    def __len__(self) -> int:
        return sum(map(len, self._queues.values()))

    def put(self, topic: str, message: Any) -> None:
        """Add a message of a topic."""
        with self._lock:
            queue = self._queues[topic]
            self.dropped[topic] += len(queue) == queue.maxlen
            queue.append((self._received, topic, message))
            self._received += 1

    def take(self) -> list[tuple[str, Any]]:
        """Remove and return all messages, each with its topic, in the order of arrival."""
        with self._lock:
            taken = [entry for queue in self._queues.values() for entry in queue]
            for queue in self._queues.values():
                queue.clear()
        taken.sort(key=lambda entry: entry[0])
        return [(topic, message) for _, topic, message in taken]
