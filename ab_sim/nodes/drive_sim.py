"""`drive_sim`: one drive in real time, commanded and observed over topics."""

import contextlib
import threading
import time
import uuid
from collections.abc import Iterator
from typing import Any

from rclpy.node import Node
from rclpy.subscription import Subscription

from ab_msgs_py import ENDED, Block, Health, Level, topics
from ab_msgs_py.samples import clock_message, description_message
from ab_msgs_py.services import PAUSE, RESET, STEP, Answer, serve_switch, serve_trigger
from ab_sim.accuracy import resolve_accuracy
from ab_sim.accuracy.live_checks import LiveChecks
from ab_sim.drive import Drive
from ab_sim.drive.description import describe
from ab_sim.drive.trajectory import Trajectory
from ab_sim.errors import DivergedError
from ab_sim.integrate.registry import AUTO
from ab_sim.nodes.commands import Commands
from ab_sim.nodes.drive_health import DriveHealth, Tolerance
from ab_sim.nodes.observed import Observed
from ab_sim.nodes.pacing import Pacer
from ab_sim.nodes.parameters import close_parameters, declare, whole_ratio
from ab_sim.nodes.process import run_node
from ab_sim.scene import load_scene

LONGEST_CHECK = 0.25
"""Of the time between two wake-ups, the most that a check of the error may take at one of them."""


class DriveSim(Node):
    """Steps a drive as the steady clock asks for it; the authority on simulated time."""

    def __init__(self) -> None:
        super().__init__("drive_sim")
        name = declare(self, "scene", "thesis-hold", "name or YAML file of the scene to simulate")
        changes = declare(self, "changes", [""], "changes to the scene, each key=value")
        wake = declare(
            self, "wake_rate", 250.0, "wake-ups, each publishing once", "1/s", (1.0, 2000.0)
        )
        blocks = declare(self, "block_rate", 50.0, "blocks of samples", "1/s", (0.1, 1000.0))
        patience = declare(
            self, "patience", 0.5, "lag beyond which steps are dropped", "s", (0.01, 60.0)
        )
        catch_up = declare(
            self, "catch_up", 10.0, "most steps at one wake-up, in wake-ups", "1", (1.0, 1e4)
        )
        tolerance = Tolerance(
            declare(
                self,
                "factor_tolerance",
                0.05,
                "how far the real-time factor may be from 1 without a warning",
                "1",
                (0.001, 1.0),
            ),
            declare(
                self,
                "lateness_tolerance",
                0.1,
                "how late a wake-up may be without a warning",
                "s",
                (0.001, 60.0),
            ),
        )
        share = declare(
            self,
            "error_checks",
            0.05,
            "most of the loop's CPU time that estimating the error may take; 0: no estimate",
            "1",
            (0.0, 0.5),
        )
        self._paused = declare(self, "start_paused", False, "wait for ~/pause with false")
        close_parameters(self)

        scene = load_scene(name, filter(None, changes))
        if scene.accuracy is not None:
            self.get_logger().info(f"{scene.name}: measuring what delivers the accuracy asked for")
        scene, price = resolve_accuracy(scene, period=1.0 / wake, commanded=True)
        self.drive = Drive(scene, commanded=True)
        step = self.drive.step
        self._checks: LiveChecks | None = None
        if share > 0:
            self._checks = LiveChecks(self.drive, share, longest=LONGEST_CHECK / wake)
        self._stepped: Drive | LiveChecks = self._checks or self.drive
        self._per_wake = whole_ratio(1.0 / wake, step, "period of wake_rate over the scene's step")
        self._per_block = whole_ratio(1.0 / blocks, 1.0 / wake, "period of block_rate")
        self._pacer = Pacer(step, self._per_wake, int(catch_up * self._per_wake), patience)
        self._step_ns = round(step * 1e9)

        self._lock = threading.Lock()
        self._pending: list[Trajectory] = []
        self._wakes = 0
        self._trouble = ""
        self._health = DriveHealth(self.drive, self._pacer, self._checks, tolerance, price)

        self._observed = Observed(self, scene)
        self._block = topics.BLOCK.publisher(self)
        self._clock_topic = topics.CLOCK.publisher(self)
        self._diagnostics = topics.DIAGNOSTICS.publisher(self)
        self._description = topics.DESCRIPTION.publisher(self)
        self._commands = Commands(self, self.drive.servo)
        self._sources = 0
        serve_switch(self, PAUSE, self.pause)
        serve_trigger(self, STEP, self.step_once)
        serve_trigger(self, RESET, self.reset)

        self._warm_up()
        # Latched, and only now: who has read it knows that the drive is ready.
        accuracy = None if price is None else price.report()
        # By its number, one that was started again is told from one that was heard of again.
        run = {"run": uuid.uuid4().hex}
        self._description.publish(description_message(describe(scene, accuracy) | run))
        chosen = scene.solver.stepper == AUTO or price is not None
        reason = f" ({self._health.stepper_chosen})" if chosen else ""
        what = ", ".join([f"{scene.balls.count} balls", *scene.effects, *scene.sensors])
        self.get_logger().info(
            f"{scene.name}: {what}; {self.drive.stepper.name} at {step:g} s{reason}"
            + (", paused" if self._paused else "")
        )

    @property
    def subscriptions(self) -> Iterator[Subscription[Any]]:
        """What the executor answers: all but the commands, which wake-ups take themselves."""
        return (s for s in super().subscriptions if s is not self._commands.subscription)

    def run(self, stopping: threading.Event) -> None:
        """Wake up, step what is due, publish; until told to stop."""
        with self._lock:
            self._publish()
            self._restart_clock()
        while not stopping.wait(self._pacer.wait(time.monotonic())):
            with self._lock:
                begin = time.thread_time()
                self._commands.take()
                if self._paused:
                    self._pacer.start(time.monotonic())
                # After catching up nothing may be due; time that stands still is not published.
                elif due := self._pacer.due(time.monotonic()):
                    self._advance(due)
                self._report_now_and_then()
                if self._checks is not None:
                    # Last: what has been published does not wait for it.
                    self._checks.work(time.thread_time() - begin)
        with self._lock:
            self._commands.take()
            self._flush()
            self._report(ended=True)

    def pause(self, pause: bool) -> Answer:
        """Pause, or resume; simulated time stands still meanwhile."""
        with self._lock:
            if pause == self._paused:
                return True, "paused already" if pause else "running already"
            if not pause and self._trouble:
                return False, f"{self._trouble}; reset first"
            self._settle()
            self._paused = pause
            self._restart_clock()
            return True, "paused" if pause else "running"

    def step_once(self) -> Answer:
        """One wake-up's steps while paused."""
        with self._lock:
            if not self._paused:
                return False, "not paused: pause first"
            if self._trouble:
                return False, f"{self._trouble}; reset first"
            self._commands.take()
            self._advance(self._per_wake)
            return not self._trouble, self._trouble or f"t = {self.drive.time:.9g} s"

    def reset(self) -> Answer:
        """Back to t = 0 and the scene's start; a command under way is forgotten."""
        with self._lock:
            self._settle()
            if self.drive.steps:
                self._flush()
            self._report()
            self._stepped.reset()
            self._commands.newest()
            self._trouble = ""
            self._pending = [self.drive.present()]
            self._publish()
            self._restart_clock()
            self.get_logger().info("reset to t = 0")
            return True, "t = 0"

    def _warm_up(self) -> None:
        # Nothing may be compiled inside the real-time loop: go once through all it will call.
        with contextlib.suppress(DivergedError):  # The loop will find that too, and say so.
            self.drive.advance(self._per_wake)
            self.drive.command(self.drive.servo.max_speed)
            self.drive.advance(self._per_wake)
        if self._checks is not None:
            self._checks.warm_up(self.drive.servo.max_speed, self._per_wake)
        self.drive.observe()
        self.drive.reset()
        self._pending = [self.drive.present()]

    def _restart_clock(self) -> None:
        now = time.monotonic()
        self._pacer.start(now)
        self._health.begin(now)

    def _settle(self) -> None:
        """A last wake-up before time stands still: no lag is forgotten."""
        self._commands.take()
        if not self._paused and (due := self._pacer.stop(time.monotonic())):
            self._advance(due)

    def _advance(self, steps: int) -> None:
        if (speed := self._commands.newest()) is not None:
            self._stepped.command(speed)
        try:
            self._pending.append(self._stepped.advance(steps))
        except DivergedError as error:
            self._trouble = str(error)
            self._paused = True
            self.get_logger().error(f"paused: {error}")
            self._flush()
            self._report()
            return
        self._publish()
        self._wakes += 1
        if self._wakes % self._per_block == 0:
            self._flush()

    def _publish(self) -> None:
        time_ns = self.drive.steps * self._step_ns
        self._observed.publish(time_ns, self.drive.observe())
        self._clock_topic.publish(clock_message(time_ns))

    def _flush(self) -> None:
        """Publish the samples since the last block."""
        if self._pending:
            block = Trajectory.join(self._pending)
            self._pending = []
            if len(block):
                self._block.publish(Block(block.channels, block.samples).message())

    def _report_now_and_then(self) -> None:
        """Once a second, and as soon as somebody else can command."""
        due = self._health.period_over(time.monotonic(), self._paused)
        sources, self._sources = self._sources, self._commands.sources
        if due or sources != self._sources:
            self._report()

    def _report(self, ended: bool = False) -> None:
        news = self._health.news()
        level = Level.WARN if news else Level.OK
        text = "; ".join([self._health.state(self._paused), *news])
        if self._trouble:
            level, text = Level.ERROR, self._trouble
        elif topics.CLOCK.publishers(self) > 1:
            level = Level.ERROR
            clock = self.resolve_topic_name(topics.CLOCK.name)
            text = f"another simulator publishes {clock}: remap one of them, or use another domain"
        health = Health(
            self.get_fully_qualified_name(),
            level,
            ENDED if ended else text,
            {
                **self._health.values(),
                "sources of commands": str(self._sources),
                "commands accepted": str(self._commands.accepted),
                "commands rejected": str(self._commands.rejected),
            },
        )
        self._diagnostics.publish(health.message_at(self.drive.steps * self._step_ns))
        if refusals := self._commands.refusals():
            self.get_logger().warning(refusals)


def main() -> None:
    """Entry point of the executable."""
    run_node(DriveSim, DriveSim.run)


if __name__ == "__main__":
    main()
