"""A lock that is had in turn."""

import threading
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

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._held.release()
