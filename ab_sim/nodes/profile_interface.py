"""ROS side of the profile controller: its action, its subscriptions, and its texts."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from typing import Any

from rclpy.action import CancelResponse
from rclpy.node import Node

from ab_msgs_py import Level, Qos, Topic, actions, topics
from ab_msgs_py.actions import Outcome, Progress, RunRequest
from ab_msgs_py.samples import spindle_of
from ab_sim.model.spindle.profile_run import (
    ProfileExecution,
    ProfileInputs,
    ProfileRun,
    ProfileState,
)
from ab_sim.model.spindle.segments_execution import SegmentsExecution
from ab_sim.nodes.adaptive_execution import AdaptiveExecution, Reading, SpindleSample
from ab_sim.nodes.base_node import Goal, GoalServer

GAVE_UP = "at the final speed, but "
"""Beginning of the message on a profile that ended with a problem; the reason follows."""
_HEALTH = {
    ProfileState.IDLE: "waiting for ~/start",
    ProfileState.DONE: "profile done, holding its final speed",
    ProfileState.ABORTED: "aborted, commanding standstill",
}
"""Diagnostics messages for profile states whose status text is not clear enough."""


def log_text(status: str, well: bool = True) -> str:
    """Return the text of a status for the log; ``well`` is False if there is a problem."""
    word, _, more = status.partition(": ")
    state = ProfileState(word)
    if state is ProfileState.DONE and not well:
        return f"{GAVE_UP}{more}"
    words = _HEALTH.get(state, status)
    return f"{words}; {more}" if more and more not in words else words


def health_of(run: ProfileRun) -> tuple[Level, str, dict[str, str]]:
    """Return level, message and values of the diagnostics."""
    message = _HEALTH.get(run.state, run.status)
    if run.why and run.state is ProfileState.DONE:
        message = f"{GAVE_UP}{run.why}"
    elif run.why and run.why not in message:
        message += f"; {run.why}"
    values = {
        "state": run.state.value,
        "status": run.status,
        "speed commanded [rad/s]": f"{run.command:.9g}",
    }
    if run.execution is not None and run.state in (ProfileState.RUNNING, ProfileState.DONE):
        values |= run.execution.values
    return Level.WARN if run.why else Level.OK, message, values


def progress_of(run: ProfileRun, elapsed: float) -> Progress:
    """Return the feedback for a goal's client, with the time since the start [s]."""
    assert run.execution is not None
    segment, segments = run.execution.segment
    progress = Progress(run.status, segment, segments, run.command, elapsed)
    if not isinstance(run.execution, AdaptiveExecution):
        return progress
    estimates = run.execution.estimates
    return progress._replace(
        critical_speed=estimates.critical_speed,
        critical_speed_deviation=estimates.critical_speed_deviation,
        net_unbalance=abs(estimates.net_unbalance),
        net_unbalance_deviation=estimates.net_unbalance_deviation,
    )


def outcome_of(run: ProfileRun, elapsed: float, first: str = "") -> Outcome:
    """Return the result of a run for a goal's client.

    Parameters
    ----------
    run
        Run of the profile.
    elapsed
        Time since its start [s].
    first
        Beginning of the text.
    """
    why = f": {run.why}" if run.why and run.why not in run.status else ""
    return Outcome(f"{first}{run.status}{why}", run.command, elapsed)


_FEEDBACK_PERIOD = 0.1
"""Time between two feedback messages if the status does not change [s]."""
_GOODBYE = 1.0
"""Longest time for the last result to be sent when the node exits [s]."""
_LINGER = 0.3
"""Time for the last result to arrive at the client [s]."""


class ProfileAction:
    """Serves the action, one goal at a time; if its package is not built, logs this instead.

    A goal that cannot be run is accepted and immediately aborted, because in ROS the refusal of a
    goal has no text, but a result has. A goal whose client has exited is run to its end.

    Parameters
    ----------
    node
        Node that offers the action.
    start
        Function that starts the profile of a goal, and returns the reason if it cannot.
    cancel
        Function that ramps down, and returns whether a profile was running.
    """

    def __init__(
        self, node: Node, start: Callable[[RunRequest], str], cancel: Callable[[], bool]
    ) -> None:
        self._node, self._start, self._cancel = node, start, cancel
        self._goal: Goal | None = None
        self._sent_at, self._sent_status = -math.inf, ""
        self._left = threading.Event()
        if (kind := actions.run_profile()) is None:
            node.get_logger().info(actions.NOT_BUILT)
            return
        self._server = GoalServer(node, kind, actions.RUN, self._accepted, self._cancel_requested)

    def tell(self, progress: Callable[[], Progress], status: str) -> None:
        """Send feedback to the goal's client if it is due, or if the status has changed."""
        now = time.monotonic()
        due = status != self._sent_status or now - self._sent_at >= _FEEDBACK_PERIOD
        if self._goal is not None and due:
            self._sent_at, self._sent_status = now, status
            self._goal.publish_feedback(actions.feedback_of(progress()))

    def finish(self, well: bool, outcome: Callable[[], Outcome]) -> None:
        """Set the result of the present goal, if any: success if ``well``, else failure."""
        goal, self._goal = self._goal, None
        if goal is not None:
            self._end(goal, well, outcome())
            if (executor := self._node.executor) is not None:
                executor.create_task(self._left.set)  # after the result has been sent

    def end(self, outcome: Callable[[], Outcome]) -> None:
        """End the present goal when the node exits; call it in another thread than callbacks."""
        if self._goal is not None:
            self._left.clear()
            self.finish(False, outcome)
            self._left.wait(_GOODBYE)
            # An answer is not acknowledged, and is lost if its sender exits too soon.
            time.sleep(_LINGER)

    def _accepted(self, goal: Goal) -> None:
        """Start the profile of a new goal, or abort the goal with the reason."""
        goal.execute()
        refusal = "another goal is being run; cancel it first" if self._goal is not None else ""
        if not refusal:
            # Set before the start, because the profile may end immediately.
            self._goal, self._sent_at = goal, -math.inf
            if refusal := self._start(actions.request_of(goal.request)):
                self._goal = None
        if refusal:
            self._end(goal, False, Outcome(f"refused: {refusal}", 0.0, 0.0))

    def _cancel_requested(self, goal: Goal) -> CancelResponse:
        """Ramp down if the present goal is to be cancelled; reject the request for others."""
        is_present = self._goal is not None and goal.goal_id == self._goal.goal_id
        return CancelResponse.ACCEPT if is_present and self._cancel() else CancelResponse.REJECT

    def _end(self, goal: Goal, well: bool, outcome: Outcome) -> None:
        self._server.end(goal, well, actions.result_of(outcome))


def _best_effort(topic: Topic, depth: int) -> Topic:
    """Return a topic for subscriptions with best-effort reliability and a queue of ``depth``.

    DDS matches such a subscription with best-effort publishers, as boards often have for sensors,
    and with reliable ones. A reliable subscription would not match best-effort publishers.
    """
    return topic._replace(qos=Qos(depth, reliable=False))


VIBRATION = _best_effort(topics.VIBRATION, 100)
SPINDLE = _best_effort(topics.JOINT_STATES, 100)

_IF_A_PROBE = (
    "; without a scene, the profile's sensor is taken as an accelerometer: for a proximity probe, "
    "name a scene that has it in probes"
)


class ProfileSubscriptions:
    """Subscribes to the topics that profiles need, and passes samples to the profile in progress.

    Parameters
    ----------
    node
        Subscribing node.
    execution
        Function that returns the profile in progress, or None; callbacks of the subscriptions call
        it.
    now
        Function that returns the time by the node's clock [s].
    """

    def __init__(
        self, node: Node, execution: Callable[[], ProfileExecution | None], now: Callable[[], float]
    ) -> None:
        self._node, self._execution, self._now = node, execution, now
        self._subscribed: set[str] = set()

    def subscribe_to(self, inputs: ProfileInputs) -> None:
        """Subscribe to the topics that a profile needs, and keep earlier subscriptions."""
        if inputs.vibration:
            self._subscribe(VIBRATION, self._vibration)
        if inputs.sensor is not None:
            receive = self._displacement if inputs.probe else self._reading
            self._subscribe(_samples_of(inputs), receive)
            self._subscribe(SPINDLE, self._spindle)

    def missing(self, inputs: ProfileInputs) -> str:
        """Return a text on a needed topic that no node publishes; empty if there is none."""
        needed = {
            "a segment of the profile waits for the vibration": [VIBRATION] * inputs.vibration,
            "an adaptive start-up needs every sample of its sensor, and the spindle's angle": [
                _samples_of(inputs),
                SPINDLE,
            ]
            * (inputs.sensor is not None),
        }
        for why, wanted in needed.items():
            for topic in wanted:
                if topic.publishers(self._node) == 0:
                    name = self._node.resolve_topic_name(topic.name)
                    probe = "" if inputs.probe or inputs.sensor is None else _IF_A_PROBE
                    return f"no node publishes {name}, and {why}{probe}"
        return ""

    def _subscribe(self, topic: Topic, callback: Callable[[Any], None]) -> None:
        if topic.name not in self._subscribed:
            self._subscribed.add(topic.name)
            topic.subscription(self._node, callback)

    def _vibration(self, message: Any) -> None:
        execution = self._execution()
        if isinstance(execution, SegmentsExecution):
            sample = topics.VIBRATION.sample(message)
            execution.receive(self._now(), sample.frame, sample.time, sample.linear)

    def _spindle(self, message: Any) -> None:
        execution = self._execution()
        if isinstance(execution, AdaptiveExecution):
            if (spindle := spindle_of(message)) is not None:
                execution.spindle(SpindleSample(*spindle))

    def _reading(self, message: Any) -> None:
        execution = self._execution()
        if isinstance(execution, AdaptiveExecution):
            sample = topics.IMU.sample(message)
            execution.reading(Reading(sample.time, *sample.force[:2]))

    def _displacement(self, message: Any) -> None:
        execution = self._execution()
        if isinstance(execution, AdaptiveExecution):
            sample = topics.PROBE.sample(message)
            execution.reading(Reading(sample.time, *sample.place[:2]))


def _samples_of(inputs: ProfileInputs) -> Topic:
    """Return the topic of the sensor that an adaptive start-up needs."""
    topic_of = topics.probe_of if inputs.probe else topics.imu_of
    topic = topic_of(inputs.sensor or "", first=inputs.first_sensor)
    return _best_effort(topic, topic.qos.depth)
