"""A profile under way in a file, for a controller to go on from when its drive has been restored.

The drive's own snapshot knows nothing of who commands it, and a board cannot be put back at all: so
the controller has a file of its own, of the same instant.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import ab_sim
from ab_sim.errors import InputError
from ab_sim.output_file import REPORT, check_ending, check_writable, write_whole
from ab_sim.quoting import short, shortened

FORMAT = "ab_sim profile snapshot"
MOST_BYTES = 1 << 22
"""Of a file; a profile of a thousand segments takes some 100 kB."""


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


def write_profile_snapshot(path: Path, snapshot: ProfileSnapshot) -> None:
    """Write one; a file that is there is replaced at once, or stays whole.

    Args:
        path: ends in .json.
        snapshot: what to write.

    Raises:
        InputError: the file cannot be written.
    """
    check_ending(path, REPORT, "snapshot")
    check_writable(path, "snapshot")
    content = {"format": FORMAT, "ab_sim": ab_sim.__version__, **snapshot._asdict()}
    try:
        write_whole(path, json.dumps(content, indent=1).encode())
    except OSError as error:
        raise InputError(f"snapshot {path}: cannot be written: {error.strerror}") from error


def read_profile_snapshot(path: Path) -> ProfileSnapshot:
    """Read one.

    Raises:
        InputError: there is none, it is damaged, or another ab_sim has written it.
    """
    try:
        with path.open("rb") as file:
            text = file.read(MOST_BYTES + 1)
        if len(text) > MOST_BYTES:
            raise InputError(f"snapshot {path}: is none: it has more than {MOST_BYTES} bytes")
        content = json.loads(text)
    except OSError as error:
        raise InputError(f"snapshot {path}: cannot be read: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"snapshot {path}: is damaged, or none: {error}") from error
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise InputError(
            f"snapshot {path}: is a JSON file, but no snapshot of a profile controller (the "
            "drive's is another file, which ~/restore_snapshot of the drive reads)"
        )
    if (version := content.get("ab_sim")) != ab_sim.__version__:
        raise InputError(
            f"snapshot {path}: is of ab_sim {shortened(str(version))}, and this is "
            f"{ab_sim.__version__}; save it again"
        )
    try:
        return ProfileSnapshot(
            int(content["time"]),
            int(content["began"]),
            str(content["source"]),
            [str(change) for change in content["changes"]],
            None if content["made_of"] is None else dict(content["made_of"]),
            dict(content["run"]),
        )
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise InputError(f"snapshot {path}: is damaged: {short(error)}") from error
