"""Publishers of a drive's state, at every wake-up."""

import math
from collections.abc import Callable, Sequence, Set
from operator import itemgetter
from typing import NamedTuple

from rclpy.node import Node

from ab_msgs_py import PoseSample, Topic, topics
from ab_msgs_py.prefilled import Prefilled
from ab_msgs_py.samples import DECK
from ab_sim.drive.driving_forces import DrivenBalls
from ab_sim.drive.faults.active import ActiveFaults
from ab_sim.drive.published import (
    AXES,
    CONSTANTS,
    STATE_TOPICS,
    StateChannels,
    Template,
    effort,
    pose,
)
from ab_sim.drive.trajectory import Trajectory
from ab_sim.drive.urdf import urdf_of
from ab_sim.nodes.accelerometers import Accelerometers
from ab_sim.nodes.turn_vector_publisher import TurnVectorPublisher
from ab_sim.scene import Scene


class StatePublishers:
    """Publishes a drive's state (`ab_sim.drive.published`), and the deck's pose on tf.

    Also the drive's URDF, every sample of its accelerometers, and what comes once per turn. A deck
    in the plane has the same topics: it moves along two axes and does not turn. tf needs tf2_msgs;
    without it a message is logged.

    Args:
        node: of the publishers; its namespace is part of the frames' names.
    """

    def __init__(self, node: Node) -> None:
        self._namespace = node.get_namespace()
        self._publishers = {topic: topic.publisher(node) for topic in STATE_TOPICS}
        self._model = topics.MODEL.publisher(node)
        self._accelerometers = Accelerometers(node)
        self._turn_vector = TurnVectorPublisher(node)
        self._streams: list[_Stream] = []
        self._subscribed: list[_Stream] = []
        self._tf_static = None
        if topics.TF.type is None:
            node.get_logger().info(
                "tf is not published: tf2_msgs is not installed; deck_pose says where the deck is"
            )
            return
        self._publishers[topics.TF] = topics.TF.publisher(node)
        self._tf_static = topics.TF_STATIC.publisher(node)

    def begin(self, scene: Scene, channels: Sequence[str]) -> None:
        """Publish the state of a scene's drive from now on.

        Args:
            scene: of the drive.
            channels: of its samples.
        """
        self._driven, self._radius = DrivenBalls.of(scene), scene.race.radius
        self._model.publish(topics.MODEL.message(urdf_of(scene)))
        self._accelerometers.begin(scene)
        self._turn_vector.begin(scene)
        named = StateChannels(self._namespace, channels, scene.balls.count, list(scene.sensors))
        self._names, self._tilts = named.names, named.tilts
        first = channels.index("ball_0_angle") if scene.balls.count else 0
        balls = [slice(k, first + 2 * scene.balls.count, 2) for k in (first, first + 1)]
        self._driving = [*map(channels.index, ("x", "y", "angle", "speed")), *balls]
        self._streams = [
            self._stream(topic, messages)
            for topic, of in STATE_TOPICS.items()
            for messages in of(named)
        ]
        if self._tf_static is not None:
            (deck,) = pose(named)
            moving = deck._replace(sample=[(named.frame(DECK), deck.sample)])
            self._streams.append(self._stream(topics.TF, moving))
            # Latched: of a scene without sensors, too, or those of another one would stay.
            placed = [(named.frame(name), _place(scene, name, named)) for name in scene.sensors]
            self._tf_static.publish(topics.TF_STATIC.message(placed))

    def end(self) -> None:
        """Clear the latched topics."""
        self._model.publish(topics.MODEL.message(""))
        if self._tf_static is not None:
            self._tf_static.publish(topics.TF_STATIC.message([]))

    def values_of(self, present: Trajectory) -> list[float]:
        """All published numbers of the last sample; empty if no topic has a subscriber."""
        self._subscribed = [stream for stream in self._streams if stream.listeners()]
        if not self._subscribed:
            return []
        row, turning = present.samples[-1], AXES
        if self._tilts:
            present = present.last(1)
            forces = self._driven.forces(present)[0]
            turning = present.angular_acceleration[0].tolist()
        else:
            # The same, in a third of the time: no channel need be looked for.
            x, y, psi, omega, theta, rate = (row[at] for at in self._driving)
            forces = self._driven.force(x, y, psi + theta, omega + rate)
        efforts = (-self._radius * forces).tolist()
        return [*row.tolist(), *CONSTANTS.values(), *efforts, *turning]

    def with_sensor_faults(
        self, values: list[float], present: Trajectory, faults: ActiveFaults
    ) -> Set[str]:
        """Replace sensor readings by those of faulty sensors, in place; returns silent sensors."""
        read, silent = faults.readings(present.last(1))
        values[: len(read.channels)] = read.samples[0].tolist()
        for ball in faults.lost:
            values[self._names.index(effort(ball))] = 0.0
        return silent

    def publish(self, time: int, values: list[float], silent: Set[str] = frozenset()) -> None:
        """Publish numbers of ``values_of``, stamped with a time [ns], except of silent sensors.

        Topics that had no subscriber in ``values_of`` are left out.
        """
        for stream in self._subscribed:
            if stream.sensor not in silent:
                stream.send(stream.message.at(time, stream.numbers(values)))

    def sampled(self, runs: Sequence[Trajectory], faults: ActiveFaults) -> None:
        """Publish every accelerometer sample of some integration steps, and what follows of all."""
        self._accelerometers.publish(runs, faults)
        self._turn_vector.publish(runs)

    def _stream(self, topic: Topic, messages: Template) -> "_Stream":
        handle = self._publishers[topic].handle
        # By the C handle: rclpy's own publish takes as long again as sending.
        return _Stream(
            handle.get_subscription_count,
            handle.publish_raw,
            Prefilled(topic.message(messages.sample)),
            _numbers_at([self._names.index(name) for name in messages.numbers]),
            messages.sensor,
        )


class _Stream(NamedTuple):
    """The publisher of one message template."""

    listeners: Callable[[], int]
    """Number of subscribers."""
    send: Callable[[bytes], None]
    message: Prefilled
    numbers: Callable[[list[float]], tuple[float, ...]]
    """Selects its numbers from all published ones."""
    sensor: str
    """The sensor that it reports; empty: the true state."""


def _numbers_at(places: Sequence[int]) -> Callable[[list[float]], tuple[float, ...]]:
    selected = itemgetter(*places)
    return selected if len(places) > 1 else lambda values: (selected(values),)


def _place(scene: Scene, name: str, state: StateChannels) -> PoseSample:
    """Pose of a sensor in the deck's frame."""
    sensor = scene.sensors[name]
    half = 0.5 * sensor.axis_angle
    turn = (math.cos(half), 0.0, 0.0, math.sin(half))
    return PoseSample(0, sensor.position, turn, state.frame(DECK))
