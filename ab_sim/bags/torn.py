"""MCAP files without an end: their writer was killed, or is still at work."""

from __future__ import annotations

import io
import struct
from pathlib import Path
from typing import Any, BinaryIO

MAGIC = b"\x89MCAP0\r\n"
_DATA_END = b"\x0f" + struct.pack("<QI", 4, 0)
_FOOTER = b"\x02" + struct.pack("<QQQI", 20, 0, 0, 0)
END = _DATA_END + _FOOTER + MAGIC
"""Of a file that has no summary: whoever reads it goes through all of it."""
_RECORD = struct.Struct("<BQ")


def has_end(path: Path) -> bool:
    """Whether an MCAP file has the end that it should have."""
    with path.open("rb") as file:
        size = file.seek(0, io.SEEK_END)
        file.seek(max(size - len(MAGIC), 0))
        return size > 2 * len(MAGIC) and file.read() == MAGIC


class Mended:
    """Stands for the path of a file without an end: opened, it has one after its last whole record.

    Nothing is written.
    """

    def __init__(self, path: Path) -> None:
        self._path = path

    def __str__(self) -> str:
        return str(self._path)

    def open(self, mode: str) -> BinaryIO:
        """Open it to read."""
        file = self._path.open("rb")
        return io.BufferedReader(_WithEnd(file, _whole(file)), 1 << 20)


class _WithEnd(io.RawIOBase):
    def __init__(self, file: BinaryIO, whole: int) -> None:
        self._file, self._whole, self._at = file, whole, 0

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        base = {io.SEEK_SET: 0, io.SEEK_CUR: self._at, io.SEEK_END: self._whole + len(END)}
        self._at = base[whence] + offset
        return self._at

    def readinto(self, buffer: Any) -> int:
        if self._at < self._whole:
            self._file.seek(self._at)
            data = self._file.read(min(len(buffer), self._whole - self._at))
        else:
            data = END[self._at - self._whole :][: len(buffer)]
        buffer[: len(data)] = data
        self._at += len(data)
        return len(data)

    def close(self) -> None:
        self._file.close()
        super().close()


def _whole(file: BinaryIO) -> int:
    """How many bytes from the start are whole records."""
    size = file.seek(0, io.SEEK_END)
    at = len(MAGIC)
    while at + _RECORD.size <= size:
        file.seek(at)
        kind, length = _RECORD.unpack(file.read(_RECORD.size))
        # Data ends here; what follows would be the summary.
        if kind in (0x00, 0x02, 0x0F) or at + _RECORD.size + length > size:
            break
        at += _RECORD.size + length
    return min(at, size)
