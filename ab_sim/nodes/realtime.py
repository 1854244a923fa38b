"""What the operating system can do for a loop that must not be late, if it may."""

import ctypes
import gc
import os
import sys

MCL_CURRENT, MCL_FUTURE = 1, 2


def ask_for_priority(priority: int) -> str:
    """Real-time scheduling (SCHED_FIFO) of the calling thread.

    Args:
        priority: from 1 to 99.

    Returns:
        Why it was refused, and what to do; nothing if it was not.
    """
    if not sys.platform.startswith("linux"):
        return f"real-time priority {priority}: only Linux has it; scheduled as usual"
    try:
        # 0 is the calling thread: the one that answers requests stays as it is, and one that
        # compiles, which it may start, does not inherit it.
        os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(priority))
    except OSError as error:
        return (
            f"real-time priority {priority}: the system refuses ({error.strerror}); allow it with "
            f"`@realtime - rtprio {priority}` in /etc/security/limits.conf and log in again, or "
            "with the capability CAP_SYS_NICE; scheduled as usual"
        )
    return ""


def lock_memory() -> str:
    """Keep all memory of the process from being swapped out; as ``ask_for_priority``."""
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


def spare_what_lives() -> None:
    """Leave what lives by now out of all of Python's searches for garbage.

    A compiler and a ROS node are hundreds of thousands of objects, and a full search, which may
    come at any wake-up, looks at each. What was left out before is searched a last time.
    """
    gc.unfreeze()
    gc.collect()
    gc.freeze()


class Hardening:
    """What a loop asks of the system.

    Args:
        priority: of its thread, see ``ask_for_priority``; 0: scheduled as usual.
        memory: whether it is to be locked.
        by_hand: whether to search for garbage in spare moments only. What lives already is left
            out of searches in any case.
    """

    def __init__(self, priority: int, memory: bool, by_hand: bool) -> None:
        self._priority, self._memory, self._by_hand = priority, memory, by_hand
        self.words = "as usual"
        """What there is of it, for the diagnostics."""

    def apply(self) -> list[str]:
        """Ask for it, in the loop's thread; what was refused, and why."""
        granted, refused = [], []
        asked = []
        if self._priority:
            asked.append((f"SCHED_FIFO {self._priority}", ask_for_priority(self._priority)))
        if self._memory:
            asked.append(("memory locked", lock_memory()))
        for what, refusal in asked:
            granted += [] if refusal else [what]
            refused += [refusal] if refusal else []
        spare_what_lives()
        if self._by_hand:
            gc.disable()
            granted.append("garbage by hand")
        if granted or refused:
            self.words = "; ".join([*granted, *refused])
        return refused

    def spare_moment(self) -> None:
        """The loop has a moment to spare."""
        if self._by_hand:
            gc.collect()
