"""Reading of a whole recording."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ab_sim.drive.trajectory import column_of
from ab_sim.record.recording.layout import Array
from ab_sim.record.recording.stored import Event, open_recording


@dataclass(frozen=True, eq=False)
class RecordedRun:
    """A recorded run. ``run["x"]`` is the column of a channel."""

    description: dict[str, Any]
    channels: tuple[str, ...]
    samples: Array  # (rows, channels), bit for bit, in the order of step
    gaps: int  # places where steps are missing
    missing: int  # steps that are not there because of them
    left_out: int  # steps that are not there by intent, see `Recording`
    events: list[Event]  # in the order of time
    scalars: dict[str, Array]  # name: (n, 2), time [s] and value
    complete: bool  # False: the recording was never closed (still running, killed, disk full)

    def __getitem__(self, channel: str) -> Array:
        return self.samples[:, column_of(channel, self.channels)]


def read_recording(path: Path | str) -> RecordedRun:
    """Read a recording by `Recording`, finished or not, into memory.

    Raises
    ------
    RecordingError
        See `open_recording`, which is for longer runs.
    """
    stored = open_recording(path)
    blocks = list(stored.blocks()) if stored.channels else []
    samples = np.concatenate([np.empty((0, len(stored.channels))), *blocks])
    extent, notes = stored.extent, stored.notes
    return RecordedRun(
        description=stored.description,
        channels=stored.channels,
        samples=samples,
        gaps=extent.gaps,
        missing=extent.missing,
        left_out=extent.left_out,
        events=notes.events,
        scalars=notes.scalars,
        complete=notes.closed_with == len(samples),
    )
