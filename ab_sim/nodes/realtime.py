"""Real-time options of the operating system: priority, locked memory, garbage collection."""

import ctypes
import gc
import os
import sys

MCL_CURRENT, MCL_FUTURE = 1, 2


def request_priority(priority: int) -> str:
    """Request real-time scheduling (SCHED_FIFO) of the calling thread.

    Args:
        priority: from 1 to 99.

    Returns:
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
        if libc.mlockall(MCL_CURRENT | MCL_FUTURE) == 0:
            return ""
        reason = os.strerror(ctypes.get_errno())
    except (OSError, AttributeError) as error:
        reason = str(error)
    return (
        f"locked memory: the system refuses ({reason}); allow it with `@realtime - memlock "
        "unlimited` in /etc/security/limits.conf and log in again, or with the capability "
        "CAP_IPC_LOCK; memory is not locked"
    )


def freeze_garbage_collector() -> None:
    """Exclude all existing objects from garbage collection (gc.freeze).

    A compiler and a ROS node have hundreds of thousands of objects. A full collection visits each,
    and may happen at any wake-up. Before, unused objects are collected, also those of an earlier
    call.
    """
    gc.unfreeze()
    gc.collect()
    gc.freeze()


class RealTimeRequests:
    """Real-time options that a loop requests from the system.

    Args:
        priority: priority of the loop's thread, see ``request_priority``; 0: default scheduling.
        memory: whether to lock all memory.
        by_hand: whether to collect garbage only by ``collect_garbage``, between wake-ups. Existing
            objects are excluded from collection in any case.
    """

    def __init__(self, priority: int, memory: bool, by_hand: bool) -> None:
        self._priority, self._memory, self._by_hand = priority, memory, by_hand
        self.words = "as usual"
        """Granted options and refusals, for the diagnostics."""

    def apply(self) -> list[str]:
        """Request the options for the calling thread, the loop's, and return refusals as texts."""
        granted, refused = [], []
        asked = []
        if self._priority:
            asked.append((f"SCHED_FIFO {self._priority}", request_priority(self._priority)))
        if self._memory:
            asked.append(("memory locked", lock_memory()))
        for what, refusal in asked:
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
