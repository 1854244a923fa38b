"""Where results are kept between runs: a folder that nobody else can change."""

import grp
import os
import pwd
import stat
import tempfile
from pathlib import Path


def cache_folder() -> Path | None:
    """The folder of results, made if need be; None if there is no safe place for one.

    Below ``$XDG_CACHE_HOME``, else ``~/.cache``; below the system's folder for temporary files
    where somebody else could write there.
    """
    home = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    for base in (Path(home), Path(tempfile.gettempdir(), f"cache-{os.getuid()}")):
        try:
            folder = base.joinpath("ab_sim", "results").resolve()
            for part in (*reversed(folder.parents), folder):
                if not part.exists():
                    part.mkdir(mode=0o700, exist_ok=True)
            if _is_ours_alone(folder):
                return folder
        except (OSError, RuntimeError):  # RuntimeError: links in a circle
            continue
    return None


def _is_ours_alone(folder: Path) -> bool:
    """Whether nobody else can put anything there, or another folder in its place.

    What is found there is believed. Links have been resolved before: that none has come in their
    place is seen in each part being a folder.
    """
    me = os.getuid()
    own, *above = [part.lstat() for part in (folder, *folder.parents)]
    return (
        own.st_uid == me
        and not _others_write(own)
        and os.access(folder, os.W_OK)
        and all(stat.S_ISDIR(part.st_mode) for part in (own, *above))
        # In a sticky folder, as /tmp is, everybody renames and removes only what is their own.
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
    """Whether it is the group that many systems give to each user, with nobody else in it."""
    try:
        me, members = pwd.getpwuid(os.getuid()), grp.getgrgid(group)
    except KeyError:
        return False
    own = group == me.pw_gid and members.gr_name == me.pw_name
    return own and set(members.gr_mem) <= {me.pw_name}
