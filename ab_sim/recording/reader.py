"""Reading a recording back."""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from rerun.chunk import RrdReader

from ab_sim.drive.trajectory import column_of
from ab_sim.errors import RecordingError
from ab_sim.recording.layout import CLOSED, LEFT_OUT, Array, layout_of
from ab_sim.recording.thinning import gaps_of


@dataclass(frozen=True)
class Event:
    """What `Recording.event` noted; ``time`` [s] is rounded to ns, ``level`` has Rerun's name."""

    time: float
    level: str
    source: str
    text: str


@dataclass(frozen=True, eq=False)
class RecordedRun:
    """A run as it was recorded. ``run["x"]`` is the column of a channel."""

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
    """Read what `Recording` wrote, finished or not.

    :raises RecordingError: no such file, not a Rerun file, torn in the middle, or not ours.
    """
    path = Path(path)
    static, moving = _batches(path)
    if "/description" not in static:
        raise RecordingError(f"{path} is a Rerun file, but not a recording of ab_sim")
    text = _column(static["/description"], "TextDocument:text")[0]
    names = tuple(_column(static["/channels"], "names")) if "/channels" in static else ()
    samples = _samples(names, moving)
    left_out = _left_out(moving, len(samples))
    gaps, missing = gaps_of(samples[:, 0] if names else np.empty(0), left_out)
    components = ("TextLog:level", "source", "TextLog:text")
    noted = _notes(moving, "/events/", *components)
    events = [Event(*row) for _, times, values in noted for row in zip(times, *values, strict=True)]
    scalars = _notes(moving, "/run/", "Scalars:scalars")
    return RecordedRun(
        description=json.loads(text.split("```json\n", 1)[1].rsplit("\n```", 1)[0]),
        channels=names,
        samples=samples,
        gaps=gaps,
        missing=missing,
        left_out=0 if left_out is None or not len(left_out) else int(left_out[-1]),
        events=sorted(events, key=lambda event: event.time),
        scalars={name: np.column_stack([times, *values]) for name, times, values in scalars},
        complete=CLOSED in static and _column(static[CLOSED], "rows")[0] == len(samples),
    )


Batches = dict[str, list[pa.RecordBatch]]  # by entity


def _batches(path: Path) -> tuple[Batches, Batches]:
    """What is static, and what has a time."""
    if not path.is_file():
        reason = "it is a folder" if path.is_dir() else "no such file"
        raise RecordingError(f"cannot read the recording {path}: {reason}")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # it warns of every file without an index
            chunks = RrdReader(path).stream().to_chunks()
    except (RuntimeError, ValueError) as error:
        raise RecordingError(f"{path} is not a Rerun recording, or is torn: {error}") from error
    static: Batches = {}
    moving: Batches = {}
    for chunk in chunks:
        batches = static if chunk.is_static else moving
        batches.setdefault(chunk.entity_path, []).append(chunk.to_record_batch())
    return static, moving


def _column(batches: list[pa.RecordBatch], name: str) -> NDArray[Any]:
    """All values of a component or timeline, flat."""
    columns = (batch[name] for batch in batches)
    parts = [c.flatten() if pa.types.is_list(c.type) else c for c in columns]
    return np.concatenate([part.to_numpy(zero_copy_only=False) for part in parts])


def _samples(names: Sequence[str], moving: Batches) -> Array:
    layout = layout_of(names)
    if any(entity not in moving for entity in layout):
        return np.empty((0, len(names)))
    # Entities are sent one after the other: a recording that was killed may lack some of the last.
    steps = {entity: _column(moving[entity], "step") for entity in layout}
    samples = np.empty((min(map(len, steps.values()), default=0), len(names)))
    for entity, columns in layout.items():
        order = np.argsort(steps[entity])[: len(samples)]
        values = _column(moving[entity], "Scalars:scalars").reshape(-1, len(columns))
        samples[:, columns] = values[order]
        samples[:, 0] = steps[entity][order]
    return samples


def _left_out(moving: Batches, rows: int) -> Array | None:
    """Steps left out by intent up to each row; None: all are kept."""
    if LEFT_OUT not in moving:
        return None
    order = np.argsort(_column(moving[LEFT_OUT], "step"))
    counts: Array = _column(moving[LEFT_OUT], "Scalars:scalars")[order][:rows]
    return counts


def _notes(moving: Batches, root: str, *names: str) -> Iterator[tuple[str, list[float], list[Any]]]:
    """Of all entities under root: name, times [s], and the components of these names."""
    for entity, batches in moving.items():
        if entity.startswith(root):
            times = _column(batches, "sim_time").astype(np.int64) / 1e9
            yield entity.removeprefix(root), times.tolist(), [_column(batches, n) for n in names]
