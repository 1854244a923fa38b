"""Folder of cached results, which no other user can change."""

import os
import stat
import tempfile
from pathlib import Path

import platformdirs


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
    if os.name != "posix":
        return []
    return [Path(tempfile.gettempdir(), f"cache-{os.getuid()}", "ab_sim")]


def _is_ours_alone(folder: Path) -> bool:
    """Return whether only this user can write to a folder or replace it.

    This is required because the folder's content is trusted. Links were resolved before; each part
    of the path must be a folder, because otherwise a link may have replaced it since. On Windows,
    other users have no access to a user's folder for caches.
    """
    if os.name != "posix":
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
    """Return whether this is the user's private group, which has no other members."""
    try:
        import grp
        import pwd
    except ImportError:
        return False
    try:
        me, members = pwd.getpwuid(os.getuid()), grp.getgrgid(group)
    except KeyError:
        return False
    is_own_group = group == me.pw_gid and members.gr_name == me.pw_name
    return is_own_group and set(members.gr_mem) <= {me.pw_name}
