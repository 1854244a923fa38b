"""From a recording to a bag."""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ab_sim.bags import contract, messages
from ab_sim.bags.contract import NOTE, NUMBER, TopicKind
from ab_sim.bags.writer import BagWriter
from ab_sim.drive.driving_forces import driving_forces
from ab_sim.drive.trajectory import Trajectory, balls_in
from ab_sim.errors import RecordingError, SceneError
from ab_sim.recording import LEFT_OUT, StoredRun
from ab_sim.scene import Scene, check_scene

STATE_RATE = 250.0
"""1/s: how often `drive_sim` publishes the state, unless told otherwise."""
_ROWS = 1000  # at a time
_BLOCK = 20  # rows of a block
_PROFILE = "profile: "  # how the recorder notes the profile controller's state
_COMMANDS = "commands_received"

Sent = tuple[int, int, TopicKind, str, bytes]
"""A message: time [ns], what goes first at that time, kind, full name of the topic, CDR."""


def export_bag(
    run: StoredRun,
    path: Path | str,
    namespace: str = "/",
    rate: float = STATE_RATE,
    progress: Callable[[int, int], None] = lambda done, of: None,
) -> int:
    """Write a recording as a bag, some samples at a time; returns how many messages it has.

    Times are simulated ones. Every sample is in ``vibration/block``; the state, at ``rate``, in
    ``joint_states``, ``vibration``, ``whirl`` and ``deck_pose`` as far as the run has the channels;
    commands and the profile controller's state on their topics; what else was noted on ``/rosout``,
    and other scalars on topics of their own, ``recording/NAME``. ``/clock`` goes before them all.
    `import_bag` makes the same recording of it.

    Args:
        run: as `open_recording` gives it.
        path: of the bag's folder.
        namespace: the drive's.
        rate: of the state [1/s], at most: one per sample.
        progress: is told how many samples are done, of how many.

    Raises:
        RecordingError: there are no samples, they cannot be read, or the bag not be written.
    """
    if not run.extent.rows:
        raise RecordingError("the recording holds no samples: there is nothing to export")
    notes = sorted(_notes(run, namespace), key=lambda sent: sent[:2])
    samples = _Samples(run, namespace, rate)
    with BagWriter(path) as bag:
        known: set[str] = set()
        for time, _, kind, name, message in heapq.merge(
            samples.sent(progress), notes, key=lambda sent: sent[:2]
        ):
            if name not in known:
                known.add(name)
                bag.topic(name, kind.type, kind.qos)
            bag.write(name, time, message)
    return bag.messages


def _notes(run: StoredRun, namespace: str) -> Iterator[Sent]:
    """Commands, scalars and events, each after the clock."""
    times = set()
    for name, scalar in run.notes.scalars.items():
        kind = contract.COMMAND
        if name != _COMMANDS:
            kind = NUMBER._replace(name=NUMBER.name + name)
        for seconds, value in scalar.tolist():
            times.add(time := nanoseconds(seconds))
            yield time, 2, kind, kind.within(namespace), messages.number_message(value)
    for event in run.notes.events:
        times.add(time := nanoseconds(event.time))
        kind, said = contract.PROFILE_STATUS, event.text.removeprefix(_PROFILE)
        if (event.source, event.level) == ("profile", "INFO") and said != event.text:
            message = messages.text_message(said)
        else:
            kind = contract.EVENTS
            logger = contract.logger(namespace, NOTE + event.source)
            message = messages.log_message(time, event.level, logger, event.text)
        yield time, 2, kind, kind.within(namespace), message
    for time in times:
        yield _clock(time)


class _Samples:
    """What a drive would have published of the samples."""

    def __init__(self, run: StoredRun, namespace: str, rate: float) -> None:
        self._run, self._namespace = run, namespace
        self._housing = messages.frame_of(namespace, messages.HOUSING)
        self._period = 1e9 / rate
        self._due = -math.inf
        balls = balls_in(run.channels)
        self._joints = ["angle", *(f"ball_{ball}_angle" for ball in range(balls))]
        self._rates = ["speed", *(f"ball_{ball}_rate" for ball in range(balls))]
        self._sensors = [
            name for name in run.description.get("sensors") or () if f"{name}_1" in run.channels
        ]
        self._scene: Scene | None = None
        try:
            self._scene = check_scene(run.description["scene"], "the recording")
        except (SceneError, LookupError, TypeError, ValueError):
            pass  # somebody else's: nobody knows the forces on its balls

    def sent(self, progress: Callable[[int, int], None]) -> Iterator[Sent]:
        """In the order of time."""
        extent, done = self._run.extent, 0
        begin = nanoseconds(extent.first[1])
        yield self._clocked(begin, -1, contract.DESCRIPTION, messages.description_message(
            self._run.description
        ))  # fmt: skip
        channels = self._run.channels
        thinned = self._run.every > 1
        for block in self._run.blocks((*channels, LEFT_OUT) if thinned else None, rows=_ROWS):
            rows = Trajectory(channels, block[:, : len(channels)])
            counts = block[:, -1] if thinned else None
            yield from heapq.merge(
                self._blocks(rows, counts), self._states(rows), key=lambda sent: sent[:2]
            )
            done += len(rows)
            progress(done, extent.rows)

    def _blocks(self, rows: Trajectory, left_out: np.ndarray | None) -> Iterator[Sent]:
        for first in range(0, len(rows), _BLOCK):
            samples = rows.samples[first : first + _BLOCK]
            time = nanoseconds(samples[-1, 1])
            if left_out is not None:
                counts = left_out[first : first + _BLOCK]
                rule = np.tile((self._run.every, self._run.around), (len(counts), 1))
                told = np.column_stack([samples[:, :2], counts, rule])
                message = messages.block_message(contract.THINNED_CHANNELS, told)
                yield self._clocked(time, 0, contract.THINNED, message)
            message = messages.block_message(rows.channels, samples)
            yield self._clocked(time, 1, contract.BLOCK, message)

    def _states(self, rows: Trajectory) -> Iterator[Sent]:
        times = np.rint(1e9 * rows["time"]).astype(np.int64)
        chosen = []
        for row, time in enumerate(times.tolist()):
            if time >= self._due:
                chosen.append(row)
                # On a raster, and not so long after the last: rates that do not divide stay true.
                self._due = (time // self._period + 1) * self._period
        if not chosen:
            return
        few = Trajectory(rows.channels, rows.samples[chosen])
        made = list(self._made(few))
        for at, time in enumerate(times[chosen].tolist()):
            yield _clock(time)
            for kind, make in made:
                yield self._clocked(time, 1, kind, make(at, time))

    def _made(self, rows: Trajectory) -> Iterator[tuple[TopicKind, Callable[[int, int], bytes]]]:
        """How the messages of some rows are made: of the row at a place, stamped with a time."""
        has, housing = set(rows.channels), self._housing
        if {*self._joints, *self._rates} <= has:
            angles, rates = _columns(rows, self._joints), _columns(rows, self._rates)
            efforts = self._efforts(rows)
            yield (
                contract.JOINT_STATES,
                lambda at, time: messages.joint_message(
                    time, housing, angles[at], rates[at], efforts[at]
                ),
            )
        for name in self._sensors:
            read = _columns(rows, [f"{name}_1", f"{name}_2", f"{name}_3"])
            frame = messages.frame_of(self._namespace, name)
            yield contract.VIBRATION, _vibration(frame, read, np.zeros_like(read))
        if {"ax", "ay"} <= has and not self._sensors:
            linear = _columns(rows, ["ax", "ay", "az"])
            turning = rows.angular_acceleration if "wx_rate" in has else np.zeros_like(linear)
            yield contract.VIBRATION, _vibration(housing, linear, turning)
        if {"x", "y"} <= has:
            place, turn = _columns(rows, ["x", "y", "z"]), rows.turn
            yield contract.WHIRL, lambda at, time: messages.whirl_message(time, housing, place[at])
            yield (
                contract.DECK_POSE,
                lambda at, time: messages.pose_message(time, housing, place[at], turn[at]),
            )

    def _efforts(self, rows: Trajectory) -> np.ndarray:
        """NaN where nobody knows."""
        efforts = np.full((len(rows), len(self._joints)), math.nan)
        if "motor_torque" in rows.channels:
            efforts[:, 0] = rows["motor_torque"]
        if self._scene is not None and self._scene.balls.count == rows.balls:
            efforts[:, 1:] = -driving_forces(rows, self._scene) * self._scene.race.radius
        return efforts

    def _clocked(self, time: int, order: int, kind: TopicKind, message: bytes) -> Sent:
        return time, order, kind, kind.within(self._namespace), message


def nanoseconds(seconds: float) -> int:
    """A time [s] as a stamp has it [ns]."""
    return round(seconds * 1e9)


def _clock(time: int) -> Sent:
    return time, 0, contract.CLOCK, contract.CLOCK.name, messages.clock_message(time)


def _vibration(frame: str, linear: np.ndarray, turning: np.ndarray) -> Callable[[int, int], bytes]:
    return lambda at, time: messages.vibration_message(time, frame, linear[at], turning[at])


def _columns(rows: Trajectory, names: list[str]) -> Any:
    """Channels side by side; 0 for those that there are not: a deck in the plane has no z."""
    zero = np.zeros(len(rows))
    return np.column_stack([rows[name] if name in rows.channels else zero for name in names])
