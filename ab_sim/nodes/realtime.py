"""Real-time loop: options of the operating system, a fair lock, and a guard of long steps."""

import ctypes
import gc
import os
import sys
import threading
import time
from collections.abc import Callable

from rclpy.node import Node

from ab_sim.base import interruption
from ab_sim.nodes.process import leave_graph

_MCL_CURRENT, _MCL_FUTURE = 1, 2
"""Flags of mlockall: lock present pages, and pages that are mapped later."""


def request_priority(priority: int) -> str:
    """Request real-time scheduling (SCHED_FIFO) of the calling thread.

    Parameters
    ----------
    priority
        From 1 to 99.

    Returns
    -------
    str
        Empty text; or the reason and the remedy if the system refuses.
    """
    if not sys.platform.startswith("linux"):
        return f"real-time priority {priority}: only available on Linux; normal scheduling is used"
    try:
        # 0 means the calling thread. The thread that answers requests is not affected. With
        # RESET_ON_FORK, a thread started from this one, e.g. to compile, has normal priority.
        os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(priority))
    except OSError as error:
        return (
            f"real-time priority {priority}: the system refuses ({error.strerror}); allow it with "
            f"`@realtime - rtprio {priority}` in /etc/security/limits.conf and log in again, or "
            "with the capability CAP_SYS_NICE; normal scheduling is used"
        )
    return ""


def lock_memory() -> str:
    """Lock all memory of the process (mlockall); return an empty text, or reason and remedy."""
    try:
        libc = ctypes.CDLL(None, use_errno=True)
        if libc.mlockall(_MCL_CURRENT | _MCL_FUTURE) == 0:
            return ""
        reason = os.strerror(ctypes.get_errno())
    except (OSError, AttributeError) as error:
        reason = str(error)
    return (
        f"locked memory: the system refuses ({reason}); allow it with `@realtime - memlock "
        "unlimited` in /etc/security/limits.conf and log in again, or with the capability "
        "CAP_IPC_LOCK; memory is not locked"
    )


_frozen = False
"""True once this process has excluded its objects from garbage collection."""


def freeze_garbage_collector() -> None:
    """Exclude all existing objects from garbage collection (gc.freeze).

    A compiler and a ROS node have hundreds of thousands of objects. A full collection visits each,
    and may happen at any wake-up. Before, unused objects are collected, also those of an earlier
    call, but not those that the process inherited frozen from the process that forked it.
    """
    global _frozen
    if _frozen:
        gc.unfreeze()
    gc.collect()
    gc.freeze()
    _frozen = True


class RealTimeRequests:
    """Real-time options that a loop requests from the system.

    Parameters
    ----------
    priority
        Priority of the loop's thread, see ``request_priority``; 0: default scheduling.
    memory
        Whether to lock all memory.
    by_hand
        Whether to collect garbage only by ``collect_garbage``, between wake-ups. Existing objects
        are excluded from collection in any case.
    """

    def __init__(self, priority: int, memory: bool, by_hand: bool) -> None:
        self._priority, self._memory, self._by_hand = priority, memory, by_hand
        self.words = "as usual"
        """Granted options and refusals, for the diagnostics."""

    def apply(self) -> list[str]:
        """Request the options for the calling thread, the loop's, and return refusals as texts."""
        granted, refused = [], []
        requests = []
        if self._priority:
            requests.append((f"SCHED_FIFO {self._priority}", request_priority(self._priority)))
        if self._memory:
            requests.append(("memory locked", lock_memory()))
        for what, refusal in requests:
            granted += [] if refusal else [what]
            refused += [refusal] if refusal else []
        freeze_garbage_collector()
        if self._by_hand:
            gc.disable()
            granted.append("garbage by hand")
        if granted or refused:
            self.words = "; ".join([*granted, *refused])
        return refused

    def collect_garbage(self) -> None:
        """Collect garbage if that is requested ``by_hand``; call it when the loop is idle."""
        if self._by_hand:
            gc.collect()


class FairLock:
    """Lock that a waiting thread gets before its last holder can take it again.

    With a plain lock, a loop that never sleeps would always take it again before other threads.
    Here, a thread must first get a second lock, which a waiting thread holds: the last holder
    queues behind it.
    """

    def __init__(self) -> None:
        self._next, self._held = threading.Lock(), threading.Lock()

    def __enter__(self) -> None:
        with self._next:
            self._held.acquire()

    def acquire(self, patience: float) -> bool:
        """Wait for the lock for at most ``patience`` [s]; return whether this thread got it."""
        end = time.monotonic() + patience
        if not self._next.acquire(timeout=patience):
            return False
        try:
            return self._held.acquire(timeout=max(end - time.monotonic(), 0.0))
        finally:
            self._next.release()

    def __exit__(self, *_: object) -> None:
        self.release()

    def release(self) -> None:
        """Release the lock."""
        self._held.release()


GLANCE = 0.1
"""Time between two checks of the loop [s]."""
_STALLED = 0.5
"""Duration of an iteration of the loop above which the loop counts as stalled [s]."""
_GRACE = 2.0
"""Longest time for a stalled loop to end after a signal [s]."""
LEAVING = 2.0
"""Longest time for the node of a stalled loop to leave the graph [s]."""


class StallGuard:
    """Answers urgent requests while the main loop is stalled, and then ends the process on request.

    The guard is a thread. It runs while the loop is in machine code, which releases Python's lock.

    Parameters
    ----------
    node
        Node to remove from the graph at the end of the process.
    stopping
        Event that is set when the loop is to end.
    answer
        Function that serves urgent requests; called while the loop is stalled.
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

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()

    def _watch(self) -> None:
        """Check the loop until the guard is left.

        A stalled loop gets ``_GRACE`` seconds to end after a stop was requested, counted from the
        later of the request and the beginning of its iteration.
        """
        requested: float | None = None
        while not self._over.wait(GLANCE):
            now, begun = time.monotonic(), self._begun
            if self._stopping.is_set() and requested is None:
                requested = now
            if begun is None or now - begun < _STALLED:
                continue
            if requested is not None and now - max(requested, begun) >= _GRACE:
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
