"""A lock that is had in turn."""

import threading
import time
from types import TracebackType


class FairLock:
    """Whoever waits for it has it next, before whoever has just had it.

    A plain lock may be had again at once by a loop that never rests, and nobody else ever gets it.
    """

    def __init__(self) -> None:
        self._next, self._held = threading.Lock(), threading.Lock()

    def __enter__(self) -> None:
        with self._next:
            self._held.acquire()

    def acquire(self, patience: float) -> bool:
        """Wait for the lock for at most ``patience`` [s]; whether this thread has it then."""
        end = time.monotonic() + patience
        if not self._next.acquire(timeout=patience):
            return False
        try:
            return self._held.acquire(timeout=max(end - time.monotonic(), 0.0))
        finally:
            self._next.release()

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.release()

    def release(self) -> None:
        """Give the lock back."""
        self._held.release()
