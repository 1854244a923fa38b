"""Reader of a recording in blocks, for recordings of any length."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ab_sim.base.errors import RecordingError
from ab_sim.base.sample_columns import STEP, TIME
from ab_sim.drive.trajectory import Trajectory, column_of
from ab_sim.record.recording.layout import (
    CHANNELS,
    CLOSED,
    DECIMATED,
    LEFT_OUT,
    SAMPLES,
    Array,
    layout_of,
)
from ab_sim.record.recording.rerun_file import Chunk, RerunFile

BLOCK_ROWS = 10_000
"""Default number of rows of a block, which then has some MB."""


@dataclass(frozen=True)
class Event:
    """Entry of `Recording.event`."""

    time: float
    """Time [s], rounded to 1 ns."""
    level: str
    """Severity in Rerun's notation, such as ``INFO`` or ``WARN``."""
    source: str
    text: str


class RecordedInstant(NamedTuple):
    """Instant of a sample."""

    step: float
    """Steps taken before."""
    time: float
    """Time [s]."""


@dataclass(frozen=True)
class Extent:
    """Amount of data in a recording."""

    rows: int  # number of samples
    first: RecordedInstant  # instant of the first sample; NaN if there is none
    last: RecordedInstant  # instant of the last sample
    gaps: int  # number of places at which steps are missing
    missing: int  # number of missing steps
    left_out: int  # number of steps that decimation omitted, see `Recording`


@dataclass(frozen=True)
class Notes:
    """Content of a recording other than samples: events, scalars, and the count at its end."""

    events: list[Event]  # events, by increasing time
    scalars: dict[str, Array]  # scalars by name, of shape (n, 2): time [s] and value
    closed_with: int | None  # number of samples when it was closed; None if it was not closed


class StoredRun:
    """Recording that is read from disk on each request; see `open_recording`.

    Each request reads the data written so far, also while the recording is in progress.
    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        self._file = RerunFile(self.path)
        chunks: dict[str, Chunk] = {}
        for chunk in self._chunks("/description", DECIMATED, "/channels"):
            chunks[chunk.entity_path] = chunk
            if chunk.entity_path == "/channels":
                break
        if "/description" not in chunks:
            torn = f"; {self.torn}" if self.torn else ""
            raise RecordingError(
                f"{self.path} is a Rerun file, but not a recording of ab_sim{torn}"
            )
        text = chunks["/description"].texts("TextDocument:text")[0]
        self.description: dict[str, Any] = _description_in(text, self.path)
        self.remarks = self._remarks()
        """Texts on parts of the file that are not read: an incomplete end, further recordings."""
        named = chunks["/channels"].texts("names", None) if "/channels" in chunks else ()
        self.channels: tuple[str, ...] = tuple(named)
        rule = chunks.get(DECIMATED)
        self.every = int(rule.numbers("every")[0]) if rule else 1
        """Decimation: away from events, one in ``every`` steps was kept."""
        self.around = float(rule.numbers("around")[0]) if rule else 0.0
        """Time before and after an event in which all steps were kept [s]."""

    def blocks(
        self, channels: Sequence[str] | None = None, rows: int = BLOCK_ROWS
    ) -> Iterator[Array]:
        """Yield samples by increasing step, bit for bit as recorded.

        Parameters
        ----------
        channels : sequence of str
            Channels, in this order; default: all. A decimated recording also has the channel
            `LEFT_OUT`, the number of omitted steps up to each sample.
        rows : int
            Number of samples in a block; the last block may be shorter.

        Yields
        ------
        ndarray
            Blocks of shape (rows, channels).

        Raises
        ------
        KeyError
            The recording has no such channel.
        """
        names = self.channels if channels is None else tuple(channels)
        counted = (LEFT_OUT,) if self.every > 1 else ()
        for name in names:
            column_of(name, (*self.channels, *counted))
        kept: list[Array] = []
        for part in self._rows(names):
            kept.append(part)
            while sum(map(len, kept)) >= rows:
                joined = kept[0] if len(kept) == 1 else np.concatenate(kept)
                kept = [joined[rows:]]
                yield joined[:rows]
        if sum(map(len, kept)):
            yield np.concatenate(kept)

    def trajectory(self) -> Trajectory:
        """Read all samples into memory.

        Raises
        ------
        RecordingError
            The recording cannot be read.
        """
        blocks = list(self.blocks()) if self.channels else []
        return Trajectory(
            self.channels, np.concatenate([np.empty((0, len(self.channels))), *blocks])
        )

    def _remarks(self) -> tuple[str, ...]:
        """Return texts on parts of the file that are not read."""
        remarks = (self.torn,) if self.torn else ()
        recordings = self._file.recordings
        if len(recordings) < 2:
            return remarks
        scene = self.description.get("scene") or {}
        return (
            *remarks,
            f"contains {len(recordings)} recordings, as from `rerun rrd merge`; only "
            f"{recordings[0]} is read (scene {scene.get('name', 'unknown')}); "
            "give each recording as its own file",
        )

    @property
    def torn(self) -> str | None:
        """Reason why the end of the file cannot be read; None if the file is intact."""
        return self._file.torn

    def __repr__(self) -> str:
        return f"<StoredRun: {self.path.name}, channels {len(self.channels)}>"

    @cached_property
    def extent(self) -> Extent:
        """Amount of data; the first use reads the whole file."""
        rows = gaps = missing = left_out = 0
        first = last = RecordedInstant(math.nan, math.nan)
        counted = (LEFT_OUT,) if self.every > 1 else ()
        for block in self._rows(("step", "time", *counted)) if self.channels else ():
            before = block[0, STEP] - 1 if rows == 0 else last.step
            holes = np.diff(block[:, STEP], prepend=before) - 1
            if counted:
                holes -= np.diff(block[:, -1], prepend=left_out)
                left_out = int(block[-1, -1])
            gaps += int((holes > 0).sum())
            missing += int(holes.sum())
            first = first if rows else _instant(block[0])
            last, rows = _instant(block[-1]), rows + len(block)
        return Extent(rows, first, last, gaps, missing, left_out)

    @cached_property
    def notes(self) -> Notes:
        """Events and scalars of the run; the first use reads the whole file."""
        events: list[Event] = []
        scalars: dict[str, list[Array]] = {}
        closed = None
        for chunk in self._chunks(CLOSED, "/events/", "/run/"):
            entity = chunk.entity_path
            if entity == CLOSED:
                closed = int(chunk.numbers("rows")[0])
            if chunk.is_static:
                continue
            times = chunk.numbers("sim_time").astype(np.int64) / 1e9
            if entity.startswith("/run/"):
                name, values = entity.removeprefix("/run/"), chunk.numbers("Scalars:scalars")
                scalars.setdefault(name, []).append(np.column_stack([times, values]))
            else:
                texts = (chunk.texts(name) for name in _EVENT)
                events += [Event(*row) for row in zip(times.tolist(), *texts, strict=True)]
        events.sort(key=lambda event: event.time)
        joined = {name: np.concatenate(parts) for name, parts in scalars.items()}
        return Notes(events, joined, closed)

    @property
    def complete(self) -> bool:
        """True if the recording was closed.

        Otherwise it is in progress, was killed, or the disk was full.
        """
        return self.notes.closed_with == self.extent.rows

    def _chunks(self, *prefixes: str) -> Iterator[Chunk]:
        """Return the chunks of entities with one of the prefixes, up to the file's present end."""
        size = self.path.stat().st_size if self.path.is_file() else -1
        if size < 0 or size != self._file.size:  # the recording is in progress
            self._file = RerunFile(self.path)
        return self._file.chunks(*prefixes)

    def _rows(self, names: Sequence[str]) -> Iterator[Array]:
        """Yield the rows of each chunk, shape (rows, names); a chunk has all their channels."""
        layout = {
            group: [self.channels[column] for column in columns]
            for group, columns in layout_of(self.channels).items()
        }
        if self.every > 1:
            layout[LEFT_OUT] = [LEFT_OUT]
        groups = [(f"{CHANNELS}:{group}", columns) for group, columns in layout.items()]
        for chunk in self._chunks(SAMPLES, _FORMER):
            if chunk.entity_path == _FORMER:
                raise RecordingError(
                    f"{self.path} was written by an earlier version of ab_sim, with an entity for "
                    "each group of channels; export it with that version, or record it again"
                )
            if chunk.entity_path != SAMPLES:
                continue
            steps = chunk.numbers("step")
            rows = np.empty((len(steps), len(names)))
            rows[:, [at for at, name in enumerate(names) if name == "step"]] = steps[:, None]
            for component, stored_names in groups:
                wanted = [
                    (at, stored_names.index(name))
                    for at, name in enumerate(names)
                    if name in stored_names
                ]
                if not wanted:
                    continue
                flat = chunk.numbers(component, len(stored_names))
                to, pick = zip(*wanted, strict=True)
                rows[:, to] = flat.reshape(-1, len(stored_names))[:, pick]
            yield rows


def open_recording(path: Path | str) -> StoredRun:
    """Open a recording, finished or not, for reading in blocks.

    If its writer was killed, everything except the incomplete last batch is read.

    Parameters
    ----------
    path : Path or str
        Recording, an .rrd file.

    Returns
    -------
    StoredRun
        ``trajectory()`` reads all samples into memory, ``blocks()`` yields them in arrays of shape
        (rows, channels); ``extent`` is their number; ``notes.events``; ``description``.

    Raises
    ------
    RecordingError
        The file is missing, not a Rerun file, or not a recording of ab_sim; methods may raise it,
        too.

    Examples
    --------
    >>> import ab_sim, tempfile, pathlib
    >>> run = ab_sim.simulate(ab_sim.load_scene("thesis-hold", ["duration=0.1"]))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     ab_sim.save_recording(run, pathlib.Path(folder, "run.rrd"))
    ...     ab_sim.open_recording(pathlib.Path(folder, "run.rrd")).extent.rows
    101
    """
    return StoredRun(path)


_FORMER = "/clock/time"
"""Entity that only earlier versions of ab_sim wrote."""
_EVENT = ("TextLog:level", "source", "TextLog:text")
"""Components of events, in the order of the fields of `Event` after the time."""


def _instant(row: Array) -> RecordedInstant:
    return RecordedInstant(float(row[STEP]), float(row[TIME]))


def _description_in(text: str, path: Path) -> dict[str, Any]:
    """Return the description from the JSON block in the text of ``description_text``."""
    try:
        description = json.loads(text.split("```json\n", 1)[1].rsplit("\n```", 1)[0])
        if not isinstance(description, dict):
            raise ValueError("not a mapping")
    except (IndexError, RecursionError, ValueError) as error:
        raise RecordingError(f"{path}: its description cannot be read: {error}") from error
    return description
