"""Limits of the unpacked size of a bag's content, which rosbags does not have.

A few kilobytes of compressed zeros unpack to gigabytes, so unpacking stops at a limit.
"""

from __future__ import annotations

import os
import sys
from types import SimpleNamespace
from typing import Any, BinaryIO, Literal

import lz4.frame
from rosbags.rosbag2 import reader as rosbag2_reader
from rosbags.rosbag2 import storage_mcap

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

MOST_CHUNK = 1 << 26
"""Largest size of a chunk of an MCAP file, or of a message [bytes]; rosbag2 begins a chunk each 768
KiB."""
MOST_RATIO = 200
"""Largest ratio of the size of a file that was compressed as a whole to its compressed size."""


def bound_rosbags() -> None:
    """Replace the functions by which rosbags unpacks by functions with limits."""
    table: dict[str, Any] = storage_mcap.DECOMPRESSORS
    table["zstd"] = lambda data, size: _chunk(zstd.ZstdDecompressor(), data, size)
    table["lz4"] = lambda data, size: _chunk(lz4.frame.LZ4FrameDecompressor(), data, size)
    reader: Any = rosbag2_reader
    reader.zstd = SimpleNamespace(open=_BoundedFile, decompress=_message)


def _chunk(decompressor: Any, data: bytes, size: int) -> bytes:
    if size > MOST_CHUNK:
        raise ValueError(f"a chunk unpacks to {size} bytes; must be at most {MOST_CHUNK}")
    unpacked: bytes = decompressor.decompress(data, max_length=size + 1)
    if len(unpacked) > size:
        raise ValueError(f"a chunk unpacks to more than the {size} bytes that it states")
    return unpacked


def _message(data: bytes) -> bytes:
    unpacked = zstd.ZstdDecompressor().decompress(data, max_length=MOST_CHUNK + 1)
    if len(unpacked) > MOST_CHUNK:
        raise ValueError(f"a message unpacks to more than {MOST_CHUNK} bytes")
    return unpacked


class _BoundedFile(zstd.ZstdFile):
    """Compressed file, open for reading up to a limit of its unpacked size."""

    def __init__(self, file: BinaryIO, mode: Literal["rb"]) -> None:
        super().__init__(file, mode)
        self._left = self._most = MOST_CHUNK + MOST_RATIO * os.fstat(file.fileno()).st_size

    def read(self, size: int | None = -1) -> bytes:
        """Read and unpack up to ``size`` bytes; None or negative: all.

        Raises:
            ValueError: the file unpacks to more than the limit.
        """
        if size is None or not 0 <= size <= self._left:
            size = self._left + 1
        data: bytes = super().read(size)
        self._left -= len(data)
        if self._left < 0:
            raise ValueError(
                f"a compressed file unpacks to more than {self._most} bytes; if that is right, "
                "unpack it with `zstd -d` and set its compression_mode to ''"
            )
        return data
