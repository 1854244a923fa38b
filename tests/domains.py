"""DDS domains for tests; concurrent tests, also of other users, never share one."""

import fcntl
import itertools
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

LAST = 100
"""Largest domain whose ports are all below Linux's range of ephemeral ports."""
_numbers = itertools.count(os.getpid())


@contextmanager
def own_domain() -> Iterator[int]:
    """Yield a domain that no other test uses meanwhile.

    Successive calls yield different domains, as participants of the last one may still exist.
    """
    for _ in range(LAST):
        number = 1 + next(_numbers) % LAST
        if (lock := _taken(number)) is not None:
            with lock:
                yield number
            return
    raise RuntimeError(f"all DDS domains from 1 to {LAST} are taken")


def _taken(number: int) -> TextIO | None:
    """Lock a domain until the returned file is closed; return None if it is locked already."""
    try:
        lock = (Path(tempfile.gettempdir()) / f"ab_sim-domain-{number}").open("w")
    except PermissionError:  # it belongs to another user
        return None
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        lock.close()
        return None
    return lock
