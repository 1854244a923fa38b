"""Writer of bags."""

from __future__ import annotations

import contextlib
import os
from functools import partial
from io import BufferedWriter
from pathlib import Path
from typing import Any, cast

from rosbags.interfaces import Connection, Qos
from rosbags.rosbag2 import (
    CompressionFormat,
    CompressionMode,
    StoragePlugin,
    Writer,
    WriterError,
)
from rosbags.rosbag2.storage_mcap import McapWriter
from rosbags.typesys import TypesysError

from ab_sim.base.errors import RecordingError
from ab_sim.base.files import lock, write_whole
from ab_sim.record.bags.contract import TYPES
from ab_sim.record.bags.unfinished_bag import END, METADATA, initial_metadata

_CHECKSUM = 201
"""Parameter of zstd that adds a checksum to each frame, which is checked on unpacking."""


class BagWriter:
    """Writer of a bag, for use by one thread at a time; a context manager.

    After every flush, other programs can read the bag: the file has an MCAP footer without summary,
    which the next message overwrites, and ``metadata.yaml`` has the topics, with message counts of
    0. A killed writer leaves this state, or an incomplete record, which `repair_bag` removes.

    After a write error (such as a full disk), the file is cut back to the last complete flush, so
    that `Bag` can read it. All methods except `close` then raise the error again.

    Parameters
    ----------
    path
        Folder of the bag, which is created and must not exist.
    file
        Name of the file in the folder; empty: NAME_0.mcap, because ``ros2 bag reindex`` only finds
        files whose names end in a number.

    Raises
    ------
    RecordingError
        The folder cannot be created; the methods raise it if the bag cannot be written.
    """

    def __init__(self, path: Path | str, file: str = "") -> None:
        self.path = Path(path)
        self.messages = 0
        self.messages_written = 0
        """Number of messages in the file, after the last flush."""
        self._topics: dict[str, Connection] = {}
        self._latest = 0
        self._error: RecordingError | None = None
        self._closed = False
        try:
            self._writer = Writer(self.path, version=9, storage_plugin=StoragePlugin.MCAP)
            self._writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
            self._writer.open()
            self._name_file(file or f"{self.path.name}_0.mcap")
        except WriterError as error:
            raise RecordingError(f"cannot write the bag {path}: it exists already") from error
        except OSError as error:
            raise RecordingError(f"cannot write the bag {path}: {error.strerror}") from error
        assert isinstance(self._writer.storage, McapWriter)
        self._storage = self._writer.storage
        # rosbags writes no MCAP checksum. Without a checksum, damage would be read as samples.
        compress: Any = self._storage.compressor
        self._storage.compressor = partial(compress, options={_CHECKSUM: 1})
        self._whole = 0
        self._metadata_topics = -1  # number of topics in the metadata file
        self.flush()

    def __enter__(self) -> BagWriter:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def topic(self, name: str, type_name: str, qos: Qos | None) -> None:
        """Declare a topic, which must precede the topic's first message.

        Parameters
        ----------
        name
            Full name of the topic.
        type_name
            Type of its messages.
        qos
            QoS profile with which players publish the topic; None: unknown.

        Raises
        ------
        RecordingError
            The type is unknown.
        """
        self._check_usable()
        try:
            self._topics[name] = self._writer.add_connection(
                name, type_name, typestore=TYPES, offered_qos_profiles=[qos] if qos else []
            )
        except TypesysError as error:
            raise RecordingError(f"{name}: cannot be written: unknown type {type_name}") from error

    def write(self, topic: str, time: int, message: bytes | memoryview) -> None:
        """Add a message.

        Parameters
        ----------
        topic
            Full name of the message's topic.
        time
            Receive time [ns]. If it is earlier than that of the message before, it is replaced by
            that, so that a clock that was set back does not change the order.
        message
            Serialised message (CDR).
        """
        self._check_usable()
        self._latest = max(self._latest, time)
        try:
            self._writer.write(self._topics[topic], self._latest, message)
        except OSError as error:
            raise self._fail(error) from error
        self.messages += 1

    def flush(self) -> None:
        """Write all messages added so far to the file."""
        self._check_usable()
        storage = self._storage
        try:
            # The footer follows each flush, so that other programs can read the file. The next
            # chunk overwrites it.
            if storage.chunk.msgs:
                storage.close_chunk()
            whole = storage.bio.tell()
            storage.bio.write(END)
            storage.bio.seek(whole)
            if self._metadata_topics != len(self._topics):
                write_whole(
                    self.path / METADATA, initial_metadata(storage.path, self._topics.values())
                )
                self._metadata_topics = len(self._topics)
        except OSError as error:
            raise self._fail(error) from error
        self._whole = whole
        self.messages_written = self.messages

    def close(self) -> None:
        """Write the remaining messages and the summary; after a close or an error, do nothing."""
        if self._closed or self._error:
            return
        self.flush()
        try:
            self._writer.close()
        except OSError as error:
            raise self._fail(error) from error
        self._closed = True

    def _name_file(self, name: str) -> None:
        """Rename the bag's file from the name that rosbags chose, and lock the file."""
        storage = self._writer.storage
        assert isinstance(storage, McapWriter)
        storage.bio.close()  # Windows renames only closed files
        storage.path = storage.path.rename(self.path / name)
        storage.bio = cast(BufferedWriter, storage.path.open("r+b"))
        storage.bio.seek(0, os.SEEK_END)
        lock(storage.bio, wait=True)  # `repair_bag` finds this lock

    def _check_usable(self) -> None:
        """Raise the error of an earlier write again; refuse a closed bag."""
        if self._error:
            raise self._error
        if self._closed:
            raise RecordingError(f"the bag {self.path} is closed")

    def _fail(self, error: OSError) -> RecordingError:
        """Cut the file back to the last complete flush, and return the error to raise."""
        with contextlib.suppress(OSError):  # this tries again to write, and fails
            self._storage.abort()
        with contextlib.suppress(OSError):
            os.truncate(self._storage.path, self._whole)
            with self._storage.path.open("ab") as file:
                file.write(END)
        self._error = RecordingError(
            f"recording stopped: the bag {self.path} contains {self.messages_written} of "
            f"{self.messages} messages, and cannot be written any further: {error.strerror}"
        )
        return self._error
