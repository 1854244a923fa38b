"""Users' files: checks of paths before any work is done, atomic writing, locks, cached results."""

import contextlib
import errno
import os
import shutil
import stat
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO

import platformdirs

from ab_sim.base.errors import InputError

_SPECIAL = "it is a pipe or a device; write its content to a file first"


def check_regular(path: Path) -> None:
    """Refuse a pipe or a device, which may block a reader or never end.

    Raises
    ------
    OSError
        The path is a pipe or a device, or does not exist; ``strerror`` has the reason.
    """
    try:
        mode = path.stat().st_mode
    except FileNotFoundError as error:
        raise FileNotFoundError(errno.ENOENT, "no such file", str(path)) from error
    if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
        raise OSError(errno.EINVAL, _SPECIAL, str(path))


PICTURE = (".png", ".svg", ".pdf")
RECORDING = (".rrd",)
REPORT = (".json",)
PARQUET = (".parquet",)
CSV = (".csv",)
PNG = (".png",)
PAGE = (".html",)
SCENE = (".yaml", ".yml")
FMU = (".fmu",)
_BAG_FILE = (".mcap", ".db3", ".bag")


_LONGEST_NAME = 255
"""Largest length of a file's name on common file systems [bytes]."""


def _check_name(path: Path, label: str) -> None:
    """Refuse a name that file systems, or libraries that write files, do not support.

    Raises
    ------
    InputError
        The name is not allowed; the message has the path and what is allowed.
    """
    try:
        lengths = [len(part.encode()) for part in path.parts]
    except UnicodeEncodeError:
        raise InputError(f"{label} {path}: is not UTF-8; choose another name") from None
    if max(lengths, default=0) > _LONGEST_NAME:
        raise InputError(
            f"{label} {path}: has a name of {max(lengths)} bytes; must be at most {_LONGEST_NAME}"
        )


def check_ending(path: Path, endings: Sequence[str], label: str) -> None:
    """Refuse a file name with another ending than allowed, with which a typo could replace a file.

    Parameters
    ----------
    path
        File to be written.
    endings
        Allowed endings.
    label
        Name in messages, e.g. ``--plot``.

    Raises
    ------
    InputError
        The name is not allowed; the message names the path and the allowed endings.
    """
    _check_name(path, label)
    if path.is_dir():
        raise InputError(f"{label} {path}: is a folder; name a file in it")
    if path.suffix.lower() not in endings:
        one_of = "one of " if len(endings) > 1 else ""
        raise InputError(f"{label} {path}: must end in {one_of}{', '.join(endings)}")


def check_folder(path: Path, label: str) -> None:
    """Refuse a name of a bag's folder that ends like the name of a bag's file.

    Parameters
    ----------
    path
        Path of the folder.
    label
        Name in messages, e.g. ``--mcap``.

    Raises
    ------
    InputError
        The name is not allowed; the message names the path and an allowed one.
    """
    _check_name(path, label)
    if path.suffix.lower() in _BAG_FILE:
        raise InputError(
            f"{label} {path}: a bag is a folder, with a file {path.stem}{path.suffix} in it; "
            f"name the folder, e.g. {path.with_suffix('')}"
        )


def check_writable(path: Path, label: str, replaced: bool = True) -> None:
    """Refuse a file that cannot be written.

    Parameters
    ----------
    path
        The file.
    label
        Name in messages, e.g. ``--plot``.
    replaced
        Whether an existing file is replaced; otherwise another one is created next to it.

    Raises
    ------
    InputError
        The file cannot be written; the message has path and reason.
    """
    _check_name(path, label)
    try:
        if path.exists() and not path.is_file():
            what = "a folder" if path.is_dir() else "a device or a pipe"
            raise InputError(f"{label} {path}: is {what}; name a file")
        file = path.resolve()
        if file.is_symlink():  # since Python 3.13 `resolve` does not raise the RuntimeError below
            raise OSError(errno.ELOOP, os.strerror(errno.ELOOP))
        if not file.parent.is_dir():
            raise InputError(f"{label} {path}: there is no folder {path.parent}; make it first")
        if replaced and file.exists():
            file.open("r+b").close()
        _try_folder(file.parent)
    except (OSError, RuntimeError) as error:  # RuntimeError: links in a circle
        raise InputError(
            f"{label} {path}: cannot be written: {_reason(error)}; choose another place or change "
            "its rights"
        ) from error


def check_can_be_made(folder: Path, label: str) -> None:
    """Refuse a missing folder for results that cannot be created.

    It is created with the first file.

    Parameters
    ----------
    folder
        The folder.
    label
        Name in messages, e.g. ``--out``.

    Raises
    ------
    InputError
        The folder cannot be created; the message has folder and reason.
    """
    _check_name(folder, label)
    try:
        above = next(parent for parent in (folder, *folder.absolute().parents) if parent.exists())
        if not above.is_dir():
            raise InputError(f"{label} {folder}: cannot be created: {above} is not a folder")
        _try_folder(above)
    except OSError as error:
        raise InputError(f"{label} {folder}: cannot be created: {_reason(error)}") from error


def _try_folder(folder: Path) -> None:
    """Write and remove a temporary file, as a test: access rights alone are not sufficient.

    Raises
    ------
    OSError
        The folder cannot be written: no rights or space, or the file system refuses files.
    """
    with tempfile.TemporaryFile(dir=folder) as trial:
        trial.write(b"\n")


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error)


def write_whole(file: Path, content: bytes) -> None:
    """Write a file atomically, so that readers find either the old or the new content.

    Raises
    ------
    OSError
        The file cannot be written; nothing has changed.
    """
    with replacing(file) as unfinished:
        unfinished.write_bytes(content)


@contextlib.contextmanager
def replacing(file: Path) -> Iterator[Path]:
    """Yield a temporary file in the same folder, which replaces ``file`` at the end.

    After an exception, the temporary file is removed, and nothing has changed. The folder is
    created if missing. If ``file`` is a link, its target is replaced.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    file = file.resolve()
    file.parent.mkdir(parents=True, exist_ok=True)
    descriptor, name = tempfile.mkstemp(dir=file.parent, prefix=".unfinished-")
    os.close(descriptor)
    unfinished = Path(name)
    try:
        yield unfinished
        if file.exists():
            shutil.copymode(file, unfinished)
        else:
            # ``mkstemp`` creates files that only the user can read. A new file gets the usual
            # rights instead; the mask can only be read by setting it.
            mask = os.umask(0)
            os.umask(mask)
            unfinished.chmod(0o666 & ~mask)
        unfinished.replace(file)
    except BaseException:
        unfinished.unlink(missing_ok=True)
        raise


def lock(file: IO[bytes] | int, wait: bool = False) -> bool:
    """Lock an open file for this process until it is closed, and return whether it is locked.

    The system removes the lock if the process is killed. On Windows, other processes cannot read
    the first byte meanwhile.

    Parameters
    ----------
    file
        The file, or its descriptor.
    wait
        Whether to wait while another process holds a lock on it.

    Raises
    ------
    OSError
        The file system has no locks.
    """
    from filelock import lock_descriptor  # imports slowly

    return lock_descriptor(file if isinstance(file, int) else file.fileno(), blocking=wait)


def is_being_written(path: Path) -> bool:
    """Return whether another process locks a file or, on Linux, has it open for writing.

    Files of other users, and file systems without locks and leases, count as not open for writing.
    """
    if sys.platform == "win32":
        with path.open("rb") as file, contextlib.suppress(OSError):
            return not lock(file)
        return False
    import fcntl

    with path.open("rb") as file:
        try:
            # A shared lock: two processes that look at the same time must not see each other.
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
            # Linux refuses a lease on a file that is open for writing.
            fcntl.fcntl(file, fcntl.F_SETLEASE, fcntl.F_RDLCK)
            fcntl.fcntl(file, fcntl.F_SETLEASE, fcntl.F_UNLCK)
        except BlockingIOError:
            return True
        except (OSError, AttributeError):  # AttributeError: macOS has no leases
            pass
    return False


def cache_folder() -> Path | None:
    """Return the folder of cached results, created if missing; None if there is no safe place.

    The folder is in the user's folder for caches (Linux: ``$XDG_CACHE_HOME``, else ``~/.cache``).
    If another user could write there, it is in the system's folder for temporary files.
    """
    home = platformdirs.user_cache_path("ab_sim", appauthor=False)
    for base in (home, *_among_temporary_files()):
        try:
            folder = base.joinpath("results").resolve()
            for part in (*reversed(folder.parents), folder):
                if not part.exists():
                    part.mkdir(mode=0o700, exist_ok=True)
            if _is_ours_alone(folder):
                return folder
        except (OSError, RuntimeError):  # RuntimeError: links in a circle
            continue
    return None


def _among_temporary_files() -> list[Path]:
    """Return this user's folder among the temporary files; empty on systems without user ids."""
    if sys.platform == "win32":
        return []
    return [Path(tempfile.gettempdir(), f"cache-{os.getuid()}", "ab_sim")]


def _is_ours_alone(folder: Path) -> bool:
    """Return whether only this user can write to a folder or replace it.

    This is required because the folder's content is trusted. Links were resolved before; each part
    of the path must be a folder, because otherwise a link may have replaced it since. On Windows,
    other users have no access to a user's folder for caches.
    """
    if sys.platform == "win32":
        return os.access(folder, os.W_OK)
    me = os.getuid()
    status, *above = [part.lstat() for part in (folder, *folder.parents)]
    return (
        status.st_uid == me
        and not _others_write(status)
        and os.access(folder, os.W_OK)
        and all(stat.S_ISDIR(part.st_mode) for part in (status, *above))
        # In a sticky folder, such as /tmp, users rename and remove only their own files.
        and all(
            part.st_uid in (0, me) and (part.st_mode & stat.S_ISVTX or not _others_write(part))
            for part in above
        )
    )


def _others_write(status: os.stat_result) -> bool:
    if status.st_mode & stat.S_IWGRP and not _is_private(status.st_gid):
        return True
    return bool(status.st_mode & stat.S_IWOTH)


def _is_private(group: int) -> bool:
    """Return whether a group id is that of the user's private group, without other members."""
    if sys.platform == "win32":
        return False
    import grp
    import pwd

    try:
        me, members = pwd.getpwuid(os.getuid()), grp.getgrgid(group)
    except KeyError:
        return False
    is_own_group = group == me.pw_gid and members.gr_name == me.pw_name
    return is_own_group and set(members.gr_mem) <= {me.pw_name}
