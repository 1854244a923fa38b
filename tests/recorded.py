"""Whole recording in memory, for tests."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ab_sim.drive.trajectory import column_of
from ab_sim.record.recording import Event, open_recording
from ab_sim.record.recording.layout import Array


@dataclass(frozen=True, eq=False)
class RecordedRun:
    """Recorded run in memory. ``run["x"]`` is the column of a channel."""

    description: dict[str, Any]
    channels: tuple[str, ...]
    samples: Array  # samples of shape (rows, channels), bit for bit, by increasing step
    gaps: int  # number of places at which steps are missing
    missing: int  # number of missing steps
    left_out: int  # number of steps that decimation omitted, see `Recording`
    events: list[Event]  # events, by increasing time
    scalars: dict[str, Array]  # scalars by name, of shape (n, 2): time [s] and value
    complete: bool  # False if the recording was not closed (in progress, killed, or disk full)

    def __getitem__(self, channel: str) -> Array:
        return self.samples[:, column_of(channel, self.channels)]


def read_recording(path: Path | str) -> RecordedRun:
    """Read a recording, finished or not, into memory."""
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
