"""A lock that threads get in turn."""

import threading
from types import TracebackType


class FairLock:
    """Lock that a waiting thread gets before its last holder can take it again.

    With a plain lock, a loop that never rests could take it again at once and starve other threads.
    """

    def __init__(self) -> None:
        self._next, self._held = threading.Lock(), threading.Lock()

    def __enter__(self) -> None:
        with self._next:
            self._held.acquire()

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._held.release()
