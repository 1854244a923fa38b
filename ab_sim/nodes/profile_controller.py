"""`profile_controller`: runs a start-up profile by publishing speed commands at a fixed rate."""

import math
import threading
import time
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.subscription import Subscription

from ab_msgs_py import ENDED, Health, Level, Qos, Task, topics
from ab_msgs_py.services import ABORT, START, Answer, serve_trigger
from ab_sim.errors import InputError
from ab_sim.nodes.log import PlainLog
from ab_sim.nodes.parameters import ParameterSpec, close_parameters, declare
from ab_sim.nodes.process import run_node
from ab_sim.nodes.profile_run import ProfileRun, ProfileState
from ab_sim.nodes.settings import Settings, Values
from ab_sim.scene.profile_file import AskedProfile, load_profile
from ab_sim.spindle import SpeedSchedule

REPORT_PERIOD = 1.0
"""s between two diagnostics."""
LEAP = 2_000_000_000
"""ns; a clock that goes on by more than this between two commands has leapt."""
FASTEST = 200.0
"""Times real time; faster than a simulator is asked to go, and what its clock does is a leap."""
RECORDER = "recorder"
"""Name of the node that hears commands, and obeys none."""
HEALTH = {
    ProfileState.IDLE: "waiting for ~/start",
    ProfileState.DONE: "profile done, holding its final speed",
    ProfileState.ABORTED: "aborted, commanding standstill",
}
"""What the status itself does not say well enough."""
# A board's sensor is often best effort, and one that is reliable is heard as well.
_VIBRATION = topics.VIBRATION._replace(qos=Qos(100, reliable=False))


class ProfileController(PlainLog):
    """What start-up firmware does: one speed command per period, along the profile.

    With ``use_sim_time`` it keeps the simulator's time, else the steady clock's, which nobody sets.
    """

    def __init__(self) -> None:
        super().__init__("profile_controller")
        self._settings = Settings(self)
        for meaning, wanted in (
            ("name or YAML file of a scene that has a profile, YAML file of a profile alone, or "
             "that in braces; read when it is set, the next ~/start takes it",
             ParameterSpec("profile", "thesis-hold")),
            ("changes to the scene, each key=value; the next ~/start takes them",
             ParameterSpec("changes", [""])),
        ):  # fmt: skip
            self._settings.declare(meaning, wanted)
        rate = declare(self, "command_rate", 200.0, "commands", "1/s", (1.0, 1000.0))
        auto_start = declare(self, "auto_start", False, "start as soon as there is a drive")
        self._slope = declare(
            self,
            "abort_deceleration",
            0.0,
            "of the ramp down after ~/abort; 0: the profile's own steepest",
            "rad/s^2",
            (0.0, 1e9),
        )
        silence = declare(
            self,
            "vibration_timeout",
            1.0,
            "without a good sample of it, where a condition needs the vibration, before an abort",
            "s",
            (0.001, 1e4),
        )
        close_parameters(self)
        self._judged: tuple[AskedProfile, float]
        self._judge(self._settings.values)
        self._period = 1.0 / rate
        self._lock = threading.Lock()
        self._simulated = bool(self.get_parameter("use_sim_time").value)
        self._began = self._now = 0
        self._ticked = time.monotonic()
        self._published = 0
        self._ended = False

        self._command = topics.COMMAND.publisher(self)
        self._status = topics.PROFILE_STATUS._replace(name="~/status").publisher(self)
        self._diagnostics = topics.DIAGNOSTICS.publisher(self)
        serve_trigger(self, START, self.start)
        serve_trigger(self, ABORT, self.abort)
        clock = self.get_clock() if self._simulated else Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(self._period, self._tick, clock=clock)
        if auto_start:
            steady = Clock(clock_type=ClockType.STEADY_TIME)
            self._waiting = self.create_timer(0.05, self._start_when_heard, clock=steady)
        # Last: it says that it waits, and who has read that may end the node in order.
        asked, slope = self._judged
        self.run = ProfileRun(asked, slope, self._period, silence, self._say)
        self._vibration: Subscription[Any] | None = None
        self._listen()
        self._settings.accept_changes(self._judge, self._apply)

    def start(self) -> Answer:
        """Run the profile from its beginning, now."""
        with self._lock:
            if refusal := self._missing():
                return False, refusal
            began = self._time()
            if refusal := self.run.start(began * 1e-9):
                return False, refusal
            self._began = self._now = began
            self._send(self.run.command)
            return True, f"started at t = {began / 1e9:g} s" if self._simulated else "started"

    def abort(self) -> Answer:
        """Stop the profile: ramp down to standstill."""
        with self._lock:
            before = self.run.state
            if refusal := self.run.abort(self._time() * 1e-9, "by ~/abort"):
                return False, refusal
            if before is ProfileState.WAITING:
                self._waiting.cancel()
                return True, "waiting no more"
            return True, "ramping down to standstill"

    @property
    def listeners(self) -> int:
        """How many nodes listen to the commands: the drive, and perhaps a recorder."""
        return self._command.get_subscription_count()

    @property
    def _obeyed(self) -> bool:
        """Whether somebody listens who is no recorder, which obeys none."""
        subscribers = self.get_subscriptions_info_by_topic(self._command.topic_name)
        return any(info.node_name != RECORDER for info in subscribers)

    def report(self, ended: bool = False) -> None:
        """Publish this node's health."""
        run = self.run
        message = HEALTH.get(run.state, run.status)
        if run.why and run.why not in message:
            message += f"; {run.why}"
        values = {
            "state": run.state.value,
            "status": run.status,
            "speed commanded [rad/s]": f"{run.command:.9g}",
            "command rate [1/s]": f"{1 / self._period:g}",
            "commands published": str(self._published),
            "listeners": str(self.listeners),
        }
        if run.vibration is not None:
            values["vibration, rms [m/s^2]"] = f"{run.vibration:.6g}"
        health = Health(
            self.get_fully_qualified_name(),
            Task.PROFILE,
            Level.WARN if run.why else Level.OK,
            ENDED if ended else message,
            values,
            time=self.get_clock().now().nanoseconds,
        )
        self._diagnostics.publish(topics.DIAGNOSTICS.message(health))

    def end(self) -> None:
        """Send nothing more; last words."""
        with self._lock:
            self._ended = True
            self.report(ended=True)

    def _judge(self, values: Values) -> None:
        """Read the profile of these; kept, for its file may be another one in a moment.

        Raises:
            SceneError, InputError: there is none, or it cannot be run.
        """
        asked = load_profile(values["profile"], filter(None, values["changes"]))
        self._judged = asked, self._slope or _steepest(asked)

    def _apply(self, before: Values, values: Values) -> None:
        with self._lock:
            self.run.take(*self._judged)
        self._listen()
        self.get_logger().info(f"the next ~/start takes {values['profile']}")

    def _listen(self) -> None:
        """To the vibration, if what is run next needs it."""
        if self._vibration is None and self.run.needs_vibration:
            self._vibration = _VIBRATION.subscription(self, self._hear)

    def _missing(self) -> str:
        """What a start still lacks; nothing, if it lacks nothing."""
        if self._simulated and topics.CLOCK.publishers(self) == 0:
            clock = self.resolve_topic_name(topics.CLOCK.name)
            return f"use_sim_time is set, but nobody publishes {clock}"
        if not self._obeyed:
            return f"nobody listens on {self._command.topic_name}: start the drive first"
        if self.run.needs_vibration and topics.VIBRATION.publishers(self) == 0:
            name = self.resolve_topic_name(topics.VIBRATION.name)
            return f"nobody publishes {name}, and a segment of the profile waits for the vibration"
        return ""

    def _start_when_heard(self) -> None:
        if self.run.state in (ProfileState.IDLE, ProfileState.WAITING):
            with self._lock:
                missing = self._missing()
                if not missing and self._simulated and self._time() == 0:
                    missing = "time stands at 0"  # or was not heard yet, and began long ago
                if missing:
                    self.run.wait(missing)
                    return
            if not self.start()[0]:
                return
        self._waiting.cancel()

    def _say(self, status: str, well: bool) -> None:
        self._status.publish(topics.PROFILE_STATUS.message(status))
        word, _, more = status.partition(": ")
        words = HEALTH.get(ProfileState(word), status)
        if more and more not in words:
            words += f"; {more}"
        if well:
            self.get_logger().info(words)
        else:
            self.get_logger().warning(words)

    def _time(self) -> int:
        return self.get_clock().now().nanoseconds if self._simulated else time.monotonic_ns()

    def _hear(self, message: Any) -> None:
        sample = _VIBRATION.sample(message)
        with self._lock:
            self.run.receive(self._time() * 1e-9, sample.frame, sample.time, sample.linear)

    def _tick(self) -> None:
        with self._lock:
            if self._ended:
                return
            before, self._now = self._now, self._time()
            # At a hundred times real time a moment's delay is seconds, and no leap.
            since, self._ticked = time.monotonic() - self._ticked, time.monotonic()
            far = max(LEAP, round(1e9 * FASTEST * since))
            if before == self._began == 0 and self._now >= LEAP:
                # Started before the first message on /clock was heard: the profile begins now.
                before = self._began = self._now
                self.run.shift(self._now * 1e-9)
            leapt = f"time leapt from {before / 1e9:g} to {self._now / 1e9:g} s"
            if self.run.state not in (
                ProfileState.IDLE,
                ProfileState.WAITING,
                ProfileState.ABORTED,
            ):
                if self._now < before:
                    # The drive was reset or restarted, and stands where it stood at first.
                    self.get_logger().warning(leapt)
                    self.run.drop(leapt)
                elif self._now - before >= far:
                    self.get_logger().warning(leapt)
                    self.run.abort(self._now * 1e-9, leapt)
            self._send(self.run.tick(self._now * 1e-9))

    def _send(self, speed: float | None) -> None:
        if speed is not None:
            self._published += 1
            self._command.publish(topics.COMMAND.message(speed))


def _steepest(asked: AskedProfile) -> float:
    steepest = SpeedSchedule.asked(*asked).steepest
    if not steepest > 0.0:
        raise InputError(
            "parameter abort_deceleration = 0: the profile only holds its speed and has no "
            "steepest of its own; give a deceleration [rad/s^2]"
        )
    return steepest


def report_until_stopped(node: ProfileController, stopping: threading.Event) -> None:
    """Once a second of the steady clock, and as soon as somebody else listens or it goes on."""
    reported, seen = -math.inf, (-1, "")
    while not stopping.wait(0.05):
        now, present = time.monotonic(), (node.listeners, node.run.status)
        if now - reported >= REPORT_PERIOD or present != seen:
            reported, seen = now, present
            node.report()
    node.end()


def main() -> None:
    """Entry point of the executable."""
    run_node(ProfileController, report_until_stopped)


if __name__ == "__main__":
    main()
