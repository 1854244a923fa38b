"""Subscriptions of the profile controller to those topics of a drive that a profile needs."""

from collections.abc import Callable
from typing import Any

from rclpy.node import Node

from ab_msgs_py import Qos, Topic, topics
from ab_msgs_py.samples import spindle_of
from ab_sim.model.spindle.profile_execution import ProfileExecution, ProfileInputs
from ab_sim.model.spindle.segments_execution import SegmentsExecution
from ab_sim.nodes.adaptive_execution import AdaptiveExecution
from ab_sim.nodes.paired_samples import Reading, SpindleSample


def _as_boards_have_it(topic: Topic, depth: int) -> Topic:
    """Return a topic with best-effort reliability.

    It matches best-effort publishers, such as boards' sensors, and reliable ones.
    """
    return topic._replace(qos=Qos(depth, reliable=False))


VIBRATION = _as_boards_have_it(topics.VIBRATION, 100)
SPINDLE = _as_boards_have_it(topics.JOINT_STATES, 100)

IF_A_PROBE = (
    "; without a scene, the profile's sensor is taken as an accelerometer: for a proximity probe, "
    "name a scene that has it in probes"
)


class ProfileSubscriptions:
    """Subscribes to the topics that profiles need, and passes samples to the profile in progress.

    Args:
        node: subscribing node.
        execution: function that returns the profile in progress, or None; callbacks of the
            subscriptions call it.
        now: function that returns the time by the node's clock [s].
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
                    probe = "" if inputs.probe or inputs.sensor is None else IF_A_PROBE
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
    topic_of = topics.probe_of if inputs.probe else topics.imu_of
    topic = topic_of(inputs.sensor or "", first=inputs.first_sensor)
    return _as_boards_have_it(topic, topic.qos.depth)
