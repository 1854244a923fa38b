"""A profile in progress in a file, from which a controller continues after its drive was restored.

The drive's own snapshot does not include the controller, and a real board cannot be restored at
all. So the controller has its own file for the same instant.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from ab_sim.base.errors import InputError
from ab_sim.base.stored_numbers import entry, whole
from ab_sim.drive.snapshot_json import check_origin, origin, read_content, write_content

FORMAT = "ab_sim profile snapshot"
OTHERWISE = (
    "no snapshot of a profile controller; that of a drive is another one, which its own "
    "~/restore_snapshot reads"
)
WHO = "ab_sim.nodes.timed_run"
"""Module that continues from a snapshot."""


class ProfileSnapshot(NamedTuple):
    """State of a controller at one instant."""

    time: int
    """Simulated time [ns]."""
    began: int
    """Start of the profile [ns]."""
    source: str
    """Parameter ``profile`` at the start of the profile; empty before the first."""
    changes: list[str]
    made_of: Mapping[str, Any] | None
    """Definition of the profile: see ``CheckedProfile.made_of``; None before the first."""
    run: Mapping[str, Any]
    """State of the run: see ``ProfileRun.state_values``."""
    trajectory: int | None = None
    """Start of the trajectory that the drive follows [ns]; None: it follows speeds."""


def write_profile_snapshot(path: Path, snapshot: ProfileSnapshot) -> None:
    """Write a snapshot; an existing file is replaced atomically.

    Args:
        path: file that ends in .json.
        snapshot: state to write.

    Raises:
        InputError: the file cannot be written.
    """
    write_content(path, {"format": FORMAT, **origin(WHO), **snapshot._asdict()})


def read_profile_snapshot(path: Path) -> ProfileSnapshot:
    """Read a snapshot.

    Raises:
        InputError: the file is missing, damaged, or from another ab_sim.
    """
    content = read_content(path, FORMAT, OTHERWISE)
    check_origin(path, content, WHO)
    try:
        return ProfileSnapshot(
            entry(content, "time", _time),
            entry(content, "began", _time),
            entry(content, "source", str),
            entry(content, "changes", lambda changes: [str(change) for change in changes]),
            entry(content, "made_of", lambda values: None if values is None else dict(values)),
            entry(content, "run", dict),
            entry(content, "trajectory", lambda start: None if start is None else _time(start)),
        )
    except ValueError as error:
        raise InputError(f"snapshot {path}: is damaged: {error}") from error


def _time(value: Any) -> int:
    return whole(value, 0)
