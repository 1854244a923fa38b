"""Wait for a condition that another process or thread fulfils."""

import time
from collections.abc import Callable

PATIENCE = 280.0
"""Time [s] after which an action of another process counts as failed, even on a busy machine."""


def until(
    condition: Callable[[], object], what: str, deadline: float = 60.0, every: float = 0.02
) -> None:
    """Wait until a condition is true; fail after a deadline.

    Parameters
    ----------
    condition
        Function that returns whether to stop waiting; its errors end the wait.
    what
        Message of the failure.
    deadline
        Longest time to wait [s].
    every
        Time between two calls of the condition [s]; calls may slow the other process down.
    """
    end = time.monotonic() + deadline
    while not condition():
        assert time.monotonic() < end, what
        time.sleep(every)
