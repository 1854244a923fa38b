"""`profile_controller`: runs a start-up profile by publishing speed commands at a fixed rate."""

import math
import threading
import time

from rclpy.node import Node

from ab_msgs_py import ENDED, Health, Level, topics
from ab_msgs_py.samples import command_message, text_message
from ab_msgs_py.services import ABORT, START, Answer, serve_trigger
from ab_sim.errors import InputError
from ab_sim.nodes.parameters import close_parameters, declare
from ab_sim.nodes.process import run_node
from ab_sim.scene import load_scene
from ab_sim.spindle import SpeedProfile

REPORT_PERIOD = 1.0
"""s between two diagnostics."""
LEAP = 2_000_000_000
"""ns; a clock that goes on by more than this between two commands has leapt."""
HEALTH = {
    "idle": "waiting for ~/start",
    "running": "running the profile",
    "done": "profile done, holding its final speed",
    "aborted": "aborted, commanding standstill",
}


class ProfileController(Node):
    """What start-up firmware does: one speed command per period, along the profile.

    It keeps the node's clock: with ``use_sim_time`` it follows the simulator's.
    """

    def __init__(self) -> None:
        super().__init__("profile_controller")
        name = declare(
            self, "profile", "thesis-hold", "name or YAML file of the scene whose profile to run"
        )
        changes = declare(self, "changes", [""], "changes to the scene, each key=value")
        rate = declare(self, "command_rate", 200.0, "commands", "1/s", (1.0, 1000.0))
        auto_start = declare(self, "auto_start", False, "start as soon as a drive listens")
        close_parameters(self)
        scene = load_scene(name, filter(None, changes))
        if scene.profile is None:
            raise InputError(f"parameter profile = {name}: that scene has no profile to run")
        self.profile = SpeedProfile.of_scene(scene)
        self._period = 1.0 / rate
        self._lock = threading.Lock()
        self._state = ""
        self._simulated = bool(self.get_parameter("use_sim_time").value)
        self._began = self._now = 0
        self._published = 0

        self._command = topics.COMMAND.publisher(self)
        self._status = topics.PROFILE_STATUS._replace(name="~/status").publisher(self)
        self._diagnostics = topics.DIAGNOSTICS.publisher(self)
        serve_trigger(self, START, self.start)
        serve_trigger(self, ABORT, self.abort)
        self.create_timer(self._period, self._tick)
        self._enter("idle")
        if auto_start:
            self._waiting = self.create_timer(self._period, self._start_when_heard)

    def start(self) -> Answer:
        """Run the profile from its beginning, now."""
        with self._lock:
            if self._state == "running":
                return False, "running already; abort first"
            if self._simulated and topics.CLOCK.publishers(self) == 0:
                clock = self.resolve_topic_name(topics.CLOCK.name)
                return False, f"use_sim_time is set, but nobody publishes {clock}"
            if self.listeners == 0:
                return False, f"nobody listens on {self._command.topic_name}: start the drive first"
            self._began = self._now = self.get_clock().now().nanoseconds
            self._enter("running")
            self._send()
            return True, f"started at t = {self._began / 1e9:g} s"

    def abort(self) -> Answer:
        """Stop the profile; command standstill from now on."""
        with self._lock:
            if self._state not in ("running", "done"):
                return False, "not running"
            self._enter("aborted")
            self._send()
            return True, "commanding standstill"

    @property
    def listeners(self) -> int:
        """How many nodes listen to the commands: the drive, and perhaps a recorder."""
        return self._command.get_subscription_count()

    def report(self, ended: bool = False) -> None:
        """Publish this node's health."""
        level = Level.WARN if self._state == "aborted" else Level.OK
        health = Health(
            self.get_fully_qualified_name(),
            level,
            ENDED if ended else HEALTH[self._state],
            {
                "state": self._state,
                "command rate [1/s]": f"{1 / self._period:g}",
                "commands published": str(self._published),
                "listeners": str(self.listeners),
            },
        )
        self._diagnostics.publish(health.message_at(self.get_clock().now().nanoseconds))

    def _start_when_heard(self) -> None:
        if self.listeners and self.start()[0]:
            self._waiting.cancel()

    def _enter(self, state: str) -> None:
        self._state = state
        self._status.publish(text_message(state))
        self.get_logger().info(HEALTH[state])

    def end(self) -> None:
        """Send nothing more; last words."""
        with self._lock:
            self._state = "idle"
            self.report(ended=True)

    def _tick(self) -> None:
        with self._lock:
            before, self._now = self._now, self.get_clock().now().nanoseconds
            if before == self._began == 0 and self._now >= LEAP:
                # Started before the first message on /clock was heard: the profile begins now.
                before = self._began = self._now
            if self._state in ("running", "done") and not 0 <= self._now - before < LEAP:
                # The drive was reset or restarted: the profile's time means nothing any more.
                self.get_logger().warning(
                    f"time leapt from {before / 1e9:g} to {self._now / 1e9:g} s"
                )
                self._enter("aborted")
            elif self._state != "idle":
                self._send()

    def _send(self) -> None:
        self._published += 1
        if self._state == "aborted":
            self._command.publish(command_message(0.0))
            return
        elapsed = (self._now - self._began) * 1e-9
        # The speed that is due when the next command comes: the drive goes there until then.
        self._command.publish(command_message(self.profile.speed(elapsed + self._period)))
        if self._state == "running" and elapsed >= self.profile.end:
            self._enter("done")


def report_until_stopped(node: ProfileController, stopping: threading.Event) -> None:
    """Once a second of the steady clock, and as soon as somebody else listens."""
    told, seen = -math.inf, -1
    while not stopping.wait(0.05):
        now, listeners = time.monotonic(), node.listeners
        if now - told >= REPORT_PERIOD or listeners != seen:
            told, seen = now, listeners
            node.report()
    node.end()


def main() -> None:
    """Entry point of the executable."""
    run_node(ProfileController, report_until_stopped)


if __name__ == "__main__":
    main()
