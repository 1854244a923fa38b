"""What a recorder would have written, had it listened to the messages of a bag."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from ab_sim.bags import contract
from ab_sim.bags.contract import NOTE, NUMBER, TopicKind
from ab_sim.bags.messages import LEVELS, decoded, nanoseconds_of
from ab_sim.bags.reader import Message
from ab_sim.recording import Recording, drawable

_HEALTH = {b"\x00": "INFO", b"\x01": "WARN", b"\x02": "ERROR"}


class Ignored:
    """Messages that could not be used, by topic: how many, and what was wrong with the last."""

    def __init__(self) -> None:
        self.ignored: dict[str, tuple[int, str]] = {}

    def ignore(self, topic: str, reason: object) -> None:
        """Count one."""
        self.ignored[topic] = self.ignored.get(topic, (0, ""))[0] + 1, str(reason)

    @property
    def why(self) -> str:
        """For the end of an error's text."""
        return "".join(
            f"; ignored {count} messages on {topic}, the last one: {reason}"
            for topic, (count, reason) in self.ignored.items()
        )


class DriveLog(Ignored):
    """Writes recordings; use it as a context, which closes the last one.

    Args:
        namespace: the drive's.
        kinds: of the messages that will come, by the full names of their topics.
        out: the first recording's file.

    Raises:
        RecordingError: a recording cannot be written. So does `write`.
    """

    def __init__(self, namespace: str, kinds: dict[str, TopicKind], out: Path) -> None:
        super().__init__()
        self.files: list[Path] = []
        self.rows = self.missing = 0
        self._namespace, self._kinds, self._out = namespace, kinds, out
        self._recording: Recording | None = None
        self._is_thinned = False  # what the recording is made of
        self._description: dict[str, Any] = {}
        self._time = 0  # newest one heard of [ns]
        self._levels: dict[str, str] = {}
        self._left_out = np.empty((0, len(contract.THINNED_CHANNELS)))  # of the next block
        self._pending: list[tuple[Any, ...]] = []  # noted before there were samples
        self._write = {
            contract.DESCRIPTION: self._describe,
            contract.THINNED: self._thinned,
            contract.BLOCK: self._block,
            contract.CLOCK: self._clock,
            contract.COMMAND: self._command,
            contract.DIAGNOSTICS: self._health,
            contract.FAULTS: self._faults,
            contract.PROFILE_STATUS: self._status,
            contract.EVENTS: self._event,
        }

    def __enter__(self) -> DriveLog:
        return self

    def __exit__(self, *_: object) -> None:
        self._close()

    def write(self, message: Message) -> None:
        """Take the next message."""
        kind = self._kinds[message.topic]
        try:
            if kind is NUMBER:
                name = message.topic.rpartition("/")[2]
                self._scalar(name, float(decoded(message.data, kind.type).data))
            elif kind in self._write:
                self._write[kind](decoded(message.data, kind.type))
        except (ValueError, RecursionError) as error:
            self.ignore(message.topic, error)

    def _describe(self, message: Any) -> None:
        description = json.loads(message.data)
        if not isinstance(description, dict):
            raise ValueError("must be a JSON object")
        if description != self._description:
            self._close()
            self._description = description

    def _thinned(self, message: Any) -> None:
        channels, told = block_of(message)
        if channels != contract.THINNED_CHANNELS:
            raise ValueError(f"must have the channels {contract.THINNED_CHANNELS}")
        counts, every, around = told[:, 2], told[:, 3], told[:, 4]
        whole = (counts == np.rint(counts)).all() and (counts >= 0).all()
        if not (whole and (np.diff(counts) >= 0).all() and (every >= 1).all()
                and (around >= 0).all() and np.isfinite(told).all()):  # fmt: skip
            raise ValueError("counts must be whole and grow, every at least 1, around 0 or more")
        self._left_out = told

    def _block(self, message: Any) -> None:
        channels, samples = block_of(message)
        if not len(samples):
            return
        described = self._description.get("channels")
        if described is not None and list(channels) != described:
            raise ValueError(f"has the channels {channels}, the drive was said to have {described}")
        if self._recording is None or samples[0, 0] <= self._recording.last_step:
            self._close()  # the drive was reset, and a recording's steps only grow
            self._open(channels)
        assert self._recording is not None
        told, self._left_out = self._left_out, self._left_out[:0]
        thinned = self._is_thinned and np.array_equal(told[:, 0], samples[:, 0])
        self._recording.block(channels, samples, told[:, 2] if thinned else None)
        self._time = max(self._time, round(1e9 * samples[-1, 1]))

    def _clock(self, message: Any) -> None:
        self._time = nanoseconds_of(message.clock)

    def _command(self, message: Any) -> None:
        self._scalar("commands_received", float(message.data))

    def _health(self, message: Any) -> None:
        for status in message.status:
            node, _, task = status.name.partition(": ")
            if task not in contract.TASKS or not self._is_own(node.rpartition("/")[0]):
                continue
            values = {pair.key: pair.value for pair in status.values}
            factor = float(values.get("real-time factor", "nan"))
            if math.isfinite(factor):
                self._scalar("real_time_factor", factor)
            level = _HEALTH.get(bytes([status.level]), "ERROR")
            if self._levels.get(node, "INFO") != level:
                self._note(f"{node}: {status.message}", level, "diagnostics")
            self._levels[node] = level

    def _status(self, message: Any) -> None:
        self._note(f"profile: {message.data}", "INFO", "profile")

    def _faults(self, message: Any) -> None:
        told = json.loads(message.data)
        if not isinstance(told, list):
            raise ValueError("must be a JSON list")
        level = "WARN" if told else "INFO"
        self._note(f"faults: {', '.join(map(str, told)) or 'none'}", level, "faults")

    def _event(self, message: Any) -> None:
        noted = contract.logger(self._namespace, NOTE)
        level = LEVELS.get(int(message.level), "INFO")
        if message.name.startswith(noted):
            source = message.name.removeprefix(noted)
            self._note(message.msg, level, source, nanoseconds_of(message.stamp))
        elif self._is_own("/" + message.name.rpartition(".")[0].replace(".", "/")):
            self._note(f"{message.name}: {message.msg}", level, "log")

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
        path, count = self._out, 1
        while path in self.files or (count > 1 and path.exists()):
            count += 1
            path = self._out.with_stem(f"{self._out.stem}-{count}")
        self.files.append(path)
        drawn = drawable(self._description, channels)
        self._is_thinned = len(self._left_out) > 0
        rule: dict[str, Any] = {}
        if self._is_thinned:
            every, around = self._left_out[0, 3:].tolist()
            rule = {"every": int(every), "around": around, "thinned": True}
        self._recording = Recording(
            path, description=self._description, drawn=drawn, index=False, **rule
        )
        pending, self._pending = self._pending, []
        for what, *noted in pending:
            self._put(what, *noted)

    def _close(self) -> None:
        if self._recording is not None:
            self._recording.close()
            self.rows += self._recording.rows_written
            self.missing += self._recording.missing
            self._recording = None


def block_of(message: Any) -> tuple[tuple[str, ...], np.ndarray]:
    """Channels and samples of a block.

    Raises:
        ValueError: it is none, or steps and times are not such as `Recording` takes.
    """
    dims = message.layout.dim
    if len(dims) != 2 or dims[0].label != "sample":
        raise ValueError("must have the dimensions sample and channels")
    channels = tuple(dims[1].label.split(","))
    if channels[:2] != ("step", "time") or len(set(channels)) < len(channels):
        raise ValueError(f"channels must begin with step, time and differ: {channels}")
    rows = dims[0].size
    if len(message.data) != rows * len(channels) or dims[1].size != len(channels):
        raise ValueError(f"{len(message.data)} values for {rows} x {len(channels)} samples")
    samples = np.asarray(message.data, dtype=np.float64).reshape(rows, len(channels))
    steps, times = samples[:, 0], samples[:, 1]
    if not (np.isfinite(samples[:, :2]).all() and (steps == np.rint(steps)).all()):
        raise ValueError("step must be whole and time finite in every sample")
    if (np.diff(steps) <= 0).any() or (np.diff(times) < 0).any():
        raise ValueError("step and time must grow from sample to sample")
    return channels, samples
