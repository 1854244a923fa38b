"""MCAP files without an end: their writer was killed, or is still at work."""

from __future__ import annotations

import fcntl
import io
import struct
from pathlib import Path
from typing import Any, BinaryIO

MAGIC = b"\x89MCAP0\r\n"
_FOOTER = struct.Struct("<BQQQI")  # 2, length, where the summary begins, and its offsets; checksum
_DATA_END = b"\x0f" + struct.pack("<QI", 4, 0)
END = _DATA_END + _FOOTER.pack(2, 20, 0, 0, 0) + MAGIC
"""Of a file that has no summary: whoever reads it goes through all of it."""
_RECORD = struct.Struct("<BQ")


def is_finished(path: Path) -> bool:
    """Whether an MCAP file has the end that it should have, with a summary."""
    with path.open("rb") as file:
        size = file.seek(0, io.SEEK_END)
        file.seek(max(size - len(MAGIC) - _FOOTER.size, 0))
        last = file.read()
    if len(last) < len(MAGIC) + _FOOTER.size or not last.endswith(MAGIC):
        return False
    kind, length, summary, *_ = _FOOTER.unpack(last[: _FOOTER.size])
    return (kind, length) == (2, 20) and summary > 0


def is_being_written(path: Path) -> bool:
    """Whether somebody has a file open to write it, as far as the system tells."""
    with path.open("rb") as file:
        try:  # `BagWriter` holds a lock
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        try:  # others do not; Linux gives a lease on a file only if nobody writes it
            fcntl.fcntl(file, fcntl.F_SETLEASE, fcntl.F_RDLCK)
            fcntl.fcntl(file, fcntl.F_SETLEASE, fcntl.F_UNLCK)
        except BlockingIOError:
            return True
        except OSError:
            pass  # somebody else's file, or a file system without leases
    return False


def written_by(path: Path) -> str:
    """The library that wrote an MCAP file, by its own word; nothing if it does not say."""
    with path.open("rb") as file:
        file.seek(len(MAGIC) + _RECORD.size)
        try:
            (profile,) = struct.unpack("<I", file.read(4))
            file.seek(profile, io.SEEK_CUR)
            (length,) = struct.unpack("<I", file.read(4))
        except struct.error:
            return ""
        return file.read(min(length, 200)).decode(errors="replace")


class CompletedFile:
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


def torn_bytes(path: Path) -> int:
    """How many bytes at the end of a file belong to nothing that can be read."""
    with path.open("rb") as file:
        whole = _whole(file)
        file.seek(whole)
        rest = file.read(len(END) + 1)
        return 0 if rest == END else file.seek(0, io.SEEK_END) - whole


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
