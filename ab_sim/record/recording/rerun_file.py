"""Reader of the chunks of a Rerun file, finished or not.

A file has a header and messages. A message has a kind, a length and a protobuf message; that of a
chunk contains an Arrow stream. Rerun's reader (0.41) is not used, because it refuses a file whose
last message is incomplete, and aborts the process on some damaged chunks.
"""

from __future__ import annotations

import errno
import os
import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pyarrow as pa
import pyarrow.compute
from numpy.typing import NDArray

from ab_sim.base.errors import RecordingError
from ab_sim.base.files import check_regular
from ab_sim.base.protobuf import fields_of

T = TypeVar("T")

_MAGIC = b"RRF2"
_HEADER = 12  # bytes: magic, version, options
_MESSAGE = struct.Struct("<QQ")  # kind and length [bytes] of a message
_KINDS = 16  # larger than any kind of a message
_END, _STORE, _CHUNK = range(3)  # kinds of messages; an index may follow the end
_RECORDING = 1  # kind of a store; other stores are blueprints
_LZ4 = 2
_LARGEST_RATIO = 255  # largest ratio of compression by LZ4
_DAMAGE = (pa.ArrowException, ArithmeticError, LookupError, OSError, TypeError, ValueError)


@dataclass(frozen=True)
class Chunk:
    """Chunk of a recording: a table of some rows of an entity."""

    entity_path: str
    table: pa.Table
    place: str  # beginning of error messages: file and byte

    @property
    def is_static(self) -> bool:
        """True if the chunk has no timeline."""
        kinds = [(field.metadata or {}).get(b"rerun:kind") for field in self.table.schema]
        return b"index" not in kinds

    def texts(self, name: str, per_row: int | None = 1) -> list[str]:
        """Return all values of a component, in one list.

        Parameters
        ----------
        name
            Name of the component.
        per_row
            Number of values in each row; None: any.

        Raises
        ------
        RecordingError
            The component is missing, or its values are not texts.
        """
        column = self._flat(name, per_row)
        if not pa.types.is_string(column.type) or column.null_count:
            raise self._wrong(name, "is not text")
        texts: list[str] = column.to_pylist()
        return texts

    def numbers(self, name: str, per_row: int = 1) -> NDArray[Any]:
        """Return all values of a component or timeline, in one array.

        Parameters
        ----------
        name
            Name of the component or timeline.
        per_row
            Number of values in each row.

        Raises
        ------
        RecordingError
            The component is missing, or its values are not numbers.
        """
        column = self._flat(name, per_row)
        if pa.types.is_duration(column.type):
            column = column.cast(pa.int64())
        is_number = pa.types.is_integer(column.type) or pa.types.is_floating(column.type)
        if not is_number or column.null_count:
            raise self._wrong(name, "is not numbers")
        return np.asarray(column.to_numpy())

    def _flat(self, name: str, per_row: int | None) -> pa.ChunkedArray:
        """Return the values of a component or timeline in one column; check their number."""
        if self.table.schema.names.count(name) != 1:
            raise self._wrong(name, "is missing or duplicate")
        column, rows = self.table[name], self.table.num_rows
        if pa.types.is_list(column.type):
            column = pa.compute.list_flatten(column)
        if per_row is not None and len(column) != per_row * rows or not rows:
            raise self._wrong(
                name, f"has {len(column)} values in {rows} rows, and must have {per_row} in each"
            )
        return column

    def _wrong(self, name: str, reason: str) -> RecordingError:
        """Return the error of a component that cannot be used."""
        return _damaged(self.place, f"{name} of {self.entity_path} {reason}")


class RerunFile:
    """Reader of a Rerun file, up to the size that the file had when it was opened.

    An incomplete message at the end, as in a file that is still written, is not read.
    ``recordings`` has the identifiers of the recordings in the file; there are several after
    `rerun rrd merge`. ``torn`` is the reason why the end cannot be read, or None.

    Raises
    ------
    RecordingError
        The file is missing, damaged, or not a Rerun file; `chunks` may raise it, too.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.torn: str | None = None
        with _reading(path):
            if path.is_dir():
                raise IsADirectoryError(errno.EISDIR, "it is a folder")
            check_regular(path)
            self.size = self._end = path.stat().st_size
            stores = [name for _, name in self._parsed(_STORE, _recording_in)]
        self.recordings = [*dict.fromkeys(name for name in stores if name)]

    def chunks(self, *prefixes: str) -> Iterator[Chunk]:
        """Yield chunks of the first recording, in the order of the file.

        Parameters
        ----------
        *prefixes : str
            Beginnings of the entity paths to read; other entities are not decoded.
        """

        def parse(message: bytes) -> tuple[str, pa.Table] | None:
            fields = fields_of(message)
            if _name_of_recording(fields[1][0]) != self.recordings[0]:
                return None
            with pa.ipc.open_stream(_unpacked(fields)) as stream:
                entity = str(stream.schema.metadata[b"rerun:entity_path"], "utf-8")
                if not entity.startswith(prefixes):
                    return None
                table = stream.read_all()
            table.validate(full=True)
            return entity, table

        for place, content in self._parsed(_CHUNK, parse) if self.recordings else ():
            if content:
                yield Chunk(*content, place)

    def _parsed(self, wanted: int, parse: Callable[[bytes], T]) -> Iterator[tuple[str, T]]:
        """Yield the messages of a kind.

        Parameters
        ----------
        wanted
            Kind of the messages.
        parse
            Function that parses the bytes of a message.

        Yields
        ------
        tuple[str, T]
            Place for error messages (file and byte), and parsed content.
        """
        at = _HEADER
        with _reading(self.path), self.path.open("rb") as file:
            if file.read(_HEADER)[: len(_MAGIC)] != _MAGIC or self.size < _HEADER:
                raise RecordingError(f"{self.path} is not a Rerun recording")
            while at < self._end:
                # Filled up, an incomplete header at the end has an impossible kind.
                header = file.read(_MESSAGE.size).ljust(_MESSAGE.size, b"\xff")
                kind, length = _MESSAGE.unpack(header)
                after = at + _MESSAGE.size + length
                if kind >= _KINDS or after > self._end:
                    self.torn = f"incomplete: its last {self.size - at} bytes cannot be read"
                    self._end = at
                    return
                if kind == _END:
                    return
                if kind == wanted:
                    place = f"{self.path} is damaged at byte {at}"
                    try:
                        content = parse(file.read(length))
                    except _DAMAGE as error:
                        raise _damaged(place, str(error)) from error
                    yield place, content
                else:
                    file.seek(length, os.SEEK_CUR)
                at = after


def header_and_messages(encoded: bytes) -> tuple[memoryview, memoryview]:
    """Return header and messages of a complete Rerun file, without end mark and index."""
    at = _HEADER
    while at < len(encoded):
        kind, length = _MESSAGE.unpack_from(encoded, at)
        if kind == _END:
            break
        at += _MESSAGE.size + length
    return memoryview(encoded)[:_HEADER], memoryview(encoded)[_HEADER:at]


def _recording_in(message: bytes) -> str | None:
    """Return the recording's identifier in a message of kind `_STORE`; None for a blueprint."""
    return _name_of_recording(fields_of(fields_of(message)[2][0])[2][0])


def _name_of_recording(store: bytes) -> str | None:
    """Return the identifier in a store's protobuf message; None for a blueprint."""
    fields = fields_of(store)
    return str(fields[2][0], "utf-8") if fields[1] == [_RECORDING] else None


def _unpacked(fields: dict[int, list[Any]]) -> bytes | pa.Buffer:
    """Return the Arrow stream in a message of kind `_CHUNK`."""
    size, payload = fields[3][0], fields[5][0]
    if fields.get(2) != [_LZ4]:
        return payload
    if size > _LARGEST_RATIO * len(payload):
        raise ValueError(f"{size} bytes cannot be compressed to {len(payload)}")
    return pa.decompress(payload, decompressed_size=size, codec="lz4_raw")


@contextmanager
def _reading(path: Path) -> Iterator[None]:
    """Convert an `OSError` in the context to a `RecordingError` that names the file."""
    try:
        yield
    except OSError as error:
        raise RecordingError(f"cannot read the recording {path}: {error.strerror}") from error


def _damaged(place: str, reason: str) -> RecordingError:
    return RecordingError(
        f"{place}: {reason}; copy the file again from where it was recorded, or record it again"
    )
