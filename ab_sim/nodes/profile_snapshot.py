"""A profile under way in a file, for a controller to go on from when its drive has been restored.

The drive's own snapshot knows nothing of who commands it, and a board cannot be put back at all: so
the controller has a file of its own, of the same instant.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from ab_sim.drive.snapshot_json import check_origin, origin, read_content, write_content
from ab_sim.errors import NOT_AS_WRITTEN, InputError
from ab_sim.quoting import short
from ab_sim.stored_numbers import whole

FORMAT = "ab_sim profile snapshot"
OTHERWISE = (
    "no snapshot of a profile controller; that of a drive is another one, which its own "
    "~/restore_snapshot reads"
)
WHO = "ab_sim.nodes.timed_run"
"""The module that goes on from one."""


class ProfileSnapshot(NamedTuple):
    """A controller at one instant."""

    time: int
    """Simulated time [ns]."""
    began: int
    """When the profile began [ns]."""
    source: str
    """What the parameter ``profile`` named when the profile was started; empty before the first."""
    changes: list[str]
    made_of: Mapping[str, Any] | None
    """What the profile follows from: see ``PlannedCourse.made_of``; None before the first."""
    run: Mapping[str, Any]
    """What becomes of it: see ``ProfileRun.state_values``."""
    trajectory: int | None = None
    """Start of the trajectory by which the drive is led [ns]; None: it is led by speeds."""


def write_profile_snapshot(path: Path, snapshot: ProfileSnapshot) -> None:
    """Write one; a file that is there is replaced at once, or stays whole.

    Args:
        path: ends in .json.
        snapshot: what to write.

    Raises:
        InputError: the file cannot be written.
    """
    write_content(path, {"format": FORMAT, **origin(WHO), **snapshot._asdict()})


def read_profile_snapshot(path: Path) -> ProfileSnapshot:
    """Read one.

    Raises:
        InputError: there is none, it is damaged, or it is of another ab_sim.
    """
    content = read_content(path, FORMAT, OTHERWISE)
    check_origin(path, content, WHO)
    try:
        return ProfileSnapshot(
            whole(content["time"], 0),
            whole(content["began"], 0),
            str(content["source"]),
            [str(change) for change in content["changes"]],
            None if content["made_of"] is None else dict(content["made_of"]),
            dict(content["run"]),
            None if content["trajectory"] is None else whole(content["trajectory"], 0),
        )
    except NOT_AS_WRITTEN as error:
        raise InputError(f"snapshot {path}: is damaged: {short(error)}") from error
