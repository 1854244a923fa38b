"""Files of a recorder: Rerun files, one after the other, and a bag."""

from __future__ import annotations

import contextlib
import functools
import math
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rclpy.impl.rcutils_logger import RcutilsLogger
from rclpy.node import Node

from ab_msgs_py import MalformedMessage, topics
from ab_sim.base.errors import RecordingError
from ab_sim.base.sample_columns import STEP, TIME
from ab_sim.nodes.inbox import Inbox
from ab_sim.record.recording import SHOWN_PERIOD, Recording
from ab_sim.show.viewing import IN_TRANSIT, Viewer


class BagRecorder:
    """Records messages: receives them in a node's callbacks, and writes them from another thread.

    Messages are stored as received bytes, each with its reception time on the system clock. If the
    disk is slow, the oldest messages are dropped, as in `Inbox`.

    Parameters
    ----------
    node
        Subscriber; the topics are those of its namespace.
    path
        Folder of the bag; if it exists, ``-2`` and so on is added to its name.
    length
        Number of messages of each topic that are kept while the disk is slow.

    Raises
    ------
    RecordingError
        The bag cannot be written; the methods raise it, too.
    """

    def __init__(self, node: Node, path: Path, length: int) -> None:
        # A recorder without a bag starts sooner without rosbags, which takes 0.2 s to import.
        from ab_sim.record.bags.contract import offered_qos
        from ab_sim.record.bags.writer import BagWriter

        self.bag = BagWriter(_free(path))
        recorded = [topic for topic in topics.ALL if topic.type is not None]
        names = {topic.name: node.resolve_topic_name(topic.name) for topic in recorded}
        self._inbox = Inbox(names.values(), length)
        for topic in recorded:
            self.bag.topic(names[topic.name], topic.type_name, offered_qos(topic.qos))
            topic.bytes_of(node, functools.partial(self._put, names[topic.name]))

    @property
    def dropped(self) -> int:
        """Number of dropped messages."""
        return sum(self._inbox.dropped.values())

    def write(self) -> None:
        """Write all received messages to the file."""
        for topic, (received, message) in self._inbox.take():
            self.bag.write(topic, received, message)
        self.bag.flush()

    def close(self) -> None:
        """Complete the bag, after the last ``write``."""
        self.bag.close()

    def values(self) -> dict[str, Any]:
        """Return values for the diagnostics."""
        return {
            "bag": self.bag.path,
            "bag messages written": self.bag.messages_written,
            "bag messages dropped": self.dropped,
        }

    def _put(self, topic: str, message: bytes) -> None:
        """Queue a serialised message with the present time as its receive time [ns]."""
        # The middleware knows the time more exactly, but under EventsExecutor a callback with
        # message info makes rclpy 9.1 end with a SystemError.
        self._inbox.put(topic, (time.time_ns(), message))


def _free(path: Path) -> Path:
    """Return a path that does not exist: this one, or one with a number added to its name."""
    free, count = path, 1
    while free.exists():
        # A recording is never overwritten.
        count += 1
        free = path.with_name(f"{path.name}-{count}")
    return free


REAL_TIME_FACTOR, COMMANDS = _SCALARS = ("real_time_factor", "commands_received")
"""Names of the scalars that a recorder writes."""
RETRY = 1.0
"""Time between two attempts to begin a file [s]."""
_TAKING_TURNS = 20.0
"""Shortest time [s] between two new files while several drives publish.

Their steps alternate, so that steps decrease at almost every block, and each would begin a file.
DDS takes this time to notice that a killed drive has gone.
"""


class RecordedFiles:
    """Files of a recorder, with decimated copies for a viewer.

    A new file begins when the drive is reset or restarted, and when the present file cannot be
    written any longer.

    Parameters
    ----------
    path
        First file; later files get numbers, and also the first one if it exists, because recordings
        are never overwritten. None: no files.
    viewer
        Viewer of the decimated copies; None: no copies.
    folder
        Folder for these copies.
    logger
        Logger for the names of files and for errors.
    drives
        Function that returns the number of publishers of vibration/block.
    decimated
        Selection of samples, as for `Recording`.
    """

    def __init__(
        self,
        path: Path | None,
        viewer: Viewer | None,
        folder: Path,
        logger: RcutilsLogger,
        drives: Callable[[], int],
        decimated: Mapping[str, Any],
    ) -> None:
        self._path, self._viewer, self._logger, self._decimated = path, viewer, logger, decimated
        self._shown_folder = folder
        self._drives, self._ran_back = drives, -math.inf
        self._number = 1
        self._description: Mapping[str, Any] | None = None
        self._recording: Recording | None = None
        self._shown: Recording | None = None  # decimated copy for the viewer
        self._shown_at = -math.inf
        self._shown_until: deque[float] = deque(maxlen=IN_TRANSIT)  # ends of the last batches [s]
        self._next: int | None = None  # expected step; None before the first block
        self._restarted = False  # True after a restart of the drive until the next block
        self._tried = 0.0
        self._time = 0.0  # time of the newest sample [s]
        self._states: dict[str, str] = {}
        self._standing: dict[tuple[str, str], str] = {}  # text by source and subject
        self._written = self._lost = 0  # in earlier files
        self._left_out = self._refused = 0  # in earlier files
        self.missing = 0
        """Number of missing steps: between received steps, and before the first one of a reset."""
        self.trouble = ""
        """Reason why no file can be written; empty if one can."""
        self.why_lost = ""
        """Reason for the last loss of samples."""

    @property
    def path(self) -> str:
        """Path of the present file; empty if there is none."""
        return "" if self._recording is None else str(self._recording.path)

    @property
    def written(self) -> int:
        """Number of samples in files."""
        return self._written + (self._recording.rows_written if self._recording else 0)

    @property
    def lost(self) -> int:
        """Number of received samples that are in no file."""
        return self._lost

    @property
    def left_out(self) -> int:
        """Number of samples that decimation omitted."""
        return self._left_out + (self._recording.left_out if self._recording else 0)

    @property
    def refused(self) -> int:
        """Number of events not recorded at full rate, because there were too many events."""
        return self._refused + (self._recording.stretches_refused if self._recording else 0)

    def begin(self, description: Mapping[str, Any]) -> None:
        """Begin a file when a drive has published its first description, or one after a restart."""
        if self._path is None:
            return
        self.close()
        self._restarted = self._description is not None
        self._description = description
        self._open()

    def block(self, channels: Sequence[str], samples: NDArray[np.float64]) -> None:
        """Write a block of at least one sample.

        Parameters
        ----------
        channels
            Names of the channels.
        samples
            Samples, of shape (samples, channels).

        Raises
        ------
        MalformedMessage
            Steps are not integers or do not increase, a time is not finite, or steps decrease from
            block to block because several drives publish.
        """
        if self._description is None:
            return
        steps = samples[:, STEP]
        if not np.isfinite(samples[:, [STEP, TIME]]).all():
            raise MalformedMessage("vibration/block: step and time must be finite")
        if (steps != np.rint(steps)).any() or (np.diff(steps) <= 0).any() or steps[0] < 0:
            raise MalformedMessage("vibration/block: steps must be whole numbers that increase")
        first, last = int(steps[0]), int(steps[-1])
        expected = first if self._next is None else self._next
        if self._restarted and first != expected:  # old blocks may arrive after the description
            expected = 0
        elif first < expected:
            # The drive was reset. A new file begins, because steps in a recording must increase.
            now = time.monotonic()
            if now - self._ran_back < _TAKING_TURNS and (drives := self._drives()) > 1:
                raise MalformedMessage(
                    f"vibration/block: {drives} drives publish it, and blocks whose steps decrease "
                    "are omitted: end all drives but one, or give each a namespace"
                )
            self._ran_back = now
            self._time = samples[0, TIME]
            self.close()
            self._open()
            expected = 0
        self._restarted = False
        self.missing += last + 1 - expected - len(samples)
        self._next, self._time = last + 1, samples[-1, TIME]
        if self._recording is None:
            self._lost += len(samples)
        else:
            self._write(lambda recording: recording.block(channels, samples))

    def scalar(self, name: str, time: float, value: float) -> None:
        """Write a scalar; see `Recording.scalar`."""
        self._write(lambda recording: recording.scalar(name, time, value))

    def event(self, time: float, text: str, level: str, source: str) -> None:
        """Write an event; see `Recording.event`."""
        self._write(lambda recording: recording.event(time, text, level, source))

    def state(self, name: str, time: float, state: str) -> None:
        """Write a named state if it has changed; further files begin with the present state."""
        if self._states.get(name) != state:
            self._states[name] = state
            self._write(lambda recording: recording.state(name, time, state))

    def standing(self, about: str, time: float, text: str, source: str) -> None:
        """Write an event that holds until it changes; further files begin with the present one.

        Parameters
        ----------
        about
            Subject; a new text on the same subject replaces the former one.
        time
            Time of the event [s].
        text
            Text of the event.
        source
            Source of the event.
        """
        if self._standing.get((source, about)) != text:
            self._standing[source, about] = text
            self.event(time, text, "INFO", source)

    def flush(self) -> None:
        """Write buffered samples to the file; if there is no file, try to open one periodically."""
        self._write_to_file(lambda recording: recording.flush(pictures=False))
        self._flush_shown()
        waiting = self._description is not None and self._recording is None
        if waiting and time.monotonic() - self._tried >= RETRY:
            self._open()

    def conclude_shown(self) -> None:
        """Show the final values at the end of a drive, which may start again."""
        if self._shown is not None:
            self._show(lambda recording: recording.conclude())

    def close(self) -> None:
        """Close the present file, if one is open."""
        self._write(lambda recording: recording.close())
        if (recording := self._recording) is not None:
            self._leave(recording)

    @property
    def _numbered(self) -> Path:
        """Path of the next file; from the second on, the name has a number."""
        assert self._path is not None
        number = f"-{self._number}" if self._number > 1 else ""
        return self._path.with_stem(f"{self._path.stem}{number}")

    def _open(self) -> None:
        """Begin the next file; if it cannot be written, ``flush`` tries again."""
        assert self._description is not None
        self._tried = time.monotonic()
        while (path := self._numbered).exists():
            self._number += 1
        with contextlib.suppress(OSError):  # the next statement reports the error
            path.parent.mkdir(parents=True, exist_ok=True)
        try:
            self._recording = Recording(path, description=self._description, **self._decimated)
        except RecordingError as error:
            self._complain(str(error))
            return
        self.trouble = ""
        for name, state in self._states.items():
            self._recording.state(name, self._time, state)
        for (source, _), text in self._standing.items():
            self._recording.event(self._time, text, "INFO", source)
        self._logger.info(f"recording to {path}")
        self._open_shown(path.name)

    def _open_shown(self, name: str) -> None:
        """Begin the viewer's copy of a file; if it cannot be written, the viewer gets no data."""
        if self._viewer is None:
            return
        assert self._description is not None
        path = self._shown_folder / name
        try:
            recording = Recording(path, description=self._description, is_shown=True)
            if channels := self._description.get("channels"):
                recording.lay_out(channels, _SCALARS)
        except RecordingError as error:
            self._logger.warning(f"the viewer gets no data: {error}")
            return
        for name, state in self._states.items():
            recording.state(name, self._time, state)
        self._shown = recording
        self._shown_until.clear()
        self._viewer.feed(path)

    def _write(self, write: Callable[[Recording], None]) -> None:
        """Apply a function that writes to the file and to the viewer's copy."""
        self._write_to_file(write)
        self._show(write)

    def _show(self, write: Callable[[Recording], None]) -> None:
        """Apply a function that writes to the viewer's copy; give the copy up if it fails."""
        if self._shown is None:
            return
        try:
            write(self._shown)
        except RecordingError as error:
            if not self._shown.failed:
                raise
            self._logger.warning(f"the viewer gets no more data: {error}")
            self._shown = None

    def _flush_shown(self) -> None:
        """Send collected data to the viewer, unless the viewer is still busy with earlier data."""
        if self._shown is None or self._viewer is None:
            return
        interval = self._viewer.interval(self._shown.id, self._shown_until)
        until = self._shown_until[-1] if self._shown_until else -math.inf
        if self._time > until + 2 * SHOWN_PERIOD and time.monotonic() - self._shown_at < interval:
            return
        self._show(lambda recording: recording.flush())
        self._shown_at = time.monotonic()
        self._shown_until.append(self._time - 2 * SHOWN_PERIOD)

    def _write_to_file(self, write: Callable[[Recording], None]) -> None:
        """Apply a function that writes to the file; leave the file if it fails."""
        if (recording := self._recording) is None:
            return
        try:
            write(recording)
        except RecordingError as error:
            if not recording.failed:
                raise
            self._complain(str(error))
            self._leave(recording)

    def _leave(self, recording: Recording) -> None:
        """Add the counts of a finished file to the totals, and finish the viewer's copy."""
        self._recording = None
        self._written += recording.rows_written
        self._left_out += recording.left_out
        self._refused += recording.stretches_refused
        lost = recording.rows - recording.rows_written - recording.left_out
        self._lost += lost
        self._logger.info(
            f"wrote {recording.path}: {recording.rows_written} samples, {recording.missing} missing"
            + (f", {lost} lost" if lost else "")
        )
        if self._viewer is not None and self._shown is not None:
            self._shown.close()
            self._viewer.finish(self._shown.path)
            self._shown = None

    def _complain(self, trouble: str) -> None:
        """Log why no file can be written, once for each reason."""
        if trouble != self.trouble:
            self._logger.error(f"{trouble}; trying another file every {RETRY:g} s")
        self.trouble = self.why_lost = trouble
