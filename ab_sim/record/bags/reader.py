"""Reader of bags, with limits of the unpacked size."""

from __future__ import annotations

import os
import sys
from collections.abc import Collection, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any, BinaryIO, Literal, NamedTuple

import lz4.frame
from rosbags.interfaces import Qos
from rosbags.rosbag2 import Reader, storage_mcap
from rosbags.rosbag2 import reader as rosbag2_reader
from rosbags.rosbag2.reader import DirectoryReader
from rosbags.rosbag2.storage_mcap import McapReader

from ab_sim.base.errors import InputError, RecordingError, shortened
from ab_sim.base.files import check_regular
from ab_sim.base.yaml_files import read_yaml_file
from ab_sim.record.bags import contract
from ab_sim.record.bags.unfinished_bag import MAGIC, METADATA, CompletedFile, is_finished

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

MOST_CHUNK = 1 << 26
"""Largest accepted size of a chunk or message of an MCAP file, unpacked [bytes]; rosbag2 begins a
chunk every 768 KiB."""
_MOST_RATIO = 200
"""Largest accepted ratio of unpacked to compressed size of a file compressed as a whole."""


def _bound_rosbags() -> None:
    """Replace the functions with which rosbags unpacks by functions with limits.

    Otherwise a small damaged or hostile file could unpack to any size, and fill the memory.
    """
    table: dict[str, Any] = storage_mcap.DECOMPRESSORS
    table["zstd"] = lambda data, size: _chunk(zstd.ZstdDecompressor(), data, size)
    table["lz4"] = lambda data, size: _chunk(lz4.frame.LZ4FrameDecompressor(), data, size)
    reader: Any = rosbag2_reader
    reader.zstd = SimpleNamespace(open=_BoundedFile, decompress=_message)


def _chunk(decompressor: Any, data: bytes, size: int) -> bytes:
    """Unpack a chunk; refuse more than its stated ``size`` or than ``MOST_CHUNK`` bytes."""
    if size > MOST_CHUNK:
        raise ValueError(f"a chunk unpacks to {size} bytes; must be at most {MOST_CHUNK}")
    unpacked: bytes = decompressor.decompress(data, max_length=size + 1)
    if len(unpacked) > size:
        raise ValueError(f"a chunk unpacks to more than the {size} bytes that it states")
    return unpacked


def _message(data: bytes) -> bytes:
    """Unpack a message to at most ``MOST_CHUNK`` bytes."""
    unpacked = zstd.ZstdDecompressor().decompress(data, max_length=MOST_CHUNK + 1)
    if len(unpacked) > MOST_CHUNK:
        raise ValueError(f"a message unpacks to more than {MOST_CHUNK} bytes")
    return unpacked


class _BoundedFile(zstd.ZstdFile):
    """Compressed file, open for reading; its unpacked size is limited."""

    def __init__(self, file: BinaryIO, mode: Literal["rb"]) -> None:
        super().__init__(file, mode)
        self._left = self._most = MOST_CHUNK + _MOST_RATIO * os.fstat(file.fileno()).st_size

    def read(self, size: int | None = -1) -> bytes:
        """Read and unpack up to ``size`` bytes; None or negative: all.

        Raises
        ------
        ValueError
            The file unpacks to more than the limit.
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


_bound_rosbags()


class BagTopic(NamedTuple):
    """Topic of a bag."""

    type: str
    messages: int
    """Number of messages."""
    qos: Qos | None
    """QoS profile of the topic's first publisher; None if the bag does not have it."""


class Message(NamedTuple):
    """Message of a bag."""

    topic: str
    time: int
    """Receive time [ns]."""
    data: bytes
    """Serialised message (CDR)."""


def _match_by_name(reader: DirectoryReader) -> None:
    """Let a reader match topics in a bag's metadata and files by name and type only.

    rosbags also compares QoS and type hashes, and skips the messages of a topic for which these
    differ. They differ after a conversion, or if a topic had several publishers.
    """
    named = {
        (connection.topic, connection.msgtype): connection for connection in reader.connections
    }
    storages: list[Any] = reader.storages
    for storage in storages:
        storage.connections = [
            connection._replace(ext=named_match.ext, digest=named_match.digest)
            if (named_match := named.get((connection.topic, connection.msgtype)))
            else connection
            for connection in storage.connections
        ]


def _reason(error: Exception) -> str:
    """Return the text of a reader's error; if it has none, the name of its class."""
    if isinstance(error, MemoryError):
        return "it states a size that exceeds the memory"
    return shortened(str(error)) or type(error).__name__


class Bag:
    """Bag of ``rosbag2`` (MCAP or SQLite), open for reading; a context manager.

    The readable part of an unfinished bag is read.

    Parameters
    ----------
    path
        Folder of the bag, or one of its files.

    Raises
    ------
    RecordingError
        There is no bag, or it cannot be read; the methods raise it, too.
    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        self.complete = True
        """True if the writer finished the bag."""
        self._reader: Any = self._open()
        self.topics: dict[str, BagTopic] = {}
        for connection in self._reader.connections:
            qos = next(iter(connection.ext.offered_qos_profiles), None)
            before = self.topics.get(connection.topic)
            if before is not None and before.type != connection.msgtype:
                raise RecordingError(
                    f"{self.path}: {connection.topic} has two types, {before.type} and "
                    f"{connection.msgtype}"
                )
            count = connection.msgcount + (before.messages if before else 0)
            self.topics[connection.topic] = BagTopic(connection.msgtype, count, qos)

    def __enter__(self) -> Bag:
        return self

    def __exit__(self, *_: object) -> None:
        self._reader.close()

    @property
    def count(self) -> int:
        """Number of messages."""
        return sum(topic.messages for topic in self.topics.values())

    @property
    def span(self) -> tuple[int, int]:
        """Times of the first and the last message [ns]; both 0 without messages."""
        stored = self._metadata
        return (stored.start_time, stored.end_time - 1) if stored.message_count else (0, 0)

    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        """Yield the messages of some topics, in the order of their receive times."""
        wanted = [
            connection for connection in self._reader.connections if connection.topic in topics
        ]
        if not wanted:
            return
        messages = self._reader.messages(wanted)
        while True:
            try:
                connection, time, data = next(messages)
            except StopIteration:
                return
            except Exception as error:  # rosbags may raise any error for a damaged file
                raise RecordingError(f"the bag {self.path} is damaged: {_reason(error)}") from error
            yield Message(connection.topic, time, data)

    @property
    def _metadata(self) -> Any:
        """Object of rosbags that has counts and times: a single file's metadata, or the reader."""
        reader = self._reader
        return reader.metadata if isinstance(reader, McapReader) else reader

    def _open(self) -> Any:
        """Open the bag with rosbags; complete the end of an unfinished file while reading."""
        path = self._file()
        try:
            if path.is_dir():
                read_yaml_file(path / METADATA)  # refuses huge content, which rosbags would read
            torn = path.suffix == ".mcap" and not is_finished(path)
            if path.suffix == ".mcap" and path.open("rb").read(len(MAGIC)) != MAGIC:
                raise ValueError("it does not begin like MCAP")
            reader: Any = McapReader(CompletedFile(path)) if torn else Reader(path)  # type: ignore[arg-type]
            self.complete = self.complete and not torn
            reader.open()
            if isinstance(reader, Reader) and isinstance(reader.storage, DirectoryReader):
                _match_by_name(reader.storage)
        except Exception as error:  # as above
            raise RecordingError(
                f"{self.path} is not a ROS 2 bag, or is damaged: {_reason(error)}"
            ) from error
        return reader

    def _file(self) -> Path:
        """Return the path to read: the folder, or the only file of an unfinished bag."""
        path, cannot = self.path, f"cannot read the bag {self.path}: "
        if not path.exists():
            raise RecordingError(cannot + "no such folder or file")
        if path.is_file():
            if path.suffix not in (".mcap", ".db3"):
                raise RecordingError(
                    f"{cannot}must be a folder written by rosbag2, or end in .mcap or .db3"
                )
            return path
        try:
            for candidate in (path, *path.glob("*")):
                check_regular(candidate)
        except OSError as error:
            raise RecordingError(f"{cannot}{error.filename}: {error.strerror}") from error
        files = sorted([*path.glob("*.mcap"), *path.glob("*.db3")])
        # The metadata file exists from the beginning, but has counts only at the end.
        finished = len(files) != 1 or files[0].suffix != ".mcap" or is_finished(files[0])
        if (path / METADATA).is_file() and finished:
            return path
        if not files:
            raise RecordingError(cannot + f"the folder has no {METADATA}, no .mcap and no .db3")
        if len(files) > 1:
            raise RecordingError(
                cannot
                + f"it has no {METADATA} and several files; name one of "
                + ", ".join(file.name for file in files)
            )
        self.complete = False
        return files[0]


def choose_namespace(bag: Bag, wanted: str | None) -> str:
    """Return the namespace of the drive to import.

    Raises
    ------
    InputError
        The namespace does not exist, or none was given and there are several.
    RecordingError
        The bag has no drive.
    """
    there = contract.drive_namespaces((name, topic.type) for name, topic in bag.topics.items())
    if wanted is None and len(there) == 1:
        return there[0]
    if wanted is not None and (named := "/" + wanted.strip("/")) in there:
        return named
    if not there:
        raise RecordingError(
            f"{bag.path} has no topics of a drive: none of "
            + ", ".join(f"{kind.name} ({kind.type_name})" for kind in contract.OF_A_DRIVE)
            + f", in any namespace; it has {_listed(bag)}"
        )
    if wanted is None:
        raise InputError(
            f"{bag.path} has several drives; choose one with --namespace: {', '.join(there)}"
        )
    raise InputError(
        f"--namespace {wanted}: {bag.path} has no drive there; it has drives in {', '.join(there)}"
    )


def _listed(bag: Bag) -> str:
    """Return a text with names and types of a bag's first 20 topics, for a message."""
    there = [f"{name} ({topic.type})" for name, topic in sorted(bag.topics.items())]
    return ", ".join(there[:20] + ["..."] * (len(there) > 20)) or "no topics at all"
