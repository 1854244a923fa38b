"""DDS domains for tests: of tests that run at once, by whomever, no two have the same."""

import fcntl
import itertools
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

LAST = 100
"""Up to here all their ports keep clear of those that Linux hands out by itself."""
_numbers = itertools.count(os.getpid())


@contextmanager
def own_domain() -> Iterator[int]:
    """A domain that is nobody else's meanwhile; the next one is another, as some may linger."""
    for _ in range(LAST):
        number = 1 + next(_numbers) % LAST
        if (lock := _taken(number)) is not None:
            with lock:
                yield number
            return
    raise RuntimeError(f"all DDS domains from 1 to {LAST} are taken")


def _taken(number: int) -> TextIO | None:
    """What holds a domain until it is closed; None if another has it."""
    try:
        lock = (Path(tempfile.gettempdir()) / f"ab_sim-domain-{number}").open("w")
    except PermissionError:  # another user's
        return None
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        lock.close()
        return None
    return lock
