"""Mending a torn bag: its writer was killed, or the machine went down."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from ab_sim.bags.metadata import METADATA, is_of_beginning
from ab_sim.bags.reader import Bag
from ab_sim.bags.unfinished_bag import is_being_written, is_finished, torn_bytes, written_by
from ab_sim.bags.writer import BagWriter
from ab_sim.errors import RecordingError

_LIBRARY = "rosbags"
_TOLD = 1000  # messages between two tellings


class Mending(NamedTuple):
    """What became of a bag."""

    messages: int
    """How many it has."""
    lost: int
    """Bytes at its end of which nothing could be read."""


def mend_bag(
    path: Path | str, progress: Callable[[int, int], None] = lambda done, of: None
) -> Mending | None:
    """Give a torn bag the end that it should have; what is whole in it stays, to the bit.

    A new file is written beside the old one and takes its place when it is complete; until then,
    and after an error, the old one is as it was.

    Args:
        path: of the bag's folder, or of the .mcap file in it.
        progress: is told how many messages are done, of how many.

    Returns:
        None where there is nothing to mend.

    Raises:
        RecordingError: there is no bag, it is none of ours, it is still being written, or the new
            one cannot be written.
    """
    file, cannot = _file_of(Path(path)), f"cannot mend the bag {path}: "
    try:
        if is_being_written(file):
            raise RecordingError(
                f"{cannot}it is still being written; end the recorder, which completes it"
            )
        metadata = file.parent / METADATA
        beside = metadata.is_file()
        if is_finished(file) and not (is_of_beginning(metadata) if beside else Path(path).is_dir()):
            return None
        library = written_by(file)
        if not library.startswith(_LIBRARY):
            raise RecordingError(
                f"{cannot}it was written by {library[:40]!r} and not by ab-sim, which does not "
                "know all that others put beside messages; use `mcap recover`, then `ros2 bag "
                "reindex`"
            )
        with tempfile.TemporaryDirectory(dir=file.parent, prefix=".mending-") as room:
            made = Path(room, "bag", file.name)
            messages = _copy(file, made, progress)
            made.chmod(file.stat().st_mode)
            lost = torn_bytes(file)
            made.replace(file)
            # Until this line, too, it says that it is of an unfinished bag, which is mended again.
            if beside or Path(path).is_dir():
                (made.parent / METADATA).replace(metadata)
    except OSError as error:
        raise RecordingError(f"{cannot}{error.strerror}; nothing has changed") from error
    return Mending(messages, lost)


def _file_of(path: Path) -> Path:
    files = [path] if path.is_file() else sorted(path.glob("*.mcap"))
    if len(files) != 1 or files[0].suffix != ".mcap":
        raise RecordingError(
            f"cannot mend the bag {path}: must be a folder with one .mcap file in it, or that file"
        )
    return files[0]


def _copy(file: Path, made: Path, progress: Callable[[int, int], None]) -> int:
    """Write what can be read of a file to another one, in a bag of its own; returns messages."""
    with Bag(file) as torn, BagWriter(made.parent, made.name) as bag:
        for name, topic in torn.topics.items():
            bag.topic(name, topic.type, topic.qos)
        for done, message in enumerate(torn.messages(torn.topics)):
            bag.write(message.topic, message.time, message.data)
            if done % _TOLD == 0:
                progress(done, torn.count)
        return bag.messages
