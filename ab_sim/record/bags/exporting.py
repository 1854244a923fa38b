"""Export of a recording to a bag."""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ab_msgs_py import Block, Topic, topics
from ab_msgs_py.prefilled import Prefilled
from ab_msgs_py.samples import Event
from ab_sim.base.errors import RecordingError, SceneError
from ab_sim.base.presentation import CountProgress
from ab_sim.base.sample_columns import STEP, TIME
from ab_sim.drive.closed_forms import driving_forces
from ab_sim.drive.published import CONSTANTS, STATE_TOPICS, StateChannels
from ab_sim.drive.trajectory import Trajectory, balls_in
from ab_sim.record.bags import contract
from ab_sim.record.bags.contract import DECIMATED, NOTE, NUMBER, encoded, offered_qos, prefilled
from ab_sim.record.bags.writer import BagWriter
from ab_sim.record.recording import LEFT_OUT, StoredRun
from ab_sim.scene import Scene, check_scene

STATE_RATE = 250.0
"""Default rate at which `drive_sim` publishes the state [1/s]."""
_ROWS = 1000  # rows read at a time
_BLOCK = 20  # rows of a block
_PROFILE = "profile: "  # beginning of the recorder's events on the profile controller's state
_COMMANDS = "commands_received"

TimedMessage = tuple[int, int, Topic, str, bytes]
"""Time [ns], rank among messages of that time, topic, full name of the topic, message in CDR.

The description is first (-1), then the clock (0), samples and state (1), commands and events (2).
"""


def export_bag(
    run: StoredRun,
    path: Path | str,
    namespace: str = "/",
    rate: float = STATE_RATE,
    progress: CountProgress = lambda done, of: None,
) -> int:
    """Write a recording as a bag, a few samples at a time, and return the number of messages.

    Times are simulated. Every sample is in ``vibration/block``. The state is on the topics of a
    drive (`ab_sim.drive.published`), at ``rate``, as far as the run has the channels. Commands and
    the profile controller's state are on their topics, other events on ``/rosout``, and other
    scalars on separate topics, ``recording/NAME``. At each time, ``/clock`` is the first message.
    `import_bag` converts the bag back to the same recording.

    Parameters
    ----------
    run
        Result of `open_recording`.
    path
        Path of the bag's folder.
    namespace
        Namespace of the drive.
    rate
        Rate of the state's messages [1/s]; there is at most one per sample.
    progress
        Function that is called with the number of samples done, and of all.

    Raises
    ------
    RecordingError
        There are no samples, they cannot be read, or the bag cannot be written.
    """
    if not run.extent.rows:
        raise RecordingError("the recording has no samples: there is nothing to export")
    notes = sorted(_notes(run, namespace), key=lambda message: message[:2])
    samples = _Samples(run, namespace, rate)
    with BagWriter(path) as bag:
        known_names: set[str] = set()
        for time, _, topic, name, message in heapq.merge(
            samples.messages(progress), notes, key=lambda message: message[:2]
        ):
            if name not in known_names:
                known_names.add(name)
                bag.topic(name, topic.type_name, offered_qos(topic.qos))
            bag.write(name, time, message)
    return bag.messages


def _notes(run: StoredRun, namespace: str) -> Iterator[TimedMessage]:
    """Yield commands, scalars and events as messages, and a clock message at each time of one."""
    times = set()
    for name, scalar in run.notes.scalars.items():
        topic = topics.COMMAND
        if name != _COMMANDS:
            topic = NUMBER._replace(name=NUMBER.name + name)
        for seconds, value in scalar.tolist():
            times.add(time := nanoseconds(seconds))
            yield time, 2, topic, topic.within(namespace), encoded(topic, value)
    for event in run.notes.events:
        times.add(time := nanoseconds(event.time))
        topic, status = topics.PROFILE_STATUS, event.text.removeprefix(_PROFILE)
        if (event.source, event.level) == ("profile", "INFO") and status != event.text:
            message = encoded(topic, status)
        else:
            topic, logger = topics.EVENTS, contract.logger_name(namespace, NOTE + event.source)
            message = encoded(topic, Event(time, event.level, logger, event.text))
        yield time, 2, topic, topic.within(namespace), message
    for time in times:
        yield _clock(time)


class _Samples:
    """Converter of samples to the messages that a live drive would have published."""

    def __init__(self, run: StoredRun, namespace: str, rate: float) -> None:
        self._run, self._namespace = run, namespace
        self._period = 1e9 / rate
        self._due = -math.inf
        sensors = run.description.get("sensors") or ()
        state_channels = StateChannels(
            namespace, run.channels, balls_in(run.channels), list(sensors)
        )
        places = {name: place for place, name in enumerate(state_channels.names)}
        self._templates: list[tuple[Topic, Prefilled, list[int]]] = [
            (topic, prefilled(topic, template.sample), [places[name] for name in template.numbers])
            for topic, of in STATE_TOPICS.items()
            for template in of(state_channels)
        ]
        self._scene: Scene | None = None
        try:
            self._scene = check_scene(run.description["scene"], "the recording")
        except (SceneError, LookupError, TypeError, ValueError):
            pass  # The recording is of another program: driving forces are unknown.

    def messages(self, progress: CountProgress) -> Iterator[TimedMessage]:
        """Yield all messages, sorted by time."""
        extent, done = self._run.extent, 0
        begin = nanoseconds(extent.first.time)
        yield self._message(begin, -1, topics.DESCRIPTION, dict(self._run.description))
        channels = self._run.channels
        decimated = self._run.every > 1
        for block in self._run.blocks((*channels, LEFT_OUT) if decimated else None, rows=_ROWS):
            rows = Trajectory(channels, block[:, : len(channels)])
            counts = block[:, -1] if decimated else None
            yield from heapq.merge(
                self._blocks(rows, counts), self._states(rows), key=lambda message: message[:2]
            )
            done += len(rows)
            progress(done, extent.rows)

    def _blocks(self, rows: Trajectory, left_out: np.ndarray | None) -> Iterator[TimedMessage]:
        """Yield blocks of samples; with decimation, a block on the omitted rows precedes each.

        ``left_out`` is the number of omitted rows up to each row; None without decimation.
        """
        for first in range(0, len(rows), _BLOCK):
            samples = rows.samples[first : first + _BLOCK]
            time = nanoseconds(samples[-1, TIME])
            if left_out is not None:
                counts = left_out[first : first + _BLOCK]
                rule = np.tile((self._run.every, self._run.around), (len(counts), 1))
                decimation = np.column_stack([samples[:, [STEP, TIME]], counts, rule])
                yield self._message(
                    time, 0, DECIMATED, Block(contract.DECIMATED_CHANNELS, decimation)
                )
            yield self._message(time, 1, topics.BLOCK, Block(rows.channels, samples))

    def _states(self, rows: Trajectory) -> Iterator[TimedMessage]:
        """Yield the state's messages for the rows that are due, each set after a clock message."""
        times = np.rint(1e9 * rows["time"]).astype(np.int64)
        chosen = []
        for row, time in enumerate(times.tolist()):
            if time >= self._due:
                chosen.append(row)
                # Due times are on a fixed grid, so that the mean rate is exact even if the period
                # is not a multiple of the step.
                self._due = (time // self._period + 1) * self._period
        if not chosen:
            return
        numbers = self._numbers(Trajectory(rows.channels, rows.samples[chosen]))
        parts = [numbers[:, places].tolist() for _, _, places in self._templates]
        for at, time in enumerate(times[chosen].tolist()):
            yield _clock(time)
            for (topic, template, _), part in zip(self._templates, parts, strict=True):
                name = topic.within(self._namespace)
                yield time, 1, topic, name, template.at(time, part[at])

    def _numbers(self, rows: Trajectory) -> np.ndarray:
        """Return the numbers for some rows' messages, shape (rows, `StateChannels.names`)."""
        turning = np.zeros((len(rows), 3))
        if rows.tilts and "wx_rate" in rows.channels:
            turning = rows.angular_acceleration
        constants = np.tile(list(CONSTANTS.values()), (len(rows), 1))
        return np.column_stack([rows.samples, constants, self._efforts(rows), turning])

    def _efforts(self, rows: Trajectory) -> np.ndarray:
        """Return the driving torques of the balls [N m], shape (rows, balls).

        They are NaN if the recording has no scene.
        """
        if self._scene is not None and self._scene.balls.count == rows.balls:
            return -driving_forces(rows, self._scene) * self._scene.race.radius
        return np.full((len(rows), rows.balls), math.nan)

    def _message(self, time: int, rank: int, topic: Topic, sample: Any) -> TimedMessage:
        """Return a sample as a message on a topic in the drive's namespace, with time and rank."""
        return time, rank, topic, topic.within(self._namespace), encoded(topic, sample)


def nanoseconds(seconds: float) -> int:
    """Return a time [s] in whole nanoseconds."""
    return round(seconds * 1e9)


def _clock(time: int) -> TimedMessage:
    """Return the message of ``/clock`` at a time [ns]."""
    return time, 0, topics.CLOCK, topics.CLOCK.name, encoded(topics.CLOCK, time)
