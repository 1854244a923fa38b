"""Tables from recordings of any kind: named columns of numbers with units."""

import codecs
import json
import re
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

from ab_sim.base.errors import InputError, nearest, short
from ab_sim.base.files import check_regular
from ab_sim.base.numbers import number_in
from ab_sim.drive.trajectory import unit_of

_MOST_ROWS = 1_000_000
"""Largest number of rows; an identification takes about 2.3 kB of memory per row."""
_MOST_COLUMNS = 1000
"""Largest number of columns of a Parquet file."""
_UTF_8, _LATIN_1 = "utf-8", "latin-1"
_MARKS = (
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
"""Byte-order marks and encodings of text; long marks first, as short ones can be prefixes."""
_FIRST_BYTES = 1 << 16
"""Number of bytes in which the first line of a text is sought."""
_HEAD = re.compile(r"(.*?)\s*\[([^\]]*)\]\s*")
"""Pattern of a column title with a unit in brackets: ``x [mm]``."""
FAULTS = "faults"
"""Source of a recording's events about faults of the drive."""


@dataclass(frozen=True)
class Table:
    """Named columns of a file, with units and, for a recording, the description of the run."""

    name: str
    columns: Mapping[str, np.ndarray]
    units: Mapping[str, str | None]
    """Units stated by the file."""
    description: Mapping[str, Any]
    """Description of ab_sim's run; empty for a real drive."""
    notes: tuple[str, ...] = ()

    def column(self, name: str, place: str) -> np.ndarray:
        """Return the numbers of a column.

        Parameters
        ----------
        name
            Name of the column.
        place
            Origin of the request, for messages.

        Raises
        ------
        InputError
            There is no such column, or it does not contain numbers.
        """
        if name not in self.columns:
            near = nearest(name, self.columns)
            raise InputError(
                f"{self.name}: {place}: there is no column {name!r}{near}; it has "
                + ", ".join(self.columns)
            )
        values = self.columns[name]
        if values.dtype.kind in "mM":
            since = values - values[0] if values.dtype.kind == "M" else values
            return since / np.timedelta64(1, "s")
        if values.dtype.kind not in "fiu":
            raise InputError(f"{self.name}: {place}: the column {name!r} {_contents(values)}")
        return values.astype(float)

    def unit_of(self, name: str, written: str | None) -> str | None:
        """Return the unit of the numbers that ``column`` returns.

        Parameters
        ----------
        name
            Name of the column.
        written
            Unit that a mapping gives; None: that of the file.

        Raises
        ------
        InputError
            The mapping gives another unit than the column has.
        """
        values = self.columns.get(name)
        if values is None or values.dtype.kind not in "mM":
            return self.units.get(name) if written is None else written
        if written not in (None, "s"):
            raise InputError(
                f"{self.name}: the column {name!r} holds time stamps, which are read in s; leave "
                f"its unit {written!r} out of the mapping"
            )
        return "s"


def read_table(path: Path, rows_of: str | None = None) -> Table:
    """Read a file as a table.

    Parameters
    ----------
    path
        An .rrd, .parquet or .csv file, or the folder of a ROS bag.
    rows_of
        See ``import_bag``.

    Raises
    ------
    InputError
        The file has another type, or contains no table.
    RecordingError
        The file cannot be read.
    """
    ending = path.suffix.lower()
    if path.is_dir() or ending == ".mcap":
        return _of_bag(path, rows_of)
    try:
        check_regular(path)
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from error
    if ending == ".rrd":
        return _of_recording(path, path.stem)
    if ending not in (".parquet", ".csv"):
        raise InputError(
            f"{path}: must be a recording (.rrd), a ROS bag (its folder), .parquet or .csv"
        )
    if path.stat().st_size == 0:
        raise InputError(f"{path}: is empty")
    encoding = _encoding(path) if ending == ".csv" else _UTF_8
    options = pa.csv.ReadOptions(encoding=encoding)
    try:
        read = (
            _of_parquet(path)
            if ending == ".parquet"
            else pa.csv.read_csv(path, read_options=options)
        )
    except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
        reason = (ending == ".csv" and _csv_fault(path, encoding)) or " ".join(str(error).split())[
            :200
        ]
        raise InputError(f"{path}: cannot be read as a table: {reason}") from error
    if ending == ".csv" and read.num_columns == 1 and (fault := _csv_fault(path, encoding)):
        raise InputError(f"{path}: cannot be read as a table: {fault}")
    if all(map(_is_number, read.column_names)):
        raise InputError(
            f"{path}: its first line is numbers; must name the columns, e.g. t [s],x [mm]"
        )
    _check_rows(path, read.num_rows)
    notes = (f"its head is not UTF-8; it was read as {encoding}",) if encoding == _LATIN_1 else ()
    try:
        return _of_arrow(read, path.stem, notes)
    except ValueError as error:
        raise InputError(
            f"{path}: cannot be read as a table: its units or notes are damaged: {error}"
        ) from error


def _check_rows(path: Path, rows: int) -> None:
    """Refuse a table without rows, or with more than ``_MOST_ROWS``."""
    if not 0 < rows <= _MOST_ROWS:
        raise InputError(
            f"{path}: has {rows} rows; must be 1 to {_MOST_ROWS}; cut the recording, or keep every "
            "n-th row"
        )


def _of_parquet(path: Path) -> pa.Table:
    """Read a Parquet file if the size that it states is allowed; a small file can state any size.

    Raises
    ------
    InputError
        It has too many rows or columns.
    """
    with pa.parquet.ParquetFile(path) as file:
        _check_rows(path, file.metadata.num_rows)
        schema = file.schema_arrow
        if len(schema) > _MOST_COLUMNS:
            raise InputError(
                f"{path}: has {len(schema)} columns; must have at most {_MOST_COLUMNS}; keep those "
                "that the mapping names"
            )
        texts = [field.name for field in schema if not pa.types.is_primitive(field.type)]
    # Repeated long texts are small in the file; dictionary encoding keeps them small in memory.
    return pa.parquet.read_table(path, read_dictionary=texts)


def _encoding(path: Path) -> str:
    """Guess a text's encoding from its byte-order mark and its first line."""
    with path.open("rb") as file:
        begin = file.read(_FIRST_BYTES)
    for mark, encoding in _MARKS:
        if begin.startswith(mark):
            return encoding
    # ASCII characters in two bytes each, without a byte-order mark.
    if begin[1:2] == b"\0":
        return "utf-16-le"
    if begin[:1] == b"\0":
        return "utf-16-be"
    try:
        begin.partition(b"\n")[0].decode(_UTF_8)
    except UnicodeDecodeError:
        return _LATIN_1
    return _UTF_8


def _contents(values: np.ndarray) -> str:
    """Describe the values of a column that are no numbers, and the remedy."""
    there = [(row, value) for row, value in enumerate(values.tolist()) if value is not None]
    if not there:
        return "is empty"
    row, value = there[0]
    if isinstance(value, bool):
        return "holds truth values, not numbers; write 0 and 1, or choose another column"
    if not isinstance(value, str | bytes):
        return f"holds {type(value).__name__} values, not numbers; write one number in each row"
    row, value = next((entry for entry in there if not _is_number(entry[1])), (row, value))
    return (
        f"holds texts, not numbers: {short(value)} at row {row}; is there a line that is no data?"
    )


def _csv_fault(path: Path, encoding: str) -> str:
    """Describe the likely fault of a CSV file; return an empty text if it is unknown."""
    with path.open(encoding=encoding, errors="replace") as file:
        head = file.readline()
        columns = head.count(",") + 1
        if head.count(";") > head.count(","):
            return "its separator is ';'; must be ',', with points in numbers (1.5, not 1,5)"
        counts: list[int] = []
        for line in file:
            if len(counts) > _MOST_ROWS:
                return ""
            counts.append(line.count(",") + 1)
    if counts and counts[-1] < columns and set(counts[:-1]) <= {columns}:
        return (
            f"line {len(counts) + 1}, the last, is torn: it has {counts[-1]} of {columns} columns; "
            "remove it"
        )
    if columns > 1 and counts and counts[0] == 2 * columns:
        return "its numbers have decimal commas; must have points (1.5, not 1,5)"
    return ""


def _is_number(text: str | bytes) -> bool:
    """Return whether a text, or bytes from a column, can be read as a number."""
    try:
        number_in(text) if isinstance(text, str) else float(text)
    except ValueError:
        return False
    return True


def _of_arrow(read: pa.Table, name: str, notes: tuple[str, ...] = ()) -> Table:
    """Return a table with units from titles, ``x [mm]``, or else from the columns' metadata."""
    columns: dict[str, np.ndarray] = {}
    units: dict[str, str | None] = {}
    for field, column in zip(read.schema, read.columns, strict=True):
        head = _HEAD.fullmatch(field.name)
        title = head[1] if head else field.name
        if title in columns:
            raise InputError(f"{name}: has two columns {title!r}; give each a unique name")
        written = (field.metadata or {}).get(b"unit", b"").decode() or None
        units[title] = head[2].strip() if head else written
        columns[title] = _plain(column).to_numpy(zero_copy_only=False)
    metadata = (read.schema.metadata or {}).get(b"ab_sim")
    return Table(name, columns, units, json.loads(metadata) if metadata else {}, notes)


def _plain(column: pa.ChunkedArray) -> pa.ChunkedArray:
    """Return a column in a type that NumPy supports."""
    kind = column.type
    if pa.types.is_dictionary(kind):
        return _plain(column.cast(kind.value_type))
    if pa.types.is_decimal(kind):
        return column.cast(pa.float64())
    if pa.types.is_time(kind):  # time of day
        return column.cast(pa.int32() if kind.bit_width == 32 else pa.int64()).cast(
            pa.duration(kind.unit)
        )
    return column


def _of_recording(path: Path, name: str) -> Table:
    """Return a recording's samples; missing steps and the first time of each fault become notes."""
    from ab_sim.record.recording import open_recording  # Rerun takes 0.5 s to import

    run = open_recording(path)
    extent = run.extent
    if not extent.rows:
        raise InputError(f"{run.path}: the recording is empty: it has no samples")
    samples = run.trajectory()
    columns = {channel: samples[channel] for channel in run.channels}
    notes = [*run.remarks]
    if extent.missing:
        notes.append(f"{extent.missing} steps are missing, at {extent.gaps} places")
    first: dict[str, float] = {}
    for event in run.notes.events:
        if event.source == FAULTS and not event.text.endswith("none"):
            first.setdefault(event.text, event.time)
    notes += [f"the recorder noted {text}, from {at:.4g} s on" for text, at in first.items()]
    units = {channel: unit_of(channel) for channel in run.channels}
    return Table(name, columns, units, run.description, tuple(notes))


def _of_bag(path: Path, rows_of: str | None) -> Table:
    """Convert a ROS bag of a single run to a temporary recording, and return that as a table."""
    from ab_sim.record.bags.importing import import_bag  # rosbags and Rerun take 0.7 s to import

    with tempfile.TemporaryDirectory(prefix="ab_sim_") as folder:
        import_result = import_bag(path, Path(folder) / "bag.rrd", rows_of=rows_of)
        if len(import_result.files) > 1:
            raise InputError(
                f"{path}: holds {len(import_result.files)} successive runs; convert them to "
                "recordings (ab-sim import) and give the wanted ones"
            )
        return _of_recording(import_result.files[0], path.stem)
