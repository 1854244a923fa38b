"""Snapshot of a profile controller in a file.

The snapshot of a drive does not include its controller, which may be a real board. So the profile
controller saves its state for the same instant to its own file, and continues from it after the
drive was restored.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from ab_sim.base.errors import InputError
from ab_sim.base.numbers import entry, whole
from ab_sim.drive.snapshot_json import check_origin, origin, read_content, write_content

FORMAT = "ab_sim profile snapshot"
OTHERWISE = (
    "not a snapshot of a profile controller; the drive's ~/restore_snapshot reads snapshots of "
    "drives"
)
WHO = "ab_sim.nodes.timed_run"
"""Module whose version a snapshot must match."""


class ProfileSnapshot(NamedTuple):
    """State of a controller at one instant."""

    time: int
    """Simulated time [ns]."""
    began: int
    """Start of the profile [ns]."""
    source: str
    """Value of the parameter ``profile`` when the profile started; empty before the first one."""
    changes: list[str]
    """Changes to the profile, each ``key=value``."""
    made_of: Mapping[str, Any] | None
    """Definition of the profile, see ``CheckedProfile.made_of``; None before the first one."""
    run: Mapping[str, Any]
    """State of the run: see ``ProfileRun.state_values``."""
    trajectory: int | None = None
    """Start of the trajectory that the drive follows [ns]; None if it follows speed commands."""


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
        InputError: the file is missing or damaged, or from another version of ab_sim.
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
