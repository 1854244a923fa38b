"""Waiting for what another process or thread does."""

import time
from collections.abc import Callable

PATIENCE = 280.0
"""s; what another process has not done by then, on a busy machine too, it never will."""


def until(
    condition: Callable[[], object], what: str, deadline: float = 60.0, every: float = 0.02
) -> None:
    """Look again and again whether a condition is true.

    Args:
        condition: may end the wait by an error of its own.
        what: is said if it has not become true.
        deadline: s, by which it has to.
        every: s between two looks, which may take their time from what is waited for.
    """
    end = time.monotonic() + deadline
    while not condition():
        assert time.monotonic() < end, what
        time.sleep(every)
