"""Bags without an end: their metadata, and MCAP files without a footer."""

from __future__ import annotations

import io
import struct
from collections.abc import Collection
from io import StringIO
from pathlib import Path
from typing import Any, BinaryIO

from rosbags.interfaces import Connection, ConnectionExtRosbag2
from rosbags.rosbag2.metadata import dump_qos_v9
from ruamel.yaml import YAML

from ab_sim.base.files import check_regular

METADATA = "metadata.yaml"
_UNFINISHED = "ab_sim_unfinished"


def initial_metadata(file: Path, topics: Collection[Connection]) -> bytes:
    """Return the content of ``metadata.yaml`` for an MCAP file without messages so far."""
    none = {"nanoseconds": 0}
    since = {"nanoseconds_since_epoch": 0}
    about: dict[str, Any] = {
        "version": 9,
        "storage_identifier": "mcap",
        "relative_file_paths": [file.name],
        "duration": none,
        "starting_time": since,
        "message_count": 0,
        "topics_with_message_count": [
            {"topic_metadata": _topic(topic), "message_count": 0} for topic in topics
        ],
        "compression_format": "",
        "compression_mode": "",
        "files": [
            {"path": file.name, "starting_time": since, "duration": none, "message_count": 0}
        ],
        "custom_data": {_UNFINISHED: "message counts and times are not those of the file"},
        "ros_distro": "rosbags",
    }
    yaml, text = YAML(typ="safe"), StringIO()
    yaml.default_flow_style = False
    yaml.representer.ignore_aliases = lambda *_: True  # some parsers do not support aliases
    yaml.dump({"rosbag2_bagfile_information": about}, text)
    return text.getvalue().encode()


def is_unfinished(path: Path) -> bool:
    """Return whether a metadata file was written by ``initial_metadata``."""
    return f"{_UNFINISHED}:" in path.read_text(encoding="utf-8", errors="replace")


def _topic(topic: Connection) -> dict[str, Any]:
    """Return a topic's entry in ``metadata.yaml``."""
    assert isinstance(topic.ext, ConnectionExtRosbag2)
    return {
        "name": topic.topic,
        "type": topic.msgtype,
        "serialization_format": topic.ext.serialization_format,
        "offered_qos_profiles": dump_qos_v9(topic.ext.offered_qos_profiles),
        "type_description_hash": topic.digest,
    }


MAGIC = b"\x89MCAP0\r\n"
_FOOTER = struct.Struct("<BQQQI")  # 2, length, start of the summary, start of its offsets, checksum
_DATA_END = b"\x0f" + struct.pack("<QI", 4, 0)
END = _DATA_END + _FOOTER.pack(2, 20, 0, 0, 0) + MAGIC
"""Footer of a file without a summary; readers then scan the whole file."""
_RECORD = struct.Struct("<BQ")


def is_finished(path: Path) -> bool:
    """Return whether an MCAP file has a footer and a summary."""
    check_regular(path)
    with path.open("rb") as file:
        size = file.seek(0, io.SEEK_END)
        file.seek(max(size - len(MAGIC) - _FOOTER.size, 0))
        last = file.read()
    if len(last) < len(MAGIC) + _FOOTER.size or not last.endswith(MAGIC):
        return False
    kind, length, summary, *_ = _FOOTER.unpack(last[: _FOOTER.size])
    return (kind, length) == (2, 20) and summary > 0


def written_by(path: Path) -> str:
    """Return the library that the header of an MCAP file names; empty if there is none."""
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
    """Path-like object of an MCAP file without a footer; opened, it reads as if it had one.

    The footer follows the complete records, and an incomplete record at the end is left out. The
    file is not changed.
    """

    def __init__(self, path: Path) -> None:
        self._path = path

    def __str__(self) -> str:
        return str(self._path)

    def open(self, mode: str) -> BinaryIO:
        """Open the file for reading, with the footer; ``mode`` is ignored."""
        file = self._path.open("rb")
        return io.BufferedReader(_CompletedStream(file, _whole_bytes(file)), 1 << 20)


class _CompletedStream(io.RawIOBase):
    """Stream of the first ``whole`` bytes of a file and a footer."""

    def __init__(self, file: BinaryIO, whole: int) -> None:
        self._file, self._whole_bytes, self._at = file, whole, 0

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        base = {io.SEEK_SET: 0, io.SEEK_CUR: self._at, io.SEEK_END: self._whole_bytes + len(END)}
        self._at = base[whence] + offset
        return self._at

    def readinto(self, buffer: Any) -> int:
        if self._at < self._whole_bytes:
            self._file.seek(self._at)
            data = self._file.read(min(len(buffer), self._whole_bytes - self._at))
        else:
            data = END[self._at - self._whole_bytes :][: len(buffer)]
        buffer[: len(data)] = data
        self._at += len(data)
        return len(data)

    def close(self) -> None:
        self._file.close()
        super().close()


def torn_bytes(path: Path) -> int:
    """Return the number of bytes at the end of a file that belong to no complete record."""
    with path.open("rb") as file:
        whole = _whole_bytes(file)
        file.seek(whole)
        rest = file.read(len(END) + 1)
        return 0 if rest == END else file.seek(0, io.SEEK_END) - whole


def _whole_bytes(file: BinaryIO) -> int:
    """Return the length of the complete records at the start of a file [bytes]."""
    size = file.seek(0, io.SEEK_END)
    at = len(MAGIC)
    while at + _RECORD.size <= size:
        file.seek(at)
        kind, length = _RECORD.unpack(file.read(_RECORD.size))
        # These kinds end the data; only the summary may follow.
        if kind in (0x00, 0x02, 0x0F) or at + _RECORD.size + length > size:
            break
        at += _RECORD.size + length
    return min(at, size)
