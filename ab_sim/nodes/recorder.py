"""`recorder`: records the topics of a drive as a Rerun file, and optionally as a bag."""

import contextlib
import datetime
import functools
import math
import os
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ab_msgs_py import ENDED, Block, Health, Level, MalformedMessage, Task, Topic, topics
from ab_msgs_py.samples import Event
from ab_msgs_py.set_points import SetPoints
from ab_sim.base.errors import InputError, RecordingError
from ab_sim.base.numbers import number_in
from ab_sim.base.sample_columns import TIME
from ab_sim.nodes.base_node import PARAMETERS, BaseNode, DiagnosticsPublisher
from ab_sim.nodes.inbox import Inbox
from ab_sim.nodes.parameters import (
    Parameters,
    ParameterSpec,
    recording_file,
    recording_folder,
)
from ab_sim.nodes.process import run_node, share_heaps
from ab_sim.nodes.recorded_files import (
    COMMANDS,
    REAL_TIME_FACTOR,
    BagRecorder,
    RecordedFiles,
)
from ab_sim.record.recording import AROUND
from ab_sim.record.recording.drawing import Drawing
from ab_sim.show.viewing import Viewer

_NICENESS = 5
"""Nice value added to the recorder's process, so that the drive has priority (`man nice`)."""
_WRITE_PERIOD = 0.1
"""Time between two writes [s]: a viewer lags by this time, and a killed recorder loses it."""
_REPORT_PERIOD = 1.0
"""Time between two diagnostics messages [s]."""
SILENCE = 5.0
"""Time without a drive after which the recorder warns [s]."""
NONE = "none"
"""Value of the parameter ``view``: no viewer."""
_RECORDER_PARAMETERS = (
    ParameterSpec(
        "path", "", ".rrd file to write; empty: recordings/<date>_<time>.rrd", fixed=True
    ),
    ParameterSpec(
        "view",
        NONE,
        "viewer: none, web (page for a browser), native (window), or the address of a running "
        "viewer, rerun+http://HOST:PORT/proxy",
        fixed=True,
    ),
    ParameterSpec(
        "web_port",
        0,
        "port of the web viewer's page; 0: any free port",
        "1",
        (0, 65535),
        fixed=True,
    ),
    ParameterSpec("bag", "", "folder of a ROS 2 bag (MCAP) to write; empty: none", fixed=True),
    ParameterSpec(
        "keep",
        True,
        "whether to keep an .rrd file; false: only show the run, or write a bag",
        fixed=True,
    ),
    ParameterSpec(
        "every",
        1,
        "keep every n-th sample in the .rrd file, and all samples around events",
        "1",
        (1, 1e9),
        fixed=True,
    ),
    ParameterSpec(
        "around",
        AROUND,
        "keep all samples within this time of an event or a change of the command",
        "s",
        (0.0, 60.0),
        fixed=True,
    ),
    ParameterSpec(
        "queue",
        10_000,
        "largest number of messages per topic that wait for a slow disk",
        "1",
        (10, 1e6),
        fixed=True,
    ),
)
"""All parameters of the node."""


class Recorder(BaseNode):
    """Node that collects messages in callbacks, and writes them in batches from the main thread.

    Between the two threads is an inbox of bounded length. If the disk is too slow, the oldest
    messages are dropped and counted; the simulation is never delayed. The node keeps nothing of
    written messages in memory, so that a recording can last for days. A viewer reads the file in
    other processes, so that the recorder never waits for it.
    """

    def __init__(self) -> None:
        super().__init__("recorder")
        values = Parameters(self, _RECORDER_PARAMETERS).values
        path, view, bag, length = (values[name] for name in ("path", "view", "bag", "queue"))
        kept = self._kept_file(path, view, bag, values["keep"])
        self._viewer = self._start_viewer(view, values["web_port"])
        self._for_now = contextlib.ExitStack()
        folder = self._folder_for_now()
        file = kept or (None if self._viewer is None else self._folder_for_now() / "live.rrd")
        decimated = {name: values[name] for name in ("every", "around")}
        drives = functools.partial(topics.BLOCK.publishers, self)
        self._files = RecordedFiles(
            file, self._viewer, folder, self.get_logger(), drives, decimated
        )
        self._description: dict[str, Any] | None = None
        self._time = 0.0
        self._drive_ended: int | None = None
        """Time [ns] of the last step of a drive that ended, until its samples arrive; else None."""
        self._levels: dict[str, Level] = {}
        self._malformed = 0
        self._ignored: dict[str, tuple[int, str]] = {}  # since the last report, by topic

        self._diagnostics = DiagnosticsPublisher(self, Task.RECORDING)
        recorded = (
            (topics.DESCRIPTION, self._write_description),
            (topics.BLOCK, self._write_block),
            (topics.COMMAND, self._write_command),
            (topics.TRAJECTORY, self._write_trajectory),
            (topics.DIAGNOSTICS, self._write_health),
            (topics.PROFILE_STATUS, self._write_status),
            (topics.FAULTS, self._write_faults),
            (topics.EVENTS, self._write_event),
        )
        self._write: dict[str, tuple[Topic, Callable[[Any], None]]] = {
            topic.name: (topic, write) for topic, write in recorded
        }
        self._inbox = Inbox(self._write, length)
        for topic, _ in recorded:
            topic.subscription(self, functools.partial(self._inbox.put, topic.name))
        self._bag = BagRecorder(self, recording_folder(bag), length) if bag else None
        target = file if file is not None else bag
        self.get_logger().info(f"recording to {target}, from the description of a drive on")

    def run(self, stopping: threading.Event) -> None:
        """Write received messages until stopped, and then close all files.

        Raises
        ------
        RecordingError
            Received samples were lost; the message and the last diagnostics have their number.
        """
        failed, text = True, "ended by an error"
        try:
            try:
                self._write_until(stopping)
            finally:
                try:
                    self._files.close()
                finally:
                    if self._bag is not None:
                        self._bag.close()
            failed, text = False, ENDED
            if self._files.lost:
                failed, text = True, f"{self._files.lost} samples lost: {self._files.why_lost}"
                raise RecordingError(text)
        except RecordingError as error:
            text = str(error)
            raise
        finally:
            self._report(text, failed)
            if self._viewer is not None:
                self._viewer.close(leave_window=True)
            self._for_now.close()

    def _kept_file(self, path: str, view: str, bag: str, keep: bool) -> Path | None:
        """Return the .rrd file to keep; None: none is kept.

        Raises
        ------
        InputError
            The parameters contradict each other, or the file cannot be written.
        """
        if keep:
            now = datetime.datetime.now()
            return recording_file(path or f"recordings/{now:%Y-%m-%d_%H-%M-%S}.rrd")
        if view == NONE and not bag:
            raise InputError(
                "parameter keep = False: requires a parameter bag, or a view other than none; "
                "otherwise there is nothing to do"
            )
        if path:
            raise InputError(
                f"parameter path = {path!r}: conflicts with keep = False; remove one of them"
            )
        return None

    def _folder_for_now(self) -> Path:
        """Return a temporary folder, which is removed at the end of ``run``."""
        folder = tempfile.TemporaryDirectory(prefix="ab_sim-live-")
        return Path(self._for_now.enter_context(folder))

    def _start_viewer(self, view: str, port: int) -> Viewer | None:
        """Start the viewer of the parameters; return None if there is none."""
        if view == NONE:
            return None
        try:
            viewer = Viewer(view, port)
        except InputError as error:
            raise InputError(f"parameter view: {error}") from error
        self.get_logger().info(f"watch at {viewer.address}")
        return viewer

    def _write_until(self, stopping: threading.Event) -> None:
        """Write and report periodically until stopped; warn if there is no drive."""
        began = reported = time.monotonic()
        warned = False
        while not stopping.wait(_WRITE_PERIOD):
            self._write_all()
            now = time.monotonic()
            if now - reported >= _REPORT_PERIOD:
                reported = now
                self._report(self._state())
            if self._description is None and not warned and now - began > SILENCE:
                warned = True
                self.get_logger().warning(
                    f"no message from a drive for {SILENCE:g} s: is drive_sim running, in this "
                    "namespace and on this ROS_DOMAIN_ID?"
                )
        self._write_all()

    def _write_all(self) -> None:
        """Write all messages received so far."""
        if self._bag is not None:
            self._bag.write()
        for name, message in self._inbox.take():
            topic, write = self._write[name]
            try:
                write(topic.sample(message))
            except MalformedMessage as error:
                self._malformed += 1
                self._ignored[name] = self._ignored.get(name, (0, ""))[0] + 1, str(error)
        self._files.flush()
        if self._drive_ended is not None and self._time_ns >= self._drive_ended:
            self._drive_ended = None
            self._files.conclude_shown()

    def _write_description(self, description: dict[str, Any]) -> None:
        try:
            Drawing.of(description)
        except RecordingError as error:
            raise MalformedMessage(str(error)) from error
        if description != self._description:
            self._description = description
            self._files.begin(description)

    def _write_block(self, block: Block) -> None:
        if self._description is None or len(block.samples) == 0:
            return
        if list(block.channels) != self._description.get("channels"):
            raise MalformedMessage(f"vibration/block has the channels {block.channels}")
        self._files.block(block.channels, block.samples)
        self._time = block.samples[-1, TIME]

    def _write_command(self, speed: float) -> None:
        self._files.scalar(COMMANDS, self._time, speed)

    def _write_trajectory(self, wanted: SetPoints) -> None:
        self._files.event(self._time, wanted.text, "INFO", "commands")

    def _write_health(self, entries: list[Health]) -> None:
        for health in entries:
            if health.namespace != self.get_namespace():
                continue
            if health.task is Task.DRIVE:
                self._drive_ended = health.time if health.message == ENDED else None
            if parameters := health.values.get(PARAMETERS):
                text = f"{health.node.rpartition('/')[2]}: {PARAMETERS}: {parameters}"
                self._files.standing(health.node, self._time, text, PARAMETERS)
            factor = _number(health.values.get("real-time factor", "nan"))
            if math.isfinite(factor):
                self._files.scalar(REAL_TIME_FACTOR, self._time, factor)
            self._files.state(health.node.rpartition("/")[2], self._time, health.level.name)
            changed = self._levels.get(health.node, Level.OK) is not health.level
            self._levels[health.node] = health.level
            if changed:
                self._files.event(
                    self._time,
                    f"{health.node}: {health.message}",
                    "INFO" if health.level is Level.OK else health.level.name,
                    "diagnostics",
                )

    def _write_status(self, status: str) -> None:
        self._files.state("profile", self._time, status.partition(":")[0])
        self._files.event(self._time, f"profile: {status}", "INFO", "profile")

    def _write_faults(self, faults: list[str]) -> None:
        text = ", ".join(faults) or "none"
        self._files.state("faults", self._time, text)
        self._files.event(self._time, f"faults: {text}", "WARN" if faults else "INFO", "faults")

    def _write_event(self, event: Event) -> None:
        _, level, node, text = event
        if "/" + node.rpartition(".")[0].replace(".", "/") != self.get_namespace():
            return
        # Parameters are recorded from the diagnostics, which also late recorders receive.
        if not text.startswith(f"{PARAMETERS}: "):
            self._files.event(self._time, f"{node}: {text}", level, "log")

    @property
    def _time_ns(self) -> int:
        return round(self._time * 1e9)

    def _state(self) -> str:
        return "recording" if self._description is not None else "waiting for a drive"

    def _report(self, text: str, failed: bool = False) -> None:
        """Publish the diagnostics, and log malformed messages since the last report."""
        files, viewer = self._files, self._viewer
        dropped = {topic: count for topic, count in self._inbox.dropped.items() if count}
        values = {
            "file": files.path,
            "samples written": files.written,
            "samples missing": files.missing,
            "samples lost": files.lost,
            "samples left out by intent": files.left_out,
            "full-rate stretches refused": files.refused,
            **({} if self._bag is None else self._bag.values()),
            "messages dropped": sum(dropped.values()),
            **{f"messages dropped, {topic}": count for topic, count in dropped.items()},
            "messages malformed": self._malformed,
            "messages waiting": len(self._inbox),
        }
        level = Level.OK
        slow_bag = self._bag is not None and self._bag.dropped
        if files.missing or files.lost or dropped or self._malformed or slow_bag:
            level = Level.WARN
        if viewer is not None:
            values |= {
                "viewer": viewer.address,
                "viewer state": viewer.state,
                "viewer restarts": viewer.restarts,
                "viewer process": viewer.process or "",
                "pages opened": viewer.pages_opened,
                "bytes not viewed yet": viewer.waiting,
            }
            if viewer.trouble:
                level, text = Level.WARN, f"{text}; viewer {viewer.state}"
        if failed or files.trouble:
            level, text = Level.ERROR, files.trouble if files.trouble and not failed else text
        texts = {key: str(value) for key, value in values.items()}
        self._diagnostics.publish(level, text, texts, self._time_ns)
        for topic, (count, last) in self._ignored.items():
            self.get_logger().warning(f"ignored {count} messages on {topic}, the last one: {last}")
        self._ignored.clear()


def _number(text: str) -> float:
    """Return a number from the diagnostics of another node.

    Raises
    ------
    MalformedMessage
        The text is not a number.
    """
    try:
        return number_in(text)
    except ValueError as error:
        raise MalformedMessage(f"/diagnostics: {text!r} is not a number") from error


def main() -> None:
    """Run the node."""
    # The drive must not be late, so the recorder has a lower priority, and also viewers, which are
    # started from here.
    os.nice(_NICENESS)
    share_heaps()
    run_node(Recorder, Recorder.run)


if __name__ == "__main__":
    main()
