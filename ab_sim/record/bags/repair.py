"""Repair of a bag without an end, whose writer was killed or whose machine failed."""

from __future__ import annotations

import os
import shutil
import tempfile
from pathlib import Path
from typing import NamedTuple

import psutil

from ab_sim.base.errors import RecordingError
from ab_sim.base.files import check_regular, is_being_written
from ab_sim.base.presentation import CountProgress
from ab_sim.record.bags.reader import Bag
from ab_sim.record.bags.unfinished_bag import (
    METADATA,
    is_finished,
    is_unfinished,
    torn_bytes,
    written_by,
)
from ab_sim.record.bags.writer import BagWriter

_LIBRARY = "rosbags"
_UNFINISHED = ".repairing-"
_PROGRESS_EVERY = 1000  # messages


class BagRepair(NamedTuple):
    """Result of the repair of a bag."""

    messages: int
    """Number of messages in the repaired bag."""
    lost: int
    """Number of unreadable bytes at the end of the file."""


def repair_bag(
    path: Path | str, progress: CountProgress = lambda done, of: None
) -> BagRepair | None:
    """Repair a bag that has no end; all complete messages are kept, bit for bit.

    A new file is written next to the old one, and replaces it when it is complete. Until then, and
    after an error, the old file is unchanged.

    Parameters
    ----------
    path
        Path of the bag's folder, or of the .mcap file in it.
    progress
        Function that is called with the number of messages done, and of all.

    Returns
    -------
    BagRepair | None
        Result of the repair; None if the bag was already complete.

    Raises
    ------
    RecordingError
        There is no bag, it was not written by ab_sim, it is still being written, or the new file
        cannot be written.
    """
    file, cannot = _file_of(Path(path)), f"cannot repair the bag {path}: "
    try:
        if is_being_written(file):
            raise RecordingError(
                f"{cannot}it is still being written; end the recorder, which completes it"
            )
        metadata = file.parent / METADATA
        has_metadata = metadata.is_file()
        is_folder = Path(path).is_dir()
        if is_finished(file) and not (is_unfinished(metadata) if has_metadata else is_folder):
            return None
        library = written_by(file)
        if not library.startswith(_LIBRARY):
            raise RecordingError(
                f"{cannot}it was written by {library[:40]!r}, and ab-sim cannot preserve all "
                "records of other writers; use `mcap recover`, then `ros2 bag reindex`"
            )
        _remove_leftovers(file.parent)
        prefix = f"{_UNFINISHED}{os.getpid()}-"
        with tempfile.TemporaryDirectory(dir=file.parent, prefix=prefix) as folder:
            repaired = Path(folder, "bag", file.name)
            messages = _copy(file, repaired, progress)
            repaired.chmod(file.stat().st_mode)
            lost = torn_bytes(file)
            repaired.replace(file)
            # After a failure before this line, the metadata are still those of an unfinished bag,
            # so that the repair can be repeated.
            if has_metadata or is_folder:
                (repaired.parent / METADATA).replace(metadata)
    except OSError as error:
        raise RecordingError(f"{cannot}{error.strerror}; nothing has changed") from error
    return BagRepair(messages, lost)


def _remove_leftovers(folder: Path) -> None:
    """Remove the temporary folders of killed repairs from a bag's folder."""
    for leftover in folder.glob(f"{_UNFINISHED}*"):
        number = leftover.name.removeprefix(_UNFINISHED).partition("-")[0]
        if number.isdecimal() and not psutil.pid_exists(int(number)):
            shutil.rmtree(leftover, ignore_errors=True)


def _file_of(path: Path) -> Path:
    """Return the MCAP file of a bag from the path of the bag's folder or of the file."""
    try:
        check_regular(path)
    except OSError as error:
        raise RecordingError(f"cannot repair the bag {path}: {error.strerror}") from error
    files = [path] if path.is_file() else sorted(path.glob("*.mcap"))
    if len(files) != 1 or files[0].suffix != ".mcap":
        raise RecordingError(
            f"cannot repair the bag {path}: must be a folder with one .mcap file, or that file"
        )
    return files[0]


def _copy(file: Path, repaired: Path, progress: CountProgress) -> int:
    """Copy the readable messages of a file to a new bag, and return the number of messages."""
    with Bag(file) as torn, BagWriter(repaired.parent, repaired.name) as bag:
        for name, topic in torn.topics.items():
            bag.topic(name, topic.type, topic.qos)
        for done, message in enumerate(torn.messages(torn.topics)):
            bag.write(message.topic, message.time, message.data)
            if done % _PROGRESS_EVERY == 0:
                progress(done, torn.count)
        return bag.messages
