"""`drive_sim`: one drive in real time, commanded and observed over topics."""

import threading
import time
import uuid
from collections.abc import Iterator
from typing import Any

from rclpy.node import Node
from rclpy.service import Service
from rclpy.subscription import Subscription

from ab_msgs_py import ENDED, Block, Health, Level, topics
from ab_msgs_py.samples import clock_message, description_message
from ab_msgs_py.services import answer_waiting
from ab_sim.drive.trajectory import Trajectory
from ab_sim.errors import DivergedError
from ab_sim.nodes.command_path import CommandPath
from ab_sim.nodes.commanded import Commanded
from ab_sim.nodes.commands import Commands
from ab_sim.nodes.drive_control import DriveControl
from ab_sim.nodes.drive_settings import (
    TimeMode,
    drive_settings,
    fixed_settings,
    mode_of,
    rules_of,
    tolerance_of,
)
from ab_sim.nodes.in_turn import InTurn
from ab_sim.nodes.observed import Observed
from ab_sim.nodes.parameters import close_parameters, whole_ratio
from ab_sim.nodes.prepared import Prepared, scene_of
from ab_sim.nodes.process import run_node
from ab_sim.nodes.settings import Values
from ab_sim.nodes.stages import Stages
from ab_sim.scene import Scene


class DriveSim(Node):
    """Steps a drive as the steady clock asks for it; the authority on simulated time.

    What is public is for the loop's thread, or for whoever has the ``turn``.
    """

    def __init__(self) -> None:
        super().__init__("drive_sim")
        fixed = fixed_settings(self)
        self.rates, self.paused, self._hardening = fixed.rates, fixed.paused, fixed.hardening
        self.settings = drive_settings(self)
        close_parameters(self)
        values = self.settings.values
        self.turn = InTurn()
        self.stopping = threading.Event()
        self.trouble = ""
        self.pending: list[Trajectory] = []
        self._wakes = 0
        self._stages = Stages("inputs", "integration", "observing", "publishing")

        self._observed = Observed(self)
        self._block = topics.BLOCK.publisher(self)
        self._clock_topic = topics.CLOCK.publisher(self) if fixed.clock else None
        self._diagnostics = topics.DIAGNOSTICS.publisher(self)
        self._description = topics.DESCRIPTION.publisher(self)
        # By its number, one that was started again is told from one that was heard of again.
        self._run = {"run": uuid.uuid4().hex}
        prepared = self.prepare(scene_of(values["scene"], values["changes"], self.rates))
        self._per_block = whole_ratio(
            1.0 / self.rates.block, 1.0 / self.rates.wake, "period of block_rate"
        )
        self.path = CommandPath(
            prepared.drive.servo, prepared.drive.step, rules_of(values), fixed.seed
        )
        self.commands = Commands(self, self.path)
        self.control = DriveControl(self)
        self.begin(prepared)
        self.settings.follow(self._judge, self._apply)

    @property
    def subscriptions(self) -> Iterator[Subscription[Any]]:
        """What the executor answers: all but the commands, which wake-ups take themselves."""
        return (s for s in super().subscriptions if s is not self.commands.subscription)

    @property
    def services(self) -> Iterator[Service[Any, Any]]:
        """What the executor answers: all but the emergency stop, which waits for nobody."""
        return (s for s in super().services if s is not self.control.urgent)

    @property
    def mode(self) -> TimeMode:
        """What makes time go on."""
        return mode_of(self.settings.values)

    @property
    def standing(self) -> bool:
        """Whether time stands still until it is asked to go on."""
        return self.paused or self.mode is TimeMode.LOCK_STEP

    def prepare(self, scene: Scene) -> Prepared:
        """Make a scene ready, which may take long; what runs goes on meanwhile."""
        values = self.settings.values
        say = self.get_logger().info
        return Prepared(scene, self.rates, values["error_checks"], tolerance_of(values), say)

    def begin(self, prepared: Prepared) -> None:
        """Run this from now on."""
        self.now = prepared
        self.led = Commanded(prepared.drive, self.path, prepared.checks)
        self.pending = [prepared.drive.present()]
        self._observed.begin(prepared.scene)
        # Latched, and only now: who has read it knows that the drive is ready.
        self._description.publish(description_message(prepared.description() | self._run))
        self.get_logger().info(prepared.words() + (", paused" if self.paused else ""))

    def run(self, stopping: threading.Event) -> None:
        """Wake up, step what is due, publish; until told to stop."""
        self.stopping = stopping
        for refusal in self._hardening.apply():
            self.get_logger().warning(refusal)
        with self.turn:
            self.publish()
            self.restart_clock()
        while not stopping.wait(self._rest()):
            answer_waiting(self.control.urgent)
            with self.turn:
                self._wake()
        with self.turn:
            self.take_commands()
            self.flush()
            self.report(ended=True)

    def take_commands(self) -> None:
        """Put on their path what has come."""
        self.commands.take(self.now.drive.steps)

    def advance(self, steps: int) -> None:
        """Take steps and publish what comes of them; a drive that diverges is paused."""
        self._stages.begin()
        try:
            for part in self.led.advance(steps):
                self.pending.append(part)
        except DivergedError as error:
            self.trouble = str(error)
            self.paused = True
            self.get_logger().error(f"paused: {error}")
            self.flush()
            self.report()
            return
        self._stages.end("integration")
        self.publish()
        self.commands.shown()
        self._wakes += 1
        if self._wakes % self._per_block == 0:
            self.flush()
        self._stages.end("publishing")

    def settle(self) -> None:
        """A last wake-up before time stands still: no lag is forgotten."""
        self.take_commands()
        if not self.standing and self.mode is TimeMode.PACED:
            if due := self.now.pacer.stop(time.monotonic()):
                self.advance(due)

    def restart_clock(self) -> None:
        """Time stands still, or goes on, from now on."""
        now, values = time.monotonic(), self.settings.values
        self.now.health.paced = self.mode is TimeMode.PACED
        self.now.pacer.start(now, values["speed_factor"])
        self.now.health.begin(now)

    def publish(self) -> None:
        """Publish the present."""
        self._stages.begin()
        observation = self.now.drive.observe()
        self._stages.end("observing")
        self._observed.publish(self.now.time_ns, observation)
        self.publish_clock()

    def publish_clock(self) -> None:
        """Publish simulated time."""
        if self._clock_topic is not None:
            self._clock_topic.publish(clock_message(self.now.time_ns))

    def flush(self) -> None:
        """Publish the samples since the last block."""
        if self.pending:
            block = Trajectory.join(self.pending)
            self.pending = []
            if len(block):
                self._block.publish(Block(block.channels, block.samples).message())

    def report(self, ended: bool = False) -> None:
        """Publish this node's health."""
        health = self.now.health
        news = [*health.news(), *self.commands.news()]
        level = Level.WARN if news else Level.OK
        text = "; ".join([self._state(), *news])
        if self.trouble:
            level, text = Level.ERROR, self.trouble
        elif self._clock_topic is not None and topics.CLOCK.publishers(self) > 1:
            level = Level.ERROR
            clock = self.resolve_topic_name(topics.CLOCK.name)
            text = f"another simulator publishes {clock}: remap one of them, or use another domain"
        values = {
            **health.values(),
            **self._stages.values(),
            **self.commands.values(self.now.drive.steps),
            "time": self.mode.value,
            "scheduling": self._hardening.words,
        }
        told = Health(self.get_fully_qualified_name(), level, ENDED if ended else text, values)
        self._diagnostics.publish(told.message_at(self.now.time_ns))
        if refusals := self.commands.refusals():
            self.get_logger().warning(refusals)

    def _state(self) -> str:
        if self.mode is TimeMode.LOCK_STEP:
            return "lock-step: time goes on by ~/step"
        return self.now.health.state(self.paused)

    def _rest(self) -> float:
        """How long to sleep [s]."""
        if self.mode is TimeMode.FREE and not self.paused:
            return 0.0
        return self.now.pacer.wait(time.monotonic())

    def _wake(self) -> None:
        """What is to be done at a wake-up."""
        begin, pacer = time.thread_time(), self.now.pacer
        self._stages.begin()
        self.take_commands()
        self._stages.end("inputs")
        if self.standing:
            pacer.start(time.monotonic())
        elif self.mode is TimeMode.FREE:
            self.advance(self.now.per_wake)
        # After catching up nothing may be due; time that stands still is not published.
        elif due := pacer.due(time.monotonic()):
            self.advance(due)
        self._report_now_and_then()
        if self.led.checks is not None:
            # Last: what has been published does not wait for it.
            self.led.checks.work(time.thread_time() - begin)

    def _report_now_and_then(self) -> None:
        """Once a second, and as soon as somebody else can command."""
        due = self.now.health.period_over(time.monotonic(), self.standing)
        if self.commands.others_came() or due:
            self.report()
        if due:
            if self.standing:
                # For those who come late: a clock that says nothing might be none.
                self.publish_clock()
            self._hardening.spare_moment()

    def _judge(self, values: Values) -> None:
        held = self.settings.values
        if any(values[name] != held[name] for name in ("scene", "changes")):
            scene_of(values["scene"], values["changes"], self.rates)

    def _apply(self, before: Values, values: Values) -> None:
        changed = {name for name in values if values[name] != before[name]}
        checks = self.led.checks
        if "error_checks" in changed:
            checks = self.now.checks_for(values["error_checks"])
        with self.turn:
            if changed & {"time_mode", "speed_factor"}:
                # With what held until now: the pacer still has it.
                if mode_of(before) is TimeMode.PACED and not self.paused:
                    self.take_commands()
                    if due := self.now.pacer.stop(time.monotonic()):
                        self.advance(due)
                self.restart_clock()
            self.path.rules = rules_of(values)
            self.now.health.tolerance = tolerance_of(values)
            self.now.health.checks = checks
            self.led.check_with(checks)


def main() -> None:
    """Entry point of the executable."""
    run_node(DriveSim, DriveSim.run)


if __name__ == "__main__":
    main()
