"""Export of a recording as a table in other formats, block by block."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

from ab_sim.base.errors import InputError, RecordingError, exact
from ab_sim.base.files import replacing
from ab_sim.drive.trajectory import column_of, unit_of, whirl_of
from ab_sim.drive.turn_vector import PHASE, SIZE, TurnVector
from ab_sim.record.recording.layout import Array
from ab_sim.record.recording.stored import StoredRun

PARQUET, CSV = "parquet", "csv"
WHIRL = "whirl"
"""Name of a computed column: W = |u| [m], from the deck's position at rest."""
DERIVED = (WHIRL, SIZE, PHASE)
"""All computed columns: the whirl, and size and phase of its once-per-turn part."""


@dataclass(frozen=True)
class Part:
    """Selection of the samples of a recording."""

    begin: float = -np.inf
    """Time of the first sample [s]."""
    end: float = np.inf
    """Time of the last sample [s], inclusive."""
    every: int = 1
    """Decimation: every ``every``-th sample, beginning with the first."""
    channels: tuple[str, ...] | None = None
    """Names of the channels to export, in order; None: all of the recording and of ``DERIVED``."""
    rest: tuple[float, float] | None = (0.0, 0.0)
    """x and y [m] of the deck at rest, from which ``DERIVED`` is measured; None: unknown."""

    def names(self, run: StoredRun) -> tuple[str, ...]:
        """Return the names of the selected channels.

        Raises
        ------
        InputError
            The recording lacks a selected channel, or has no channels; or a channel is selected
            twice.
        """
        available = run.channels
        if {"x", "y", "angle"} <= set(available):
            derived = tuple(name for name in DERIVED if name not in available)
            if self.rest is not None:
                available = (*available, *derived)
            elif unknown := [name for name in derived if name in (self.channels or ())]:
                raise InputError(
                    f"{run.path}: --channels {unknown[0]}: is measured from the deck's rest "
                    "position, and the recording has no scene to compute it; export x and y"
                )
        if not run.channels:
            raise InputError(f"{run.path}: the recording is empty; there is nothing to export")
        names = available if self.channels is None else self.channels
        for name in names:
            try:
                column_of(name, available)
            except KeyError as error:
                raise InputError(f"{run.path}: {error.args[0]}") from error
        if len(set(names)) < len(names) or not names:
            raise InputError(f"--channels {','.join(names)}: name each channel once")
        return names

    def blocks(self, run: StoredRun) -> Iterator[tuple[int, Array]]:
        """Yield each block's selected samples, with the number of samples read from the run so far.

        The samples have the shape (rows, channels), and may be empty.
        """
        names, read, seen = self.names(run), 0, 0
        derived = [name for name in names if name in DERIVED and name not in run.channels]
        stored = ["x" if name in derived else name for name in names]
        needed, turns = ("x", "y", "angle") if derived else (), TurnVector()
        for block in run.blocks((*stored, *needed, "time")):
            time = block[:, -1]
            if time[0] > self.end:
                return
            if derived:
                x, y, angle = (block[:, -4:-1] - (*(self.rest or (0.0, 0.0)), 0.0)).T
                computed = _derived(x, y, angle, turns)
                for name in derived:
                    block[:, names.index(name)] = computed[name]
                block = np.delete(block, (-4, -3, -2), axis=1)
            inside = block[(time >= self.begin) & (time <= self.end), :-1]
            # Every ``every``-th sample of the selected ones, counted over all blocks.
            chosen = inside[(-seen) % self.every :: self.every]
            read, seen = read + len(block), seen + len(inside)
            yield read, chosen

    def __post_init__(self) -> None:
        if np.isnan([self.begin, self.end]).any() or self.begin > self.end:
            raise InputError(
                f"--from {exact(self.begin)} --to {exact(self.end)}: must be times [s], "
                "and the first must not be later than the second"
            )
        if self.every < 1:
            raise InputError(f"--every {self.every}: must be at least 1")


def _derived(x: Array, y: Array, angle: Array, turns: TurnVector) -> dict[str, Array]:
    """Return the columns of ``DERIVED`` for the next samples: x, y [m], spindle angle [rad]."""
    vectors = turns.of(angle, x, y)
    return {WHIRL: whirl_of(x, y), SIZE: np.abs(vectors), PHASE: np.angle(vectors)}


def export(
    run: StoredRun,
    files: Mapping[str, Path],
    part: Part,
    progress: Callable[[int], None] | None = None,
) -> int:
    """Write samples as tables, in double precision to the bit, with the channels' units.

    Parquet has ``unit`` in the metadata of each column, and the description of the run as JSON in
    the file's metadata, as ``ab_sim``. CSV has the units in its header, as ``x [m]``, and numbers
    with enough digits to restore the same bits, except the payload of a NaN. Files appear when they
    are complete; existing files are kept until then.

    Parameters
    ----------
    run
        Recording to export.
    files
        File for each format, ``PARQUET`` or ``CSV``.
    part
        Selection of samples.
    progress
        Function that is called after every block with the number of samples read so far; if it
        raises an exception, the export ends without files.

    Returns
    -------
    int
        Number of written samples.

    Raises
    ------
    InputError
        See ``Part``; or the selection has no samples. Nothing is written.
    RecordingError
        The recording cannot be read, or a file cannot be written.
    """
    names, rows = part.names(run), 0
    schema = _schema(names, run.description)
    try:
        with ExitStack() as stack:
            writers = []
            for form, file in files.items():
                unfinished = stack.enter_context(replacing(file))
                writers.append(stack.enter_context(_WRITERS[form](unfinished, schema)))
            for read, block in part.blocks(run):
                # `to_pandas_dtype` would import pandas before pyarrow 26.
                columns = [
                    pa.array(block[:, at], type=field.type) for at, field in enumerate(schema)
                ]
                batch = pa.record_batch(columns, schema=schema)
                for writer in writers:
                    writer.write_batch(batch)
                rows += len(block)
                if progress is not None:
                    progress(read)
            if rows == 0:
                raise InputError(
                    f"{run.path}: has no samples from {exact(part.begin)} to {exact(part.end)} s"
                )
    except OSError as error:
        named = " and ".join(str(file) for file in files.values())
        reason = error.strerror or error
        raise RecordingError(f"{named}: cannot be written: {reason}") from error
    return rows


def _schema(names: Sequence[str], description: Mapping[str, Any]) -> pa.Schema:
    """Return the schema of the table: ``step`` is an integer, other channels are doubles."""
    fields = []
    for name in names:
        unit = unit_of(name)
        metadata = None if unit is None else {"unit": unit}
        fields.append(
            pa.field(name, pa.int64() if name == "step" else pa.float64(), False, metadata)
        )
    return pa.schema(fields, {"ab_sim": json.dumps(description)})


def _parquet(file: Path, schema: pa.Schema) -> Any:
    """Return a writer of Parquet."""
    return pa.parquet.ParquetWriter(file, schema, compression="zstd")


class _Csv:
    """Writer of CSV with units in the header."""

    def __init__(self, file: Path, schema: pa.Schema) -> None:
        heads = []
        for name in schema.names:
            unit = unit_of(name)
            heads.append(name if unit is None else f"{name} [{unit}]")
        self._heads = heads
        named = pa.schema([field.with_name(h) for field, h in zip(schema, heads, strict=True)])
        options = pa.csv.WriteOptions(quoting_header="needed")
        self._writer = pa.csv.CSVWriter(file, named, write_options=options)

    def __enter__(self) -> _Csv:
        return self

    def __exit__(self, *_: object) -> None:
        self._writer.close()

    def write_batch(self, batch: pa.RecordBatch) -> None:
        self._writer.write_batch(batch.rename_columns(self._heads))


_WRITERS: dict[str, Callable[[Path, pa.Schema], Any]] = {PARQUET: _parquet, CSV: _Csv}
