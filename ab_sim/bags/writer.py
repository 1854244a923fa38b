"""Writing a bag."""

from __future__ import annotations

import contextlib
import os
from functools import partial
from pathlib import Path
from typing import Any

from rosbags.interfaces import Connection, Qos
from rosbags.rosbag2 import (
    CompressionFormat,
    CompressionMode,
    StoragePlugin,
    Writer,
    WriterError,
)
from rosbags.rosbag2.storage_mcap import McapWriter

from ab_sim.bags.messages import TYPES
from ab_sim.errors import RecordingError

_CHECKSUM = 201
"""zstd's parameter of that name: frames carry one, and whoever unpacks them checks it."""


class BagWriter:
    """A bag on its way to the disk; from one thread at a time.

    After a write error (disk full) every method but `close` raises it again, and the file is cut
    back to the last flush that was whole, so that `Bag` can read it.

    Args:
        path: the bag's folder, which is made, and must not be there.

    Raises:
        RecordingError: it cannot be made. So do the methods, where it cannot be written.
    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        self.messages = 0
        self.messages_written = 0
        """Of these, messages that are in the file."""
        self._topics: dict[str, Connection] = {}
        self._latest = 0
        self._error: RecordingError | None = None
        self._closed = False
        try:
            self._writer = Writer(self.path, version=9, storage_plugin=StoragePlugin.MCAP)
            self._writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
            self._writer.open()
        except WriterError as error:
            raise RecordingError(f"cannot write the bag {path}: it is there already") from error
        except OSError as error:
            raise RecordingError(f"cannot write the bag {path}: {error.strerror}") from error
        assert isinstance(self._writer.storage, McapWriter)
        self._storage = self._writer.storage
        # rosbags leaves MCAP's own checksum out; without any, damage would pass for samples.
        compress: Any = self._storage.compressor
        self._storage.compressor = partial(compress, options={_CHECKSUM: 1})
        self._whole = 0
        self.flush()

    def __enter__(self) -> BagWriter:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def topic(self, name: str, type_name: str, qos: Qos) -> None:
        """Say what a topic is, before its first message; ``qos`` is what a player will offer."""
        self._check_usable()
        self._topics[name] = self._writer.add_connection(
            name, type_name, typestore=TYPES, offered_qos_profiles=[qos]
        )

    def write(self, topic: str, time: int, message: bytes | memoryview) -> None:
        """Take a message.

        Args:
            topic: its full name.
            time: when it came [ns]. Never earlier than the one before: a clock that was put back
                would put messages into another order.
            message: in CDR.
        """
        self._check_usable()
        self._latest = max(self._latest, time)
        try:
            self._writer.write(self._topics[topic], self._latest, message)
        except OSError as error:
            raise self._fail(error) from error
        self.messages += 1

    def flush(self) -> None:
        """Put into the file what was taken."""
        self._check_usable()
        storage = self._storage
        try:
            if storage.chunk.msgs:
                storage.close_chunk()
            storage.bio.flush()
        except OSError as error:
            raise self._fail(error) from error
        self._whole = storage.bio.tell()
        self.messages_written = self.messages

    def close(self) -> None:
        """Write the rest, and what makes the bag complete. Does nothing when closed or failed."""
        if self._closed or self._error:
            return
        self.flush()
        try:
            self._writer.close()
        except OSError as error:
            raise self._fail(error) from error
        self._closed = True

    def _check_usable(self) -> None:
        if self._error:
            raise self._error
        if self._closed:
            raise RecordingError(f"the bag {self.path} is closed")

    def _fail(self, error: OSError) -> RecordingError:
        with contextlib.suppress(OSError):  # it writes what is left, in vain again
            self._storage.abort()
        with contextlib.suppress(OSError):
            os.truncate(self._storage.path, self._whole)
        self._error = RecordingError(
            f"recording stopped: the bag {self.path} holds {self.messages_written} of "
            f"{self.messages} messages and cannot be written further: {error.strerror}"
        )
        return self._error
