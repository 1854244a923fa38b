"""Check of a path before it is opened for reading."""

import errno
import stat
from pathlib import Path

SPECIAL = "it is a pipe or a device; write its content to a file first"


def check_regular(path: Path) -> None:
    """Refuse a pipe or a device, which may block a reader or never end.

    Raises:
        OSError: the path is a pipe or a device, or does not exist; ``strerror`` has the reason.
    """
    try:
        mode = path.stat().st_mode
    except FileNotFoundError as error:
        raise FileNotFoundError(errno.ENOENT, "no such file", str(path)) from error
    if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
        raise OSError(errno.EINVAL, SPECIAL, str(path))
