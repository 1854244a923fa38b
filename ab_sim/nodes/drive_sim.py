"""`drive_sim`: one drive in real time, commanded and observed over topics."""

import collections
import contextlib
import math
import threading
import time

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from std_msgs.msg import Float64

from ab_msgs_py import ENDED, Block, Health, JointSample, Level, VectorSample, topics
from ab_msgs_py.samples import ACCELEROMETER, clock_message, command_of, description_message
from ab_msgs_py.services import PAUSE, RESET, STEP, Answer, serve_switch, serve_trigger
from ab_sim.description import describe
from ab_sim.drive import Drive
from ab_sim.error_checks import ErrorChecks
from ab_sim.errors import CommandError, DivergedError
from ab_sim.integrate.registry import AUTO
from ab_sim.nodes.pacing import Pacer
from ab_sim.nodes.parameters import declare, refuse_undeclared, whole_ratio
from ab_sim.nodes.process import run_node
from ab_sim.price import share_of
from ab_sim.scene import load_scene
from ab_sim.trajectory import Trajectory

STEADY = Clock(clock_type=ClockType.STEADY_TIME)
REPORT_PERIOD = 1.0
"""s between two diagnostics."""
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
        share = declare(
            self,
            "error_checks",
            0.05,
            "most of the loop's CPU time that estimating the error may take; 0: no estimate",
            "1",
            (0.0, 0.5),
        )
        self._paused = declare(self, "start_paused", False, "wait for ~/pause with false")
        refuse_undeclared(self)

        scene = load_scene(name, filter(None, changes))
        if scene.accuracy is not None:
            self.get_logger().info(f"{scene.name}: measuring what delivers the accuracy asked for")
        self.drive = Drive(scene, commanded=True, period=1.0 / wake)
        scene, step = self.drive.scene, self.drive.step
        self._checks: ErrorChecks | None = None
        if share > 0:
            self._checks = ErrorChecks(self.drive, share, longest=LONGEST_CHECK / wake)
        self._stepped: Drive | ErrorChecks = self._checks or self.drive
        self._per_wake = whole_ratio(1.0 / wake, step, "period of wake_rate over the scene's step")
        self._per_block = whole_ratio(1.0 / blocks, 1.0 / wake, "period of block_rate")
        self._pacer = Pacer(step, self._per_wake, int(catch_up * self._per_wake), patience)
        self._step_ns = round(step * 1e9)

        self._lock = threading.Lock()
        # Commands between two wake-ups act at the same instant, so only the last one matters.
        self._command: collections.deque[float] = collections.deque(maxlen=1)
        self._pending: list[Trajectory] = []
        self._wakes = 0
        self._accepted = self._rejected = 0
        self._trouble = ""
        self._report_at = (time.monotonic(), 0)
        self._factor = math.nan  # not measured yet
        self._dropped = self._crowded = 0

        self._joints = topics.JOINT_STATES.publisher(self)
        self._vibration = topics.VIBRATION.publisher(self)
        self._whirl = topics.WHIRL.publisher(self)
        self._block = topics.BLOCK.publisher(self)
        self._clock_topic = topics.CLOCK.publisher(self)
        self._diagnostics = topics.DIAGNOSTICS.publisher(self)
        self._description = topics.DESCRIPTION.publisher(self)
        self._subscription = topics.COMMAND.subscription(self, self._judge)
        self._sources = 0
        serve_switch(self, PAUSE, self.pause)
        serve_trigger(self, STEP, self.step_once)
        serve_trigger(self, RESET, self.reset)

        self._warm_up()
        # Latched, and only now: who has read it knows that the drive is ready.
        self._description.publish(description_message(describe(scene, self.drive.price)))
        chosen = scene.solver.stepper == AUTO or self.drive.price is not None
        reason = f" ({self.drive.choice.reason})" if chosen else ""
        self.get_logger().info(
            f"{scene.name}: {scene.balls.count} balls, {', '.join(scene.effects)}; "
            f"{self.drive.stepper.name} at {step:g} s{reason}"
            + (", paused" if self._paused else "")
        )

    def run(self, stopping: threading.Event) -> None:
        """Wake up, step what is due, publish; until told to stop."""
        with self._lock:
            self._publish()
            self._restart_clock()
        while not stopping.wait(self._pacer.wait(time.monotonic())):
            with self._lock:
                begin = time.thread_time()
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
            self._flush()
            self._report(ended=True)

    def pause(self, pause: bool) -> Answer:
        """Pause, or resume; simulated time stands still meanwhile."""
        with self._lock:
            if pause == self._paused:
                return True, "paused already" if pause else "running already"
            if not pause and self._trouble:
                return False, f"{self._trouble}; reset first"
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
            self._advance(self._per_wake)
            return not self._trouble, self._trouble or f"t = {self.drive.time:.9g} s"

    def reset(self) -> Answer:
        """Back to t = 0 and the scene's start; a command under way is forgotten."""
        with self._lock:
            if self.drive.steps:
                self._flush()
            self._stepped.reset()
            self._command.clear()
            self._trouble = ""
            self._crowded = 0
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
        self._dropped = 0
        self._factor = math.nan
        self._report_at = (now, self.drive.steps)

    def _judge(self, message: Float64) -> None:
        """Take a command, or reject it, as soon as it comes; it acts from the next step on."""
        try:
            self._command.append(self.drive.servo.check(command_of(message)))
            self._accepted += 1
        except CommandError as error:
            self._rejected += 1
            self.get_logger().warning(
                f"rejected: {error}",
                throttle_duration_sec=1.0,
                throttle_time_source_type=STEADY,
            )

    def _advance(self, steps: int) -> None:
        if self._command:
            self._stepped.command(self._command.popleft())
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
        now = self.drive.observe()
        time_ns = self.drive.steps * self._step_ns
        joints = JointSample(
            time_ns,
            now.psi,
            now.omega,
            tuple(now.theta.tolist()),
            tuple(now.theta_rate.tolist()),
            tuple((-now.driving_force * self.drive.scene.race.radius).tolist()),
            None if math.isnan(now.motor_torque) else now.motor_torque,
        )
        self._joints.publish(joints.message())
        if now.accelerometer is None:
            vibration = VectorSample(time_ns, *now.acceleration.tolist())
        else:
            x, y = now.accelerometer.tolist()
            vibration = VectorSample(time_ns, x, y, ACCELEROMETER)
        self._vibration.publish(vibration.vibration_message())
        x, y = now.position.tolist()
        self._whirl.publish(VectorSample(time_ns, x, y).whirl_message())
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
        now, (since, steps) = time.monotonic(), self._report_at
        if now - since >= REPORT_PERIOD:
            if not self._paused:
                self._factor = (self.drive.steps - steps) * self.drive.step / (now - since)
            self._report_at = (now, self.drive.steps)
        elif self._subscription.get_publisher_count() == self._sources:
            return
        self._sources = self._subscription.get_publisher_count()
        self._report()

    def _news(self) -> list[str]:
        """What has gone less than well since the last report."""
        dropped = self._pacer.total.dropped - self._dropped
        crowded = self.drive.crowded_steps - self._crowded
        news = [f"fell behind: {dropped} steps were dropped"] if dropped > 0 else []
        if crowded > 0:
            news.append(
                f"{crowded} steps had too many events to locate them all; a shorter solver.step "
                "would be more accurate"
            )
        return [*news, *self._drift()]

    def _drift(self) -> list[str]:
        """Whether the run has left what was asked for."""
        price = self.drive.price
        if self._checks is None or price is None:
            return []
        angle, whirl = self._checks.estimate
        if share_of(price.asked, angle, whirl) <= 1.0:
            return []
        wishes = [
            f"{key} {found:.1e} {unit} (asked {wish:g})"
            for key, found, wish, unit in (
                ("ball angle", angle, price.asked.angle, "rad"),
                ("whirl", whirl, price.asked.whirl, price.unit),
            )
            if wish is not None and found > wish
        ]
        return [
            f"less accurate than asked, error estimate of {', '.join(wishes)}: the step was "
            "measured on the scene's profile, and the drive is led elsewhere; ask for more "
            "accuracy, or for a profile like this run"
        ]

    def _estimates(self) -> dict[str, str]:
        """What is known of the error, for the diagnostics; nothing without checks."""
        checks = self._checks
        if checks is None:
            return {}
        unit = self.drive.scene.whirl_unit[1]
        return {
            "error estimate, ball angle [rad]": f"{checks.estimate.angle:.2g}",
            f"error estimate, whirl [{unit}]": f"{checks.estimate.whirl:.2g}",
            "largest error estimate, ball angle [rad]": f"{checks.largest.angle:.2g}",
            f"largest error estimate, whirl [{unit}]": f"{checks.largest.whirl:.2g}",
            "error checks' share of work": f"{checks.share:.4f}",
            "steps checked": str(checks.checked),
        }

    def _report(self, ended: bool = False) -> None:
        pacing, drive, scene = self._pacer.total, self.drive, self.drive.scene
        level, text = Level.OK, "paused" if self._paused else "running in real time"
        if self._trouble:
            level, text = Level.ERROR, self._trouble
        elif self.count_publishers(topics.CLOCK.name) > 1:
            level = Level.ERROR
            text = "another simulator publishes /clock: remap one of them, or use another domain"
        elif news := self._news():
            level, text = Level.WARN, "; ".join(news)
        if ended:
            text = ENDED
        self._dropped, self._crowded = pacing.dropped, drive.crowded_steps
        health = Health(
            self.get_fully_qualified_name(),
            level,
            text,
            {
                "real-time factor": f"{self._factor:.4f}",
                "simulated time [s]": f"{drive.time:.9g}",
                "overruns": str(pacing.overruns),
                "steps dropped": str(pacing.dropped),
                "worst lateness [s]": f"{pacing.worst_lateness:.6f}",
                "sources of commands": str(self._sources),
                "commands accepted": str(self._accepted),
                "commands rejected": str(self._rejected),
                "scene": scene.name,
                "stepper": drive.stepper.name,
                "stepper chosen": drive.choice.reason,
                "step [s]": f"{drive.step:g}",
                "events": str(drive.events),
                "crowded steps": str(drive.crowded_steps),
                "effects": ", ".join(scene.effects),
                **self._estimates(),
            },
        )
        self._diagnostics.publish(health.message_at(drive.steps * self._step_ns))


def main() -> None:
    """Entry point of the executable."""
    run_node(DriveSim, DriveSim.run)


if __name__ == "__main__":
    main()
