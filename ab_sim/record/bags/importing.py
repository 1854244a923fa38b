"""Import of a bag as recordings, as a live recorder would have written them."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ab_msgs_py import Block, Health, Level, Topic, topics
from ab_msgs_py.samples import Event
from ab_msgs_py.topics import BLOCK, CLOCK, DESCRIPTION
from ab_sim.base.errors import RecordingError
from ab_sim.base.presentation import CountProgress
from ab_sim.base.sample_columns import STEP, TIME
from ab_sim.record.bags import contract
from ab_sim.record.bags.contract import DECIMATED, NOTE, NUMBER, IgnoredMessages, decoded
from ab_sim.record.bags.foreign_bag import ForeignBag
from ab_sim.record.bags.reader import Bag, Message, choose_namespace
from ab_sim.record.recording import Recording, drawable

_LEFT_OUT = contract.DECIMATED_CHANNELS.index("left_out")


class BagConverter(IgnoredMessages):
    """Converter of messages to recordings; a context manager that closes the last recording.

    Parameters
    ----------
    namespace
        Namespace of the drive.
    kinds
        Topics of the messages, by full name.
    out
        File of the first recording.

    Raises
    ------
    RecordingError
        A recording cannot be written; `write` raises it, too.
    """

    def __init__(self, namespace: str, kinds: dict[str, Topic], out: Path) -> None:
        super().__init__()
        self.files: list[Path] = []
        self.rows = self.missing = 0
        self._namespace, self._kinds, self._out = namespace, kinds, out
        self._recording: Recording | None = None
        self._is_decimated = False  # whether the recording consists of decimated blocks
        self._description: dict[str, Any] = {}
        self._time = 0  # newest time [ns]
        self._levels: dict[str, Level] = {}
        self._left_out = np.empty((0, len(contract.DECIMATED_CHANNELS)))  # rule of the next block
        self._pending: list[tuple[Any, ...]] = []  # entries before the first sample
        self._write: dict[Topic, Callable[[Any], None]] = {
            topics.DESCRIPTION: self._describe,
            DECIMATED: self._decimated,
            topics.BLOCK: self._block,
            topics.CLOCK: self._clock,
            topics.COMMAND: self._command,
            topics.DIAGNOSTICS: self._health,
            topics.FAULTS: self._faults,
            topics.PROFILE_STATUS: self._status,
            topics.EVENTS: self._event,
        }

    def __enter__(self) -> BagConverter:
        return self

    def __exit__(self, *_: object) -> None:
        self._close()

    def write(self, message: Message) -> None:
        """Convert the next message; count it as ignored if it is invalid."""
        topic = self._kinds[message.topic]
        if topic not in self._write and topic is not NUMBER:
            return
        try:
            sample = topic.sample(decoded(message.data, topic.type_name))
            if topic is NUMBER:
                self._scalar(message.topic.rpartition("/")[2], sample)
            else:
                self._write[topic](sample)
        except (ValueError, RecursionError) as error:
            self.ignore(message.topic, error)

    def _describe(self, description: dict[str, Any]) -> None:
        """Keep a drive's description; end the recording if it differs from the last one."""
        if description != self._description:
            self._close()
            self._description = description

    def _decimated(self, block: Block) -> None:
        """Check and keep a block that describes the decimation of the next block of samples."""
        channels, rule = _checked_block(block)
        if channels != contract.DECIMATED_CHANNELS:
            raise ValueError(f"must have the channels {contract.DECIMATED_CHANNELS}")
        _, _, counts, every, around = rule.T
        whole = (counts == np.rint(counts)).all() and (counts >= 0).all()
        if not (whole and (np.diff(counts) >= 0).all() and (every >= 1).all()
                and (around >= 0).all() and np.isfinite(rule).all()):  # fmt: skip
            raise ValueError(
                "left_out must be whole and not decrease, every at least 1, and around at least 0"
            )
        self._left_out = rule

    def _block(self, block: Block) -> None:
        """Write a block of samples; begin a recording if steps or drive begin again."""
        channels, samples = _checked_block(block)
        if not len(samples):
            return
        described = self._description.get("channels")
        if described is not None and list(channels) != described:
            raise ValueError(f"has channels {channels}; the drive's description has {described}")
        if self._recording is None or samples[0, STEP] <= self._recording.last_step:
            self._close()  # the drive was reset, and steps in a recording must increase
            self._open(channels)
        assert self._recording is not None
        left_out, self._left_out = self._left_out, self._left_out[:0]
        decimated = self._is_decimated and np.array_equal(left_out[:, STEP], samples[:, STEP])
        self._recording.block(channels, samples, left_out[:, _LEFT_OUT] if decimated else None)
        self._time = max(self._time, round(1e9 * samples[-1, TIME]))

    def _clock(self, time: int) -> None:
        self._time = time

    def _command(self, speed: float) -> None:
        self._scalar("commands_received", speed)

    def _health(self, entries: list[Health]) -> None:
        for health in entries:
            if not self._is_own(health.namespace):
                continue
            factor = float(health.values.get("real-time factor", "nan"))
            if math.isfinite(factor):
                self._scalar("real_time_factor", factor)
            if self._levels.get(health.node, Level.OK) is not health.level:
                level = "INFO" if health.level is Level.OK else health.level.name
                self._note(f"{health.node}: {health.message}", level, "diagnostics")
            self._levels[health.node] = health.level

    def _status(self, status: str) -> None:
        self._note(f"profile: {status}", "INFO", "profile")

    def _faults(self, faults: list[str]) -> None:
        text = f"faults: {', '.join(faults) or 'none'}"
        self._note(text, "WARN" if faults else "INFO", "faults")

    def _event(self, event: Event) -> None:
        noted = contract.logger_name(self._namespace, NOTE)
        if event.node.startswith(noted):
            source = event.node.removeprefix(noted)
            self._note(event.text, event.level, source, event.time)
        elif self._is_own("/" + event.node.rpartition(".")[0].replace(".", "/")):
            self._note(f"{event.node}: {event.text}", event.level, "log")

    def _is_own(self, namespace: str) -> bool:
        return (namespace or "/") == self._namespace

    def _scalar(self, name: str, value: float) -> None:
        self._put("scalar", name, self._time / 1e9, value)

    def _note(self, text: str, level: str, source: str, time: int | None = None) -> None:
        self._put("event", (self._time if time is None else time) / 1e9, text, level, source)

    def _put(self, what: str, *noted: Any) -> None:
        if self._recording is None:
            self._pending.append((what, *noted))
        else:
            getattr(self._recording, what)(*noted)

    def _open(self, channels: tuple[str, ...]) -> None:
        """Begin the next recording; write the entries that came before the first sample."""
        path, count = self._out, 1
        while path in self.files or (count > 1 and path.exists()):
            count += 1
            path = self._out.with_stem(f"{self._out.stem}-{count}")
        self.files.append(path)
        drawn = drawable(self._description, channels)
        self._is_decimated = len(self._left_out) > 0
        rule: dict[str, Any] = {}
        if self._is_decimated:
            every, around = self._left_out[0, 3:].tolist()
            rule = {"every": int(every), "around": around, "decimated": True}
        self._recording = Recording(path, description=self._description, drawn=drawn, **rule)
        pending, self._pending = self._pending, []
        for what, *noted in pending:
            self._put(what, *noted)

    def _close(self) -> None:
        if self._recording is not None:
            self._recording.close()
            self.rows += self._recording.rows_written
            self.missing += self._recording.missing
            self._recording = None


def _checked_block(block: Block) -> tuple[tuple[str, ...], np.ndarray]:
    """Return the channels and samples of a block.

    Raises
    ------
    ValueError
        Channels or times are not valid for `Recording`.
    """
    channels, samples = block.channels, block.samples
    if channels[:2] != ("step", "time") or len(set(channels)) < len(channels):
        raise ValueError(f"channels must begin with step, time and differ: {channels}")
    times = samples[:, TIME]
    if not np.isfinite(times).all() or (np.diff(times) < 0).any():
        raise ValueError("time must be finite, and not decrease from sample to sample")
    return channels, samples


_CHUNK = 1000  # rows


class ImportedBag(NamedTuple):
    """Result of the import of a bag."""

    files: list[Path]
    """Recordings; several if the drive was reset, or another drive published its description."""
    rows: int
    """Number of samples."""
    missing: int
    """Number of missing steps between the first and the last step."""
    ignored: dict[str, tuple[int, str]]
    """Number of unusable messages, and the error of the last one, by topic."""
    complete: bool
    """True if the bag was finished; if not, its readable part was used."""
    notes: list[str]
    """Notes on sensors whose last value is held until the next stamp, in a bag without blocks."""


def import_bag(
    path: Path | str,
    out: Path,
    namespace: str | None = None,
    progress: CountProgress = lambda done, of: None,
    rows_of: str | None = None,
) -> ImportedBag:
    """Convert a bag to recordings.

    With ``vibration/block``, the recordings are equal to those of a live recorder, to the bit.
    Without it, there is one recording, from ``vibration``, ``whirl``, ``imu/data_raw``,
    ``displacement``, joints and commands. It has a row for each stamp of the sensor with the most
    samples. Joints are interpolated; other values are the last ones received. If positions are
    unknown, the recording has no drawing.

    Parameters
    ----------
    path
        Path of the bag, see `Bag`.
    out
        .rrd file of the first recording; an existing one is replaced. Files of further recordings
        get the endings ``-2`` and so on, and replace no others.
    namespace
        Namespace of the drive; None: that of the only drive.
    progress
        Function that is called with the number of messages done, and of all.
    rows_of
        Channel of a sensor whose stamps give the rows instead, without blocks.

    Raises
    ------
    InputError
        The bag has no drive in the namespace, or several drives and no namespace was given.
    RecordingError
        The bag cannot be read or has no topics of a drive, or a recording cannot be written.
    """
    with Bag(path) as bag:
        prefix = choose_namespace(bag, namespace)
        kinds = _topics_to_read(bag, prefix)
        log = BagConverter(prefix, kinds, out)
        messages = sum(bag.topics[name].messages for name in kinds)
        if BLOCK.within(prefix) in kinds:
            # The description is converted first: if the bag's recorder started after the drive, the
            # description may follow samples.
            for first in islice(bag.messages({DESCRIPTION.within(prefix)}), 1):
                log.write(first)
            with log:
                for done, message in enumerate(bag.messages(kinds)):
                    log.write(message)
                    if done % _CHUNK == 0:
                        progress(done, messages)
            if not log.rows:
                raise RecordingError(
                    f"{path}: {BLOCK.within(prefix)} has no samples that can be used{log.summary}"
                )
            return ImportedBag(log.files, log.rows, log.missing, log.ignored, bag.complete, [])
        return _import_foreign(ForeignBag(bag, prefix, kinds, rows_of), bag, out)


def _topics_to_read(bag: Bag, namespace: str) -> dict[str, Topic]:
    """Return the topics to read, by full name.

    Raises
    ------
    RecordingError
        A topic of the bag has a name of the contract, but another type.
    """
    wanted = {kind.within(namespace): kind for kind in topics.ALL}
    clock = f"{namespace.rstrip('/')}/clock"
    if clock in bag.topics:  # with two drives, each has its own clock
        del wanted[CLOCK.name]
        wanted[clock] = CLOCK
    numbers = NUMBER.within(namespace)
    for name, topic in bag.topics.items():
        is_number = name.startswith(numbers) and name.removeprefix(numbers).isidentifier()
        if is_number and topic.type == NUMBER.type_name:
            wanted[name] = NUMBER
        if further := contract.further_sensor(name, namespace):
            wanted[name] = further
    wanted[DECIMATED.within(namespace)] = DECIMATED
    topics_present = {name: kind for name, kind in wanted.items() if name in bag.topics}
    for name, kind in topics_present.items():
        if bag.topics[name].type != kind.type_name:
            raise RecordingError(
                f"{bag.path}: {name} is of type {bag.topics[name].type}; expected {kind.type_name}"
            )
    return topics_present


def _import_foreign(table: ForeignBag, bag: Bag, out: Path) -> ImportedBag:
    """Write the recording of a bag without blocks."""
    if not len(table.samples):
        raise RecordingError(f"{bag.path}: there is no message that can be used{table.summary}")
    with Recording(out, description=table.description, drawn=table.drawn) as recording:
        for first in range(0, len(table.samples), _CHUNK):
            recording.block(table.channels, table.samples[first : first + _CHUNK])
    return ImportedBag(
        [out], recording.rows, recording.missing, table.ignored, bag.complete, table.notes
    )
