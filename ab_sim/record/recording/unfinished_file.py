"""Files of a killed writer, with an incomplete last message, which Rerun refuses."""

from __future__ import annotations

import os
import struct
import tempfile
from dataclasses import dataclass
from pathlib import Path

from ab_sim.base.errors import RecordingError
from ab_sim.base.input_file import check_regular

_MAGIC = b"RRF2"
_HEADER = 12  # bytes: magic, version, options
_MESSAGE = struct.Struct("<QQ")  # kind and length [bytes] of a message
_KINDS = 16  # more than there are


@dataclass(frozen=True)
class ReadableFile:
    """A file that Rerun can open; a temporary one exists as long as ``keep``."""

    path: Path
    keep: tempfile.TemporaryDirectory[str] | None = None


def readable_part(path: Path) -> tuple[ReadableFile, str | None]:
    """Return a file without an incomplete message at its end.

    Returns
    -------
    ReadableFile, str or None
        The file itself, or a copy of its complete messages and a text on the rest.

    Raises
    ------
    RecordingError
        The file is missing, or not one of Rerun's.
    """
    if path.is_dir():
        raise RecordingError(f"cannot read the recording {path}: it is a folder")
    try:
        check_regular(path)
        size, whole = path.stat().st_size, _whole_size(path)
        if whole == size:
            return ReadableFile(path), None
        folder = tempfile.TemporaryDirectory(prefix="ab_sim_")
        copy = Path(folder.name) / path.name
        with path.open("rb") as source, copy.open("wb") as target:
            _copy(source.fileno(), target.fileno(), whole)
    except OSError as error:
        raise RecordingError(f"cannot read the recording {path}: {error.strerror}") from error
    return ReadableFile(copy, folder), f"torn: its last {size - whole} bytes cannot be read"


def _whole_size(path: Path) -> int:
    """Return the size up to the end of the last complete message [bytes]."""
    size = path.stat().st_size
    with path.open("rb") as file:
        if file.read(_HEADER)[: len(_MAGIC)] != _MAGIC or size < _HEADER:
            raise RecordingError(f"{path} is not a Rerun recording")
        end = _HEADER
        while len(header := file.read(_MESSAGE.size)) == _MESSAGE.size:
            kind, length = _MESSAGE.unpack(header)
            after = end + _MESSAGE.size + length
            if kind >= _KINDS or after > size:
                return end
            if kind == 0:  # the end mark, which the index follows
                return size
            file.seek(length, os.SEEK_CUR)
            end = after
    return end


def _copy(source: int, target: int, count: int) -> None:
    while count:
        done = os.sendfile(target, source, None, min(count, 1 << 30))
        if done == 0:
            return
        count -= done
