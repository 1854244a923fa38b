"""Session of a drive's node, from the loading of a scene to its unloading."""

import time
import uuid
from collections.abc import Callable

from ab_msgs_py import Level, topics
from ab_sim.base.errors import DivergedError
from ab_sim.drive.accuracy.live_checks import LiveChecks
from ab_sim.drive.faults.active import transfer_faults
from ab_sim.drive.trajectory import Trajectory
from ab_sim.nodes.base_node import ManagedNode
from ab_sim.nodes.command_path import CommandPath
from ab_sim.nodes.commands import PendingCommands
from ab_sim.nodes.drive_health import NewWarnings
from ab_sim.nodes.drive_settings import TimeMode, mode_of, real_time_of, rules_of, tolerance_of
from ab_sim.nodes.outputs import FaultPublisher, Outputs
from ab_sim.nodes.pacing import StageTimer
from ab_sim.nodes.parameters import Parameters, Values
from ab_sim.nodes.prepared_drive import CommandedDrive, PreparedDrive, Rates

INACTIVE = "inactive: time is stopped until the node is activated"


class Session:
    """Advances a drive by the steady clock, and publishes its state; the source of simulated time.

    Public methods are for the main loop's thread, or for a thread that holds the node's lock.

    Parameters
    ----------
    node
        Node of the session.
    outputs
        Publishers of the node.
    rates
        Rates of the main loop.
    settings
        Parameters of the node, see ``apply_settings``.
    prepared
        Drive to run.
    """

    def __init__(
        self,
        node: ManagedNode,
        outputs: Outputs,
        rates: Rates,
        settings: Parameters,
        prepared: PreparedDrive,
    ) -> None:
        self._node, self._outputs, self._settings = node, outputs, settings
        values = settings.values
        self._real_time, self.paused = real_time_of(values), values["start_paused"]
        self.active = False
        """True if the node is active."""
        self.stopped = True
        """True after a start or a stop, until time advances or is paused."""
        self._per_state, self._per_block = rates.per_state, rates.per_block
        self.trouble = ""
        """Reason why the drive has diverged; empty if it has not."""
        self.pending: list[Trajectory] = []
        """Samples since the last block."""
        self.stepped_for = 0
        """Number of commands received before the last wake-up of ~/step; see ``new_commands``."""
        self._wakes, self._reported, self._new = 0, False, NewWarnings()
        self._stages = StageTimer("inputs", "integration", "observing", "publishing")
        drive = prepared.drive
        self.path = CommandPath(drive.servo, drive.step, rules_of(values), values["jitter_seed"])
        self._commands = PendingCommands(node, self.path)
        self._description = topics.DESCRIPTION.publisher(node)
        self.fault_publisher = FaultPublisher(node)
        # The random number distinguishes the description of a restarted drive from a repeated one.
        self._run = {"run": uuid.uuid4().hex}
        self.now = prepared
        self.begin(prepared)

    @property
    def mode(self) -> TimeMode:
        """Way in which simulated time advances."""
        return mode_of(self._settings.values)

    @property
    def new_commands(self) -> int:
        """Number of commands received since the last wake-up of ~/step, or the last reset."""
        return self.path.received - max(self.stepped_for, self.path.forgotten)

    @property
    def standing(self) -> bool:
        """True if time only advances on request."""
        return self.paused or self.mode is TimeMode.LOCK_STEP

    def begin(self, prepared: PreparedDrive) -> None:
        """Replace the session's drive by a prepared one, and publish its description."""
        prepared.pacer.continue_counts(self.now.pacer)
        self.now = prepared
        self.commanded = CommandedDrive(prepared.drive, self.path, prepared.checks)
        self.pending = [prepared.drive.present()]
        self._outputs.begin(prepared.scene, prepared.drive.channels)
        self.fault_publisher.publish(())
        # Published last, because it signals that the drive is ready.
        description = prepared.description() | self._run
        self._description.publish(topics.DESCRIPTION.message(description))
        self._node.get_logger().info(prepared.words() + (", paused" if self.paused else ""))

    def replace_drive(self, prepared: PreparedDrive) -> None:
        """Continue from the present state with a drive that differs only in faults."""
        faults = transfer_faults(self.now.drive, prepared.drive, self.commanded.faults)
        self.now = prepared
        self.commanded = CommandedDrive(prepared.drive, self.path, prepared.checks, faults)
        self.pending = self.pending and [prepared.drive.present()]
        self.fault_publisher.publish(prepared.drive.faults)

    def activate(self) -> None:
        """Subscribe to commands, and start time."""
        for refusal in self._real_time.apply():
            self._node.get_logger().warning(refusal)
        self._commands.listen()
        self.active = True
        self.publish()
        self.restart_clock()

    def deactivate(self) -> None:
        """Stop time, publish the last samples, and unsubscribe from commands."""
        self.step_before_pause()
        self.finish(INACTIVE)
        self.now.health.begin(time.monotonic())
        self._commands.close()
        self.active = False

    def finish(self, text: str) -> None:
        """Publish the last block of samples, and diagnostics with ``text`` as message."""
        self.take_commands()
        self.flush()
        self.report(text)

    def close(self) -> None:
        """Clear the latched topics, and destroy the publishers."""
        self.fault_publisher.publish(())
        self._outputs.end()
        self._node.destroy_publisher(self._description)
        self.fault_publisher.close()

    def wake(self) -> None:
        """Do the work of a wake-up: take commands, take the steps that are due, and publish."""
        begin, pacer = time.thread_time(), self.now.pacer
        self._stages.begin()
        self.take_commands()
        self._stages.end("inputs")
        if self.standing:
            pacer.start(time.monotonic())
        elif self.mode is TimeMode.FREE:
            self.advance(self.now.per_wake)
        # No step may be due, after catching up. Then nothing is published.
        elif due := pacer.due(time.monotonic()):
            self.advance(due)
        if self.commanded.checks is not None:
            # Last, because publishing must not wait for the error checks.
            self.commanded.checks.work(time.thread_time() - begin)

    def rest(self) -> float:
        """Return the time until the next wake-up [s]."""
        if self.mode is TimeMode.FREE and not self.paused:
            return 0.0
        return self.now.pacer.wait(time.monotonic())

    def take_commands(self) -> None:
        """Pass received commands to the command path."""
        self._commands.take(self.now.drive.steps, self.standing)

    def advance(self, steps: int) -> None:
        """Take integration steps and publish their samples; pause if the drive diverges.

        Fewer steps are taken if the node is to exit.
        """
        self._stages.begin()
        self.stopped = False
        first = len(self.pending)
        try:
            for part in self.commanded.advance(steps):
                self.pending.append(part)
                if self._node.stopping.is_set():
                    break
        except DivergedError as error:
            self.trouble = str(error)
            self.paused = True
            self._node.get_logger().error(f"paused: {error}")
            self._outputs.sampled(self.pending[first:], self.commanded.faults)
            self._commands.outputs_published()
            self.flush()
            self.report()
            return
        self._stages.end("integration")
        self._outputs.sampled(self.pending[first:], self.commanded.faults)
        self._wakes += 1
        if self._wakes % self._per_state == 0:
            self.publish()
        else:
            self._outputs.publish_clock(self.now.time_ns)
        self._commands.outputs_published()
        if self._wakes % self._per_block == 0:
            self.flush()
        self._stages.end("publishing")

    def step_before_pause(self) -> None:
        """Take the steps that are due before a pause."""
        self._take(self.now.pacer.stop)

    def catch_up(self) -> None:
        """Take the steps that are due now, between two wake-ups."""
        self._take(self.now.pacer.early)

    def _take(self, due: Callable[[float], int]) -> None:
        """Pass on received commands, and take the number of steps that ``due`` returns for now."""
        self.take_commands()
        if not self.standing and self.mode is TimeMode.PACED:
            if steps := due(time.monotonic()):
                self.advance(steps)

    def restart_clock(self, now: float | None = None) -> None:
        """Restart pacing at the present time, or at ``now`` [s, steady clock].

        Steps that were due before are not taken, and delays of commands are not measured across
        the restart.
        """
        now = time.monotonic() if now is None else now
        self.now.pacer.start(now, self._settings.values["speed_factor"])
        self.path.forget_stamps()
        self.restart_measurement(now)

    def restart_measurement(self, now: float) -> None:
        """Restart the measurement of the real-time factor at a time on the steady clock [s]."""
        self.now.health.paced = self.mode is TimeMode.PACED
        self.now.health.begin(now)

    def publish(self) -> None:
        """Publish the present state."""
        self._stages.begin()
        present = self.pending[-1] if self.pending else self.now.drive.present()
        values, silent = self._outputs.state_values(present, self.commanded.faults)
        self._stages.end("observing")
        self._outputs.publish_state(self.now.time_ns, values, silent)

    def flush(self) -> None:
        """Publish the samples since the last block."""
        self._outputs.write(self.pending)
        self.pending = []

    def report(self, instead: str = "") -> None:
        """Publish the node's diagnostics; ``instead`` replaces the message."""
        health = self.now.health
        self._commands.check_publishers()
        warnings = [
            *self.fault_publisher.warnings(),
            *health.warnings(),
            *self._commands.warnings(),
        ]
        level = Level.WARN if warnings else Level.OK
        text = "; ".join([self._state(), *warnings])
        if self.trouble:
            level, text = Level.ERROR, self.trouble
        elif other_clock := self._outputs.other_clock():
            level, text = Level.ERROR, other_clock
        values = {
            **health.values(),
            **self._stages.values(),
            **self._commands.values(self.now.drive.steps),
            **self.fault_publisher.values(),
            "time": self.mode.value,
            "scheduling": self._real_time.words,
        }
        logged = self._outputs.diagnostics.publish(
            level, instead or text, values, self.now.time_ns, logged=bool(instead)
        )
        new = self._new.of(warnings, time.monotonic())
        if new and not logged:
            self._node.get_logger().warning("; ".join(new))
        if rejections := self._commands.rejections():
            self._node.get_logger().warning(rejections)

    def report_if_due(self) -> None:
        """Publish diagnostics once a second, and earlier if other nodes wait for them.

        They do so after a trajectory, and after the start or end of a publisher of commands.
        """
        due = self.now.health.period_over(time.monotonic(), self.standing)
        answered = self._commands.trajectories_answered()
        if self._commands.publishers_changed() or answered or due:
            self.report()
        elif self._reported:
            # Not at the wake-up of a report: each of the two takes much of a period of 1 ms.
            self._real_time.collect_garbage()
            self._reported = False
        if due:
            self._reported = True
            if self.standing:
                # Late subscribers would not get the time: it is not published while it is stopped.
                self._outputs.publish_clock(self.now.time_ns)

    def checks_for_settings(self, before: Values) -> LiveChecks | None:
        """Return the error checks after a change of settings; creating new ones may take long."""
        share = self._settings.values["error_checks"]
        return (
            self.commanded.checks if share == before["error_checks"] else self.now.checks_for(share)
        )

    def apply_settings(self, before: Values, checks: LiveChecks | None) -> None:
        """Apply changed settings.

        Parameters
        ----------
        before
            Former values of the parameters.
        checks
            Result of ``checks_for_settings``.
        """
        values = self._settings.values
        if any(values[name] != before[name] for name in ("time_mode", "speed_factor")):
            # Steps that are due by now are taken at the former speed, which the pacer still has.
            now = time.monotonic()
            if self.active and mode_of(before) is TimeMode.PACED and not self.paused:
                self.take_commands()
                if due := self.now.pacer.stop(now):
                    self.advance(due)
            self.restart_clock(now)
        self.path.rules = rules_of(values)
        self.now.health.tolerance = tolerance_of(values)
        self.now.health.checks = checks
        self.commanded.set_checks(checks)

    def _state(self) -> str:
        """Return the state of the drive in a few words, for the diagnostics."""
        if self.mode is TimeMode.LOCK_STEP:
            return "lock-step: time advances by ~/step only"
        return self.now.health.state(self.paused)
