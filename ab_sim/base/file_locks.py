"""Locks on open files, which end with the process that holds them.

Windows has no such locks: there nothing is locked, and no file counts as being written.
"""

from pathlib import Path
from typing import IO

try:
    import fcntl
except ImportError:
    fcntl = None  # type: ignore[assignment]


def lock(file: IO[bytes] | int, wait: bool = False) -> None:
    """Lock an open file for this process until it is closed.

    Args:
        file: the file, or its descriptor.
        wait: whether to wait while another process holds a lock on it.

    Raises:
        BlockingIOError: another process holds a lock on it, and ``wait`` is False.
    """
    if fcntl is not None:
        fcntl.flock(file, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)


def is_being_written(path: Path) -> bool:
    """Return whether another process locks a file or, on Linux, has it open for writing.

    Files of other users, and file systems without leases, count as not open for writing.
    """
    if fcntl is None:
        return False
    with path.open("rb") as file:
        return _is_held(file)


def _is_held(file: IO[bytes]) -> bool:
    try:
        fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    try:  # Linux refuses a lease on a file that is open for writing
        fcntl.fcntl(file, fcntl.F_SETLEASE, fcntl.F_RDLCK)
        fcntl.fcntl(file, fcntl.F_SETLEASE, fcntl.F_UNLCK)
    except BlockingIOError:
        return True
    except (OSError, AttributeError):  # AttributeError: macOS has no leases
        pass
    return False
