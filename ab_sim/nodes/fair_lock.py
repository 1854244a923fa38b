"""Lock that threads get in turn."""

import threading
import time
from types import TracebackType


class FairLock:
    """Lock that a waiting thread gets before its last holder can take it again.

    With a plain lock, a loop that never sleeps would always take it again before other threads.
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

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.release()

    def release(self) -> None:
        """Release the lock."""
        self._held.release()
