"""Guard of a main loop whose steps may take long, or never end."""

import sys
import threading
import time
from collections.abc import Callable
from types import TracebackType

from rclpy.node import Node

from ab_sim.base import interruption
from ab_sim.nodes.leaving import leave_graph

GLANCE = 0.1
"""Time between two checks of the loop [s]."""
STALLED = 0.5
"""Duration of an iteration of the loop above which the loop counts as stalled [s]."""
GRACE = 2.0
"""Longest time for a stalled loop to end after a signal [s]."""
LEAVING = 2.0
"""Longest time for the node of a stalled loop to leave the graph [s]."""


class StallGuard:
    """Answers urgent requests while the main loop is stalled, and then ends the process on request.

    The guard is a thread. It runs while the loop is in machine code, which releases Python's lock.

    Args:
        node: node to remove from the graph at the end of the process.
        stopping: event that is set when the loop is to end.
        answer: function that serves urgent requests; called while the loop is stalled.
    """

    def __init__(self, node: Node, stopping: threading.Event, answer: Callable[[], None]) -> None:
        self._node, self._stopping, self._answer = node, stopping, answer
        self._begun: float | None = None
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="stall guard", daemon=True)

    def begin(self) -> None:
        """Record that an iteration of the loop begins."""
        self._begun = time.monotonic()

    def end(self) -> None:
        """Record that the iteration has ended, and the loop waits."""
        self._begun = None

    def __enter__(self) -> "StallGuard":
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._over.set()
        self._thread.join()

    def _watch(self) -> None:
        asked: float | None = None
        while not self._over.wait(GLANCE):
            now, begun = time.monotonic(), self._begun
            if self._stopping.is_set() and asked is None:
                asked = now
            if begun is None or now - begun < STALLED:
                continue
            if asked is not None and now - max(asked, begun) >= GRACE:
                self._leave(now - begun)
            self._answer()

    def _leave(self, stalled: float) -> None:
        """End the process without the main loop."""
        name = self._node.get_fully_qualified_name()
        print(
            f"{name}: a step has taken {stalled:.1f} s and is abandoned; the last samples are lost",
            file=sys.stderr,
        )
        leave_graph(self._node, LEAVING)
        interruption.exit_process(1)
