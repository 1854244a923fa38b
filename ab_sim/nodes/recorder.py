"""`recorder`: streams every topic of a drive into a Rerun recording."""

import datetime
import functools
import math
import threading
import time
from typing import Any

import numpy as np
from rclpy.node import Node

from ab_msgs_py import ENDED, Block, Health, Level, MalformedMessage, topics
from ab_msgs_py.samples import command_of, description_of, event_of, text_of
from ab_sim.errors import InputError, RecordingError
from ab_sim.nodes.bag_recorder import BagRecorder
from ab_sim.nodes.inbox import Inbox
from ab_sim.nodes.parameters import declare, recording_file, recording_folder, refuse_undeclared
from ab_sim.nodes.process import run_node
from ab_sim.recording import AROUND, Recording
from ab_sim.recording.drawing import Drawing

WRITE_PERIOD = 0.2
"""s between two batches; a recording that is killed or looked at is not older than this."""
REPORT_PERIOD = 1.0
"""s between two diagnostics."""
SILENCE = 5.0
"""s without a drive before the recorder says so."""


class Recorder(Node):
    """Collects messages in callbacks, writes them in batches from the main thread.

    Between the two is an inbox of bounded length: a disk that is too slow costs the oldest
    messages, which are counted, and never the simulation its time. What is written, too, leaves
    nothing in memory, so that a recording may go on for days.
    """

    def __init__(self) -> None:
        super().__init__("recorder")
        asked = declare(self, "path", "", ".rrd file; empty: recordings/<date>_<time>.rrd")
        bag = declare(self, "bag", "", "folder of a ROS 2 bag (MCAP) to write; empty: none")
        self._keep = declare(
            self, "keep", True, "whether to write the .rrd file; false: the bag only"
        )
        self._every = declare(
            self, "every", 1, "keep one sample of so many in the .rrd file, but for what happens",
            "1", (1, 1e9),
        )  # fmt: skip
        self._around = declare(
            self, "around", AROUND,
            "keep all samples so long before and after an event, or a turn of the command",
            "s", (0.0, 60.0),
        )  # fmt: skip
        length = declare(
            self, "queue", 10_000, "messages of each topic kept while the disk is slow", "1",
            (10, 1e6),
        )  # fmt: skip
        refuse_undeclared(self)
        if not (bag or self._keep):
            raise InputError(
                "parameter keep = false: goes with a parameter bag; else nothing is written"
            )
        now = datetime.datetime.now()
        self.path = (
            recording_file(asked or f"recordings/{now:%Y-%m-%d_%H-%M-%S}.rrd")
            if self._keep
            else recording_folder(bag)
        )
        self._recording: Recording | None = None
        self._description: dict[str, Any] | None = None
        self._files = 1
        self._time = 0.0
        self._levels: dict[str, Level] = {}
        self._written = self._missing = 0  # in the files before this one
        self._left_out = self._refused = 0  # there, too
        self._malformed = 0
        self._ignored: dict[str, tuple[int, str]] = {}  # since the last report, by topic

        self._diagnostics = topics.DIAGNOSTICS.publisher(self)
        heard = (
            (topics.DESCRIPTION, self._write_description),
            (topics.BLOCK, self._write_block),
            (topics.COMMAND, self._write_command),
            (topics.DIAGNOSTICS, self._write_health),
            (topics.PROFILE_STATUS, self._write_status),
            (topics.EVENTS, self._write_event),
        )
        self._write = {topic.name: write for topic, write in heard}
        self._inbox = Inbox(self._write, length)
        for topic, _ in heard:
            topic.subscription(self, functools.partial(self._inbox.put, topic.name))
        self._bag = BagRecorder(self, recording_folder(bag), length) if bag else None
        self.get_logger().info(f"recording to {self.path} as soon as a drive describes itself")

    def run(self, stopping: threading.Event) -> None:
        """Write what comes in until told to stop, then what is left.

        Raises:
            RecordingError: the file cannot be written further; says how much it holds, which is
                what the last diagnostics say, too.
        """
        failed, text = True, "ended by an error"
        try:
            try:
                self._write_until(stopping)
            finally:
                try:
                    self._close()
                finally:
                    if self._bag is not None:
                        self._bag.close()
            failed, text = False, ENDED
        except RecordingError as error:
            text = str(error)
            raise
        finally:
            self._report(text, failed)

    def _write_until(self, stopping: threading.Event) -> None:
        began = reported = time.monotonic()
        warned = False
        while not stopping.wait(WRITE_PERIOD):
            self._write_all()
            now = time.monotonic()
            if now - reported >= REPORT_PERIOD:
                reported = now
                self._report(self._state())
            if self._description is None and not warned and now - began > SILENCE:
                warned = True
                self.get_logger().warning(
                    f"no drive heard for {SILENCE:g} s: is drive_sim running, in this namespace "
                    "and on this ROS_DOMAIN_ID?"
                )
        self._write_all()

    def _write_all(self) -> None:
        """Write what has come so far."""
        if self._bag is not None:
            self._bag.write()
        for topic, message in self._inbox.take():
            try:
                self._write[topic](message)
            except MalformedMessage as error:
                self._malformed += 1
                self._ignored[topic] = self._ignored.get(topic, (0, ""))[0] + 1, str(error)
        if self._recording is not None:
            self._recording.flush()

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
        if self._description is not None and list(block.channels) != self._description.get(
            "channels"
        ):
            raise MalformedMessage(f"vibration/block has the channels {block.channels}")
        if not np.isfinite(block.samples[:, 1]).all():
            raise MalformedMessage("vibration/block: time must be finite")
        if block.samples[0, 0] <= self._recording.last_step:
            # The drive was reset; a recording's steps only grow, so begin another one.
            self._close()
            self._open()
        self._recording.block(block.channels, block.samples)
        self._time = block.samples[-1, 1]

    def _write_command(self, message: Any) -> None:
        if self._recording is not None:
            self._recording.scalar("commands_received", self._time, command_of(message))

    def _write_health(self, message: Any) -> None:
        for health in Health.all_of(message):
            if health.namespace != self.get_namespace():
                continue
            factor = _number(health.values.get("real-time factor", "nan"))
            if self._recording is not None and math.isfinite(factor):
                self._recording.scalar("real_time_factor", self._time, factor)
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
        if not self._keep:
            return
        path = self.path
        while path.exists():
            # Nothing that was recorded is ever overwritten.
            self._files += 1
            path = self.path.with_stem(f"{self.path.stem}-{self._files}")
        self._recording = Recording(
            path, description=self._description, index=False, every=self._every, around=self._around
        )
        self.get_logger().info(f"recording to {path}")

    def _close(self) -> None:
        if (recording := self._recording) is None:
            return
        try:
            recording.close()
            self.get_logger().info(
                f"wrote {recording.path}: {recording.rows_written} samples, "
                f"{recording.missing} missing"
            )
        finally:
            self._recording = None
            self._written += recording.rows_written
            self._left_out += recording.left_out
            self._refused += recording.stretches_refused
            self._missing += recording.missing

    def _state(self) -> str:
        return "recording" if self._description is not None else "waiting for a drive"

    def _report(self, text: str, failed: bool = False) -> None:
        now = self._recording
        dropped = {topic: count for topic, count in self._inbox.dropped.items() if count}
        missing = self._missing + (now.missing if now else 0)
        bag = self._bag.values() if self._bag else {}
        lost = missing or dropped or self._malformed or (self._bag and self._bag.dropped)
        values = {
            "file": str(now.path) if now else "",
            "samples written": self._written + (now.rows_written if now else 0),
            "samples missing": missing,
            "samples left out by intent": self._left_out + (now.left_out if now else 0),
            "full-rate stretches refused": self._refused + (now.stretches_refused if now else 0),
            **bag,
            "messages dropped": sum(dropped.values()),
            **{f"messages dropped, {topic}": count for topic, count in dropped.items()},
            "messages malformed": self._malformed,
            "messages waiting": len(self._inbox),
        }
        health = Health(
            self.get_fully_qualified_name(),
            Level.ERROR if failed else Level.WARN if lost else Level.OK,
            text,
            {key: str(value) for key, value in values.items()},
        )
        self._diagnostics.publish(health.message_at(round(self._time * 1e9)))
        for topic, (count, last) in self._ignored.items():
            self.get_logger().warning(f"ignored {count} messages on {topic}, the last one: {last}")
        self._ignored.clear()


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise MalformedMessage(f"/diagnostics: {text!r} is no number") from error


def main() -> None:
    """Entry point of the executable."""
    run_node(Recorder, Recorder.run)


if __name__ == "__main__":
    main()
