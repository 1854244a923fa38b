"""What a drive shows of itself at every wake-up, on the topics that anybody can read."""

import math
from collections.abc import Callable, Iterable, Sequence, Set
from operator import itemgetter
from typing import NamedTuple

from rclpy.node import Node

from ab_msgs_py import PoseSample, Topic, topics
from ab_msgs_py.prefilled import Prefilled
from ab_msgs_py.samples import DECK
from ab_sim.drive.driving_forces import DrivenBalls
from ab_sim.drive.faults.active import ActiveFaults
from ab_sim.drive.published import AXES, CONSTANTS, SHOWN, Shown, Template, effort, pose
from ab_sim.drive.trajectory import Trajectory
from ab_sim.drive.urdf import urdf_of
from ab_sim.nodes.accelerometers import Accelerometers
from ab_sim.scene import Scene


class Observed:
    """Publishes what a drive shows (`ab_sim.drive.published`), and the deck's pose as tf too.

    Beside them what is observed, as a URDF, and every sample of its accelerometers.
    A deck in the plane has all of these: it moves along two axes and does not turn. tf is published
    where tf2_msgs is installed; the log says so if not.

    Args:
        node: it publishes as; its namespace is part of the frames' names.
    """

    def __init__(self, node: Node) -> None:
        self._namespace = node.get_namespace()
        self._publishers = {topic: topic.publisher(node) for topic in SHOWN}
        self._model = topics.MODEL.publisher(node)
        self._accelerometers = Accelerometers(node)
        self._streams: list[_Stream] = []
        self._heard: list[_Stream] = []
        self._tf_static = None
        if topics.TF.type is None:
            node.get_logger().info(
                "tf is not published: tf2_msgs is not installed; deck_pose says where the deck is"
            )
            return
        self._publishers[topics.TF] = topics.TF.publisher(node)
        self._tf_static = topics.TF_STATIC.publisher(node)

    def begin(self, scene: Scene, channels: Sequence[str]) -> None:
        """What is observed from now on.

        Args:
            scene: what the samples are of.
            channels: that they have.
        """
        self._driven, self._radius = DrivenBalls.of(scene), scene.race.radius
        self._model.publish(topics.MODEL.message(urdf_of(scene)))
        self._accelerometers.begin(scene)
        shown = Shown(self._namespace, channels, scene.balls.count, list(scene.sensors))
        self._names, self._tilts = shown.names, shown.tilts
        first = channels.index("ball_0_angle") if scene.balls.count else 0
        balls = [slice(k, first + 2 * scene.balls.count, 2) for k in (first, first + 1)]
        self._driving = [*map(channels.index, ("x", "y", "angle", "speed")), *balls]
        self._streams = [
            self._stream(topic, messages) for topic, of in SHOWN.items() for messages in of(shown)
        ]
        if self._tf_static is not None:
            (deck,) = pose(shown)
            moving = deck._replace(sample=[(shown.frame(DECK), deck.sample)])
            self._streams.append(self._stream(topics.TF, moving))
            # Latched: of a scene without sensors, too, or those of another one would stay.
            placed = [(shown.frame(name), _place(scene, name, shown)) for name in scene.sensors]
            self._tf_static.publish(topics.TF_STATIC.message(placed))

    def end(self) -> None:
        """Nothing is observed any more: who comes late is not told of what has been."""
        self._model.publish(topics.MODEL.message(""))
        if self._tf_static is not None:
            self._tf_static.publish(topics.TF_STATIC.message([]))

    def look(self, present: Trajectory) -> list[float]:
        """All that is shown of the last sample; nothing, if nobody listens to any of it."""
        self._heard = [stream for stream in self._streams if stream.listeners()]
        if not self._heard:
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

    def heard(self, shown: list[float], present: Trajectory, faults: ActiveFaults) -> Set[str]:
        """Put what faulty sensors say into what ``look`` has seen of the same; who says nothing."""
        heard, silent = faults.readings(present.last(1))
        shown[: len(heard.channels)] = heard.samples[0].tolist()
        for ball in faults.lost:
            shown[self._names.index(effort(ball))] = 0.0
        return silent

    def publish(self, time: int, shown: list[float], silent: Set[str] = frozenset()) -> None:
        """Publish what ``look`` has seen, stamped with a time [ns]; of silent sensors nothing.

        To whom did not listen then, it would have been lost anyway.
        """
        for stream in self._heard:
            if stream.sensor not in silent:
                stream.send(stream.message.at(time, stream.numbers(shown)))

    def sampled(self, runs: Iterable[Trajectory], faults: ActiveFaults) -> None:
        """Publish every sample of accelerometers in some integration steps."""
        self._accelerometers.publish(runs, faults)

    def _stream(self, topic: Topic, messages: Template) -> "_Stream":
        handle = self._publishers[topic].handle
        # Past rclpy's publisher, whose ways cost as much as sending does.
        return _Stream(
            handle.get_subscription_count,
            handle.publish_raw,
            Prefilled(topic.message(messages.sample)),
            _numbers_at([self._names.index(name) for name in messages.numbers]),
            messages.sensor,
        )


class _Stream(NamedTuple):
    """One kind of message."""

    listeners: Callable[[], int]
    """How many there are."""
    send: Callable[[bytes], None]
    message: Prefilled
    numbers: Callable[[list[float]], tuple[float, ...]]
    """Its numbers, out of all that is shown."""
    sensor: str
    """Which says so; empty: what is true."""


def _numbers_at(places: Sequence[int]) -> Callable[[list[float]], tuple[float, ...]]:
    taken = itemgetter(*places)
    return taken if len(places) > 1 else lambda shown: (taken(shown),)


def _place(scene: Scene, name: str, shown: Shown) -> PoseSample:
    """A sensor's, in the deck."""
    sensor = scene.sensors[name]
    half = 0.5 * sensor.axis_angle
    turn = (math.cos(half), 0.0, 0.0, math.sin(half))
    return PoseSample(0, sensor.position, turn, shown.frame(DECK))
