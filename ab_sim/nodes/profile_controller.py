"""`profile_controller`: commands a speed profile, as a trajectory or by one speed per period."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Iterable
from typing import Any

from rclpy.publisher import Publisher

from ab_msgs_py import ENDED, Level, Task, services, topics
from ab_msgs_py.actions import Outcome, RunRequest
from ab_msgs_py.services import Answer
from ab_msgs_py.set_points import SetPoints
from ab_sim.base.errors import AbSimError, InputError
from ab_sim.model.spindle.commands import set_points_of
from ab_sim.model.spindle.profile_run import ProfileState
from ab_sim.model.spindle.segments_execution import PERIOD, SILENCE
from ab_sim.nodes.base_node import BaseNode, DiagnosticsPublisher
from ab_sim.nodes.pacing import Ticker
from ab_sim.nodes.parameters import LOAD, Parameters, ParameterSpec, Values, path_of
from ab_sim.nodes.process import run_node
from ab_sim.nodes.profile_interface import (
    ProfileAction,
    ProfileSubscriptions,
    health_of,
    log_text,
    outcome_of,
    progress_of,
)
from ab_sim.nodes.timed_run import (
    CheckedProfile,
    TimedRun,
    read_profile_snapshot,
    write_profile_snapshot,
)
from ab_sim.scene.load import load_profile

_REPORT_PERIOD = 1.0
"""Time between two diagnostics messages [s]."""
GLANCE = 0.05
"""Time between two checks for changes of subscribers and status [s]."""
_RECORDER = "recorder"
"""Name of the node that subscribes to commands without obeying them."""
LATE = 5
"""Number of times that a late trajectory is sent again before the profile is aborted."""
_DISCOVERY = 0.5
"""Longest time for the discovery of a drive's subscription to trajectories [s]."""
_NOT_SIMULATED = (
    "use_sim_time is not set: only a simulated drive can be restored; start this node with it"
)

_PROFILE_PARAMETERS = (
    LOAD,
    ParameterSpec(
        "profile",
        "thesis-hold",
        "scene with a profile (name or YAML file), YAML file of a profile, or its text in braces; "
        "it is read immediately, and takes effect at the next ~/start",
    ),
    ParameterSpec(
        "changes",
        [""],
        "changes to the scene, each key=value; they take effect at the next ~/start",
    ),
    ParameterSpec(
        "snapshot",
        "profile.json",
        "file (.json) that ~/save_snapshot writes and ~/restore_snapshot reads",
    ),
    ParameterSpec(
        "command_rate", 1.0 / PERIOD, "rate of speed commands", "1/s", (1.0, 1000.0), fixed=True
    ),
    ParameterSpec(
        "auto_start", False, "start as soon as a drive is found, without ~/start", fixed=True
    ),
    ParameterSpec(
        "abort_deceleration",
        0.0,
        "deceleration after ~/abort; 0: the profile's largest acceleration",
        "rad/s^2",
        (0.0, 1e9),
        fixed=True,
    ),
    ParameterSpec(
        "vibration_timeout",
        SILENCE,
        "longest time without a valid vibration sample while a condition needs one; then the "
        "profile is aborted",
        "s",
        (0.001, 1e4),
        fixed=True,
    ),
    ParameterSpec(
        "lead_time",
        0.1,
        "simulated time from ~/start to the beginning of a profile that is sent as a trajectory, "
        "which must reach the drive within this time; at t = 0, before the drive runs, the profile "
        "begins at 0",
        "s",
        (0.0, 10.0),
        fixed=True,
    ),
)
"""All parameters of the node."""


class ProfileController(BaseNode):
    """Node that commands the speeds of a profile, as start-up firmware does.

    With ``use_sim_time``, the node follows simulated time. It then sends a profile that is known in
    advance as a trajectory, ahead of time, so that the arrival times of messages do not matter.
    Otherwise, or if no node subscribes to trajectories, it sends one speed per period. Without
    ``use_sim_time``, periods are those of the steady clock.
    """

    def __init__(self) -> None:
        super().__init__("profile_controller")
        self._settings = Parameters(self, _PROFILE_PARAMETERS)
        values = self._settings.values
        self._slope, self._silence = values["abort_deceleration"], values["vibration_timeout"]
        self._lead = values["lead_time"]
        self._period = 1.0 / values["command_rate"]
        self._checked: CheckedProfile
        self._check(values)
        self._next = self._checked
        self._lock = threading.RLock()
        self._simulated = bool(self.get_parameter("use_sim_time").value)
        self._sim_time = 0
        self._ticked = time.monotonic()
        self._published = 0
        self._ended = False
        self._sent: SetPoints | None = None
        """Trajectory that the drive follows at present; None if it follows speed commands."""
        self._late = 0

        self._command = topics.COMMAND.publisher(self)
        self._trajectory = topics.TRAJECTORY.publisher(self)
        self._status = topics.PROFILE_STATUS._replace(name="~/status").publisher(self)
        self._diagnostics = DiagnosticsPublisher(self, Task.PROFILE)
        for name, work in (
            (services.START, self.start),
            (services.ABORT, self.abort),
            (services.SAVE_SNAPSHOT, self.save_snapshot),
            (services.RESTORE_SNAPSHOT, self.restore_snapshot),
        ):
            self.offer(name, work)
        self._action = ProfileAction(self, self._start_goal, self._cancel_goal)
        self._ticker: Ticker | None = None
        if self._simulated:
            # Commands depend on each clock message: a ROS timer has its own phase, so that two
            # equal runs would have commands at different times.
            topics.CLOCK.subscription(self, self._receive_clock)
            topics.DIAGNOSTICS.subscription(self, self._receive_drive)
        self._waits = values["auto_start"]
        # Last, because it reports that the node is waiting: from then on, the node must be able to
        # exit in order.
        self._timed = TimedRun(self._period, self._simulated, self._publish_status, self._warn)
        self._inputs = ProfileSubscriptions(
            self, lambda: self._timed.execution, lambda: self._now * 1e-9
        )
        self._inputs.subscribe_to(self._next.inputs)
        self._settings.accept_changes(self._check, self._apply)

    def start(self) -> Answer:
        """Start the profile that the parameters name, from its beginning."""
        with self._lock:
            if refusal := self._begin(self._next):
                return False, refusal
            began = self._timed.run.began
            return True, f"started at t = {began:g} s" if self._simulated else "started"

    def abort(self) -> Answer:
        """Stop the profile and ramp down to standstill."""
        with self._lock:
            before = self._timed.run.state
            if refusal := self._timed.abort(self._now, "by ~/abort"):
                return False, refusal
            if before is ProfileState.WAITING:
                self._waits = False
                return True, "no longer waiting"
            return True, "ramping down to standstill"

    def save_snapshot(self) -> Answer:
        """Save the present state to the file of the parameter `snapshot`."""
        path = path_of(self._settings.values["snapshot"])
        if not self._simulated:
            return False, _NOT_SIMULATED
        with self._lock:
            snapshot, status = self._timed.snapshot(), self._timed.run.status
            sent = None if self._sent is None else self._sent.start
        write_profile_snapshot(path, snapshot._replace(trajectory=sent))
        return True, f"{path}: t = {snapshot.time * 1e-9:.9g} s, {status}"

    def restore_snapshot(self) -> Answer:
        """Restore the state in the file of the parameter `snapshot`.

        The profile continues when the drive has reached the time of the snapshot.
        """
        path = path_of(self._settings.values["snapshot"])
        if not self._simulated:
            return False, _NOT_SIMULATED
        snapshot = read_profile_snapshot(path)
        named = snapshot.made_of is not None
        plan = self._plan(snapshot.source, snapshot.changes) if named else None
        with self._lock:
            outcome = self._outcome("another run was restored; ")
            try:
                self._timed.restore(self._now, snapshot, plan, self._silence)
            except InputError as error:
                raise InputError(f"snapshot {path}: {error}") from error
            self._action.finish(False, lambda: outcome)
            self._sent = None
            if plan is not None:
                self._inputs.subscribe_to(plan.inputs)
                if snapshot.trajectory is not None and plan.schedule is not None:
                    # The drive's own snapshot contains the trajectory: it is not sent again.
                    self._sent = set_points_of(plan.schedule, snapshot.trajectory)
            self._tick()
            there = f"t = {snapshot.time * 1e-9:.9g} s"
            waits = f"; waits until the drive is restored to {there}" if self._timed.waits else ""
            return True, f"{there}, {self._timed.run.status}{waits}"

    @property
    def listeners(self) -> int:
        """Number of subscriptions to speed commands: the drive's, and perhaps a recorder's."""
        return self._command.get_subscription_count()

    @property
    def _trajectory_listeners(self) -> int:
        """Number of drives that take trajectories, as far as this node has discovered them."""
        return len(self._listeners_to(self._trajectory))

    @property
    def status(self) -> str:
        """Status of the profile."""
        return self._timed.run.status

    @property
    def _now(self) -> int:
        """Time [ns]; simulated time is 0 before the first message."""
        return self._sim_time if self._simulated else time.monotonic_ns()

    def _listeners_to(self, publisher: Publisher[Any]) -> set[str]:
        """Return the full names of a publisher's subscribers that obey: all except recorders."""
        return {
            f"{info.node_namespace.rstrip('/')}/{info.node_name}"
            for info in self.get_subscriptions_info_by_topic(publisher.topic_name)
            if info.node_name != _RECORDER
        }

    def run(self, stopping: threading.Event) -> None:
        """Run the main loop until stopped: send commands, start when there is a drive, report.

        Reports are published once per second of the steady clock, and immediately after a change of
        subscribers or status. ROS timers and Python's events are not used: in some versions they
        follow the system clock, and would stop if it were set back.
        """
        if not self._simulated:
            self._ticker = Ticker(self._period, time.monotonic())
        looked = reported = -math.inf
        seen = -1, -1, ""
        while not stopping.is_set():
            now = time.monotonic()
            if self._ticker is not None and self._ticker.due(now):
                self._tick()
            if now - looked >= GLANCE:
                looked = now
                if self._waits:
                    self._start_when_ready()
                present = self.listeners, self._trajectory_listeners, self.status
                if now - reported >= _REPORT_PERIOD or present != seen:
                    reported, seen = now, present
                    self.report()
            now = time.monotonic()
            rest = GLANCE if self._ticker is None else self._ticker.wait(now)
            time.sleep(min(rest, GLANCE))
        self.end()

    def report(self, ended: bool = False) -> None:
        """Publish the diagnostics of this node; ``ended``: the last ones, which report the end."""
        level, message, values = health_of(self._timed.run)
        if self._ticker is not None:
            values["ticks lost"] = str(self._ticker.lost)
            if warning := self._ticker.warning():
                level, message = Level.WARN, f"{message}; {warning}"
        values |= {
            "command rate [1/s]": f"{1 / self._period:g}",
            "commands published": str(self._published),
            "sends": "speeds" if self._sent is None else "a trajectory",
            "listeners": str(self.listeners),
            "listeners to trajectories": str(self._trajectory_listeners),
        }
        now = self.get_clock().now().nanoseconds
        self._diagnostics.publish(level, ENDED if ended else message, values, now)

    def end(self) -> None:
        """Send no more commands, publish the last diagnostics, and end the action's goal."""
        with self._lock:
            self._ended = True
            self.report(ended=True)
        self._action.end(lambda: self._outcome("the profile controller has ended; "))

    def _check(self, values: Values) -> None:
        """Read the profile that new parameter values name, and keep it, as its file may change.

        Raises
        ------
        SceneError, InputError
            The profile does not exist, or cannot be run.
        """
        self._checked = self._plan(values["profile"], values["changes"])

    def _plan(self, source: str, changes: Iterable[str]) -> CheckedProfile:
        """Read and check a profile.

        Raises
        ------
        SceneError, InputError
            The profile does not exist, or cannot be run.
        """
        wanted = [*filter(None, changes)]
        plan = CheckedProfile(load_profile(source, wanted), source, wanted, self._period)
        if not (self._slope or plan.steepest) > 0.0:
            raise InputError(
                "parameter abort_deceleration = 0: the profile has no acceleration to use instead, "
                "because it only holds its speed; set a deceleration [rad/s^2]"
            )
        return plan

    def _apply(self, before: Values, values: Values) -> None:
        """Make the checked profile the next one to start."""
        if all(before[name] == values[name] for name in ("profile", "changes")):
            return
        with self._lock:
            self._next = self._checked
            self._inputs.subscribe_to(self._next.inputs)
        self.get_logger().info(f"the next ~/start will run {values['profile']}")

    def _begin(self, plan: CheckedProfile) -> str:
        """Start a profile from its beginning; return the reason if it cannot run, else ''."""
        if refusal := self._missing(plan):
            return refusal
        slope, schedule = self._slope or plan.steepest, plan.schedule
        if not (self._simulated and schedule and self._drive_takes_trajectories()):
            schedule = None
        now = self._now
        # At t = 0 the drive is paused: a trajectory from 0 on arrives in time.
        begin = now if schedule is None or now == 0 else now + round(self._lead * 1e9)
        if refusal := self._timed.start(now, plan, self._silence, slope, begin):
            return refusal
        self._sent, self._late = None, 0
        if schedule is None:
            self._send(self._timed.run.commanded)
        else:
            self._send_trajectory(set_points_of(schedule, begin))
        return ""

    def _drive_takes_trajectories(self) -> bool:
        """Return whether a drive subscribes to trajectories.

        A drive's subscriptions are discovered one after the other, so wait for a moment before the
        first start. Later starts do not wait, because commands would stop meanwhile.
        """
        end = time.monotonic() + (0.0 if self._published else _DISCOVERY)
        while not (listeners := self._trajectory_listeners) and time.monotonic() < end:
            time.sleep(0.01)
        return listeners > 0

    def _start_goal(self, request: RunRequest) -> str:
        """Start the profile of a goal; return the reason if it cannot run."""
        with self._lock:
            try:
                if request.changes and not request.profile:
                    raise InputError(
                        "changes: apply to a profile, and the goal names none; name a profile, or "
                        "send no changes"
                    )
                plan = self._plan(*request) if request.profile else self._next
            except AbSimError as error:
                return str(error)
            self._inputs.subscribe_to(plan.inputs)
            return self._begin(plan)

    def _cancel_goal(self) -> bool:
        """Abort the profile of the present goal; return whether the spindle ramps down."""
        with self._lock:
            self._timed.abort(self._now, "canceled by the client of ~/run")
            return self._timed.run.state in (ProfileState.ABORTING, ProfileState.ABORTED)

    def _missing(self, plan: CheckedProfile) -> str:
        """Return the condition that a start still lacks; empty if there is none."""
        if self._simulated and topics.CLOCK.publishers(self) == 0:
            clock = self.resolve_topic_name(topics.CLOCK.name)
            return f"use_sim_time is set, but no node publishes {clock}"
        if not self._listeners_to(self._command):
            return f"no drive subscribes to {self._command.topic_name}: start the drive first"
        return self._inputs.missing(plan.inputs)

    def _start_when_ready(self) -> None:
        """Start the profile once nothing is missing, for the parameter `auto_start`."""
        with self._lock:
            run = self._timed.run
            if self._waits and run.state in (ProfileState.IDLE, ProfileState.WAITING):
                missing = self._missing(self._next)
                if not missing and self._simulated and self._now == 0:
                    # The drive is paused at 0, or no clock message has arrived yet.
                    missing = "simulated time is 0"
                if missing:
                    run.wait(missing)
                    return
                if not self.start()[0]:
                    return
            self._waits = False

    def _publish_status(self, status: str, well: bool) -> None:
        """Publish and log a new status; ``well`` is False if there is a problem."""
        self._status.publish(topics.PROFILE_STATUS.message(status))
        words = log_text(status, well)
        if well:
            self.get_logger().info(words)
        else:
            self._warn(words)

    def _warn(self, words: str) -> None:
        self.get_logger().warning(words)

    def _receive_clock(self, message: Any) -> None:
        """Process a message on /clock, and command the profile's speed at the message's time."""
        self._sim_time = topics.CLOCK.sample(message)
        self._tick()

    def _tick(self) -> None:
        """Command the speed at the present time, and report to the goal's client."""
        with self._lock:
            if self._ended:
                return
            since, self._ticked = time.monotonic() - self._ticked, time.monotonic()
            run = self._timed.run
            self._send(self._timed.tick(self._now, since))
            if run.state.under_way:
                self._action.tell(lambda: progress_of(run, self._timed.elapsed), run.status)
            else:
                self._finish(run.execution is not None and run.execution.reached)

    def _finish(self, well: bool) -> None:
        """Set the result of the action's goal, if the run has one."""
        self._action.finish(well and self._timed.run.state is ProfileState.DONE, self._outcome)

    def _outcome(self, first: str = "") -> Outcome:
        """Return the result of the run for a goal's client; its text begins with ``first``."""
        return outcome_of(self._timed.run, self._timed.elapsed, first)

    def _send(self, speed: float | None) -> None:
        """Publish a speed command [rad/s]; None: none is due."""
        if self._sent is not None and self._timed.run.state is ProfileState.RUNNING:
            return  # the trajectory contains the speed
        self._sent = None
        if speed is not None:
            self._published += 1
            self._command.publish(topics.COMMAND.message(speed))

    def _send_trajectory(self, trajectory: SetPoints) -> None:
        """Publish a trajectory, which then replaces speed commands."""
        self._sent = trajectory
        self._published += 1
        self._trajectory.publish(topics.TRAJECTORY.message(trajectory))

    def _receive_drive(self, message: Any) -> None:
        """Send a trajectory again if it reached the drive too late; abort if it is refused."""
        with self._lock:
            sent, run = self._sent, self._timed.run
            if sent is None or run.state is not ProfileState.RUNNING:
                return
            for health in topics.DIAGNOSTICS.sample(message):
                answer = health.values.get(topics.TRAJECTORY_ANSWER, topics.FOLLOWED)
                if (
                    health.values.get(topics.TRAJECTORY_START) != str(sent.start)
                    or answer == topics.FOLLOWED
                    or health.node not in self._listeners_to(self._trajectory)
                ):
                    continue
                if answer.startswith(topics.PAST) and self._late < LATE:
                    self._late += 1
                    begin = self._now + round(max(self._lead, 0.1) * 2**self._late * 1e9)
                    self._warn(
                        "the trajectory reached the drive too late; sent again, to begin at "
                        f"{begin / 1e9} s"
                    )
                    self._timed.postpone(begin)
                    self._send_trajectory(sent._replace(start=begin))
                else:
                    refusal = f"the drive does not follow the profile: {answer}"
                    self._warn(refusal)
                    run.drop(refusal)
                    self._send(0.0)


def main() -> None:
    """Run the node."""
    run_node(ProfileController, ProfileController.run)


if __name__ == "__main__":
    main()
