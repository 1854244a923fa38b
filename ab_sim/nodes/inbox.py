"""What topics have brought and nobody has taken yet."""

import threading
from collections import deque
from collections.abc import Iterable
from typing import Any


class Inbox:
    """Messages on their way from the thread that hears them to the one that takes them.

    There are at most ``length`` of each topic: of more, the topic's oldest give way and are
    counted in ``dropped``, so that a flood on one topic takes nothing from another.
    """

    def __init__(self, topics: Iterable[str], length: int) -> None:
        self._queues: dict[str, deque[tuple[int, str, Any]]] = {
            topic: deque(maxlen=length) for topic in topics
        }
        self.dropped = dict.fromkeys(self._queues, 0)
        self._lock = threading.Lock()
        self._heard = 0

    def __len__(self) -> int:
        return sum(map(len, self._queues.values()))

    def put(self, topic: str, message: Any) -> None:
        """Add a message of a topic."""
        with self._lock:
            queue = self._queues[topic]
            self.dropped[topic] += len(queue) == queue.maxlen
            queue.append((self._heard, topic, message))
            self._heard += 1

    def take(self) -> list[tuple[str, Any]]:
        """All messages, each with its topic, in the order in which they came."""
        with self._lock:
            taken = [entry for queue in self._queues.values() for entry in queue]
            for queue in self._queues.values():
                queue.clear()
        taken.sort(key=lambda entry: entry[0])
        return [(topic, message) for _, topic, message in taken]
