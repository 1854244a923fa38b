"""`recorder`: streams every topic of a drive into a Rerun recording."""

import datetime
import queue
import threading
import time
from collections.abc import Callable
from typing import Any

from rclpy.node import Node

from ab_msgs_py import ENDED, Block, Health, Level, MalformedMessage, topics
from ab_msgs_py.samples import command_of, description_of, event_of, text_of
from ab_sim.errors import RecordingError
from ab_sim.nodes.parameters import declare, recording_file, refuse_undeclared
from ab_sim.nodes.process import run_node
from ab_sim.recording import Recording
from ab_sim.recording.drawing import Drawing
from ab_sim.trajectory import channels_for

REPORT_PERIOD = 1.0
"""s between two diagnostics."""
SILENCE = 5.0
"""s without a drive before the recorder says so."""


class Recorder(Node):
    """Collects messages in callbacks, writes them from the main thread.

    Between the two is a bounded queue: a disk that is too slow costs the oldest messages, which
    are counted, and never the simulation its time.
    """

    def __init__(self) -> None:
        super().__init__("recorder")
        asked = declare(self, "path", "", ".rrd file; empty: recordings/<date>_<time>.rrd")
        now = datetime.datetime.now()
        self.path = recording_file(asked or f"recordings/{now:%Y-%m-%d_%H-%M-%S}.rrd")
        length = declare(
            self, "queue", 2000, "messages kept while the disk is slow", "1", (10, 1e6)
        )
        refuse_undeclared(self)
        self._queue: queue.Queue[tuple[Callable[..., None], Any]] = queue.Queue(length)
        self._recording: Recording | None = None
        self._description: dict[str, Any] | None = None
        self._files = 1
        self._last_step: float | None = None
        self._time = 0.0
        self._levels: dict[str, Level] = {}
        self.dropped = self.missing = self.malformed = self.written = 0

        self._diagnostics = topics.DIAGNOSTICS.publisher(self)
        for topic, write in (
            (topics.DESCRIPTION, self._write_description),
            (topics.BLOCK, self._write_block),
            (topics.COMMAND, self._write_command),
            (topics.DIAGNOSTICS, self._write_health),
            (topics.PROFILE_STATUS, self._write_status),
            (topics.EVENTS, self._write_event),
        ):
            topic.subscription(self, self._enqueue(write))
        self.get_logger().info(f"recording to {self.path} as soon as a drive describes itself")

    def run(self, stopping: threading.Event) -> None:
        """Write what comes in until told to stop, then what is left."""
        try:
            self._write_until(stopping)
        finally:
            self._close()
            self._report(ended=True)

    def _write_until(self, stopping: threading.Event) -> None:
        began = reported = time.monotonic()
        warned = False
        while not stopping.is_set():
            self._write_next(timeout=0.2)
            now = time.monotonic()
            if now - reported >= REPORT_PERIOD:
                reported = now
                self._report()
            if self._description is None and not warned and now - began > SILENCE:
                warned = True
                self.get_logger().warning(
                    f"no drive heard for {SILENCE:g} s: is drive_sim running, in this namespace "
                    "and on this ROS_DOMAIN_ID?"
                )
        # What is there now; more may keep coming.
        for _ in range(self._queue.qsize()):
            self._write_next(timeout=0.0)

    def _enqueue(self, write: Callable[..., None]) -> Callable[[Any], None]:
        def callback(message: Any) -> None:
            while True:
                try:
                    self._queue.put_nowait((write, message))
                    return
                except queue.Full:
                    try:
                        self._queue.get_nowait()
                        self.dropped += 1
                    except queue.Empty:
                        pass

        return callback

    def _write_next(self, timeout: float) -> bool:
        try:
            write, message = self._queue.get(timeout=timeout) if timeout else self._queue.get(False)
        except queue.Empty:
            return False
        try:
            write(message)
        except MalformedMessage as error:
            self.malformed += 1
            self.get_logger().warning(f"ignored: {error}", throttle_duration_sec=1.0)
        return True

    def _write_description(self, message: Any) -> None:
        description = description_of(message)
        try:
            Drawing.of(description)
        except RecordingError as error:
            raise MalformedMessage(str(error)) from error
        if description != self._description:
            self._close()
            self._description = description
            self._open()

    def _write_block(self, message: Any) -> None:
        block = Block.of(message)
        if self._recording is None or len(block.samples) == 0:
            return
        if self._description is not None and block.channels != _channels_of(self._description):
            raise MalformedMessage(f"vibration/block has the channels {block.channels}")
        first, last = block.samples[0, 0], block.samples[-1, 0]
        if self._last_step is not None and first <= self._last_step:
            # The drive was reset; a recording's steps only grow, so begin another one.
            self._close()
            self._open()
        if self._last_step is not None:
            self.missing += int(first - self._last_step) - 1
        self._last_step, self._time = last, block.samples[-1, 1]
        self._recording.block(block.channels, block.samples)
        self.written += len(block.samples)

    def _write_command(self, message: Any) -> None:
        if self._recording is not None:
            self._recording.scalar("commands_received", self._time, command_of(message))

    def _write_health(self, message: Any) -> None:
        for health in Health.all_of(message):
            if health.namespace != self.get_namespace():
                continue
            factor = health.values.get("real-time factor")
            if self._recording is not None and factor is not None:
                self._recording.scalar("real_time_factor", self._time, float(factor))
            changed = self._levels.get(health.node, Level.OK) is not health.level
            self._levels[health.node] = health.level
            if self._recording is not None and changed:
                self._recording.event(
                    self._time,
                    f"{health.node}: {health.message}",
                    "INFO" if health.level is Level.OK else health.level.name,
                    "diagnostics",
                )

    def _write_status(self, message: Any) -> None:
        if self._recording is not None:
            self._recording.event(self._time, f"profile: {text_of(message)}", "INFO", "profile")

    def _write_event(self, message: Any) -> None:
        if self._recording is not None:
            _, level, node, text = event_of(message)
            if "/" + node.rpartition(".")[0].replace(".", "/") != self.get_namespace():
                return
            self._recording.event(self._time, f"{node}: {text}", level, "log")

    def _open(self) -> None:
        assert self._description is not None
        path = self.path
        while path.exists():
            # Nothing that was recorded is ever overwritten.
            self._files += 1
            path = self.path.with_stem(f"{self.path.stem}-{self._files}")
        self._recording = Recording(path, description=self._description)
        self._last_step = None
        self.get_logger().info(f"recording to {path}")

    def _close(self) -> None:
        if self._recording is not None:
            self._recording.close()
            self.get_logger().info(
                f"wrote {self._recording.path}: {self._recording.rows} samples, "
                f"{self.missing} missing, {self.dropped} messages dropped"
            )
            self._recording = None

    def _report(self, ended: bool = False) -> None:
        lost = self.missing + self.dropped + self.malformed
        health = Health(
            self.get_fully_qualified_name(),
            Level.WARN if lost else Level.OK,
            ENDED if ended else "recording" if self._recording else "waiting for a drive",
            {
                "file": str(self._recording.path) if self._recording else "",
                "samples written": str(self.written),
                "samples missing": str(self.missing),
                "messages dropped": str(self.dropped),
                "messages malformed": str(self.malformed),
                "messages waiting": str(self._queue.qsize()),
            },
        )
        self._diagnostics.publish(health.message_at(round(self._time * 1e9)))


def _channels_of(description: dict[str, Any]) -> tuple[str, ...]:
    """The channels of the drive that describes itself so."""
    effects = description.get("effects") or ()
    return channels_for(int(description["balls"]), "motor" in effects, "accelerometer" in effects)


def main() -> None:
    """Entry point of the executable."""
    run_node(Recorder, Recorder.run)


if __name__ == "__main__":
    main()
