"""Publishers of a drive's node: state at each wake-up, sample blocks, sensors, clock and faults."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence, Set
from operator import itemgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rclpy.node import Node
from rclpy.publisher import Publisher

from ab_msgs_py import Block, ImuSample, PoseSample, Task, Topic, WhirlSample, topics
from ab_msgs_py.prefilled import Prefilled
from ab_msgs_py.samples import DECK, FORCE, frame_of
from ab_sim.base.sample_columns import STEP
from ab_sim.drive.closed_forms import DrivenBalls
from ab_sim.drive.faults.active import ActiveFaults
from ab_sim.drive.faults.fault import Fault
from ab_sim.drive.pickup import noise_variance
from ab_sim.drive.published import (
    AXES,
    CONSTANTS,
    STATE_TOPICS,
    StateChannels,
    Template,
    effort,
    pose,
)
from ab_sim.drive.trajectory import Trajectory, taken
from ab_sim.drive.turn_vector import TurnVector
from ab_sim.drive.urdf import urdf_of
from ab_sim.nodes.base_node import BaseNode, DiagnosticsPublisher
from ab_sim.scene import Scene
from ab_sim.scene.sensors import SPINDLE, steps_per_sample


class _SensorStream(NamedTuple):
    """Publisher of one sensor, and the conversion of samples to messages."""

    publisher: Publisher[Any]
    message: Prefilled
    """Prefilled message; it takes a quarter of the time of message objects."""
    name: str
    axes: int
    every: int
    """Integration steps per sample."""
    step_ns: int

    def publish(self, run: Trajectory, faults: ActiveFaults) -> None:
        """Publish the samples of consecutive integration steps that the sensor reports."""
        # A sample takes 5 us, a thousand times a second or more, so nothing is done without
        # subscribers.
        if not self.publisher.get_subscription_count():
            return
        rows = taken(run, self.every)
        at = run.channels.index(f"{self.name}_1")
        steps, forces = faults.sampled(self.name, rows[:, STEP], rows[:, at : at + self.axes])
        for step, (x, y, *z) in zip(steps.tolist(), forces.tolist(), strict=True):
            force = x, y, z[0] if z else 0.0
            self.publisher.publish(self.message.at(int(step) * self.step_ns, force))


class Accelerometers:
    """Publishes every sample of a scene's accelerometers and probes.

    Parameters
    ----------
    node
        Publishing node; its namespace is part of the frames' names.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._publishers: dict[str, Publisher[Any]] = {}
        self._streams: list[_SensorStream] = []

    def begin(self, scene: Scene) -> None:
        """Create publishers for the sensors of a scene, and warn of sensors that may alias."""
        step, axes = scene.solver.step, 2 if scene.deck is None else 3
        namespace, nothing = self._node.get_namespace(), (0.0, 0.0, 0.0)
        prefilled: dict[str, tuple[Topic, Prefilled]] = {}
        for number, (name, sensor) in enumerate(scene.sensors.items()):
            topic = topics.imu_of(name, first=number == 0)
            variance = noise_variance(sensor, step)
            sample = ImuSample(0, nothing, variance, frame_of(namespace, name))
            prefilled[name] = topic, Prefilled(topic.message(sample), FORCE)
        for number, name in enumerate(scene.probes):
            topic = topics.probe_of(name, first=number == 0)
            place = WhirlSample(0, nothing, frame_of(namespace, name))
            prefilled[name] = topic, Prefilled(topic.message(place))
        self._streams = [
            _SensorStream(
                self._publisher(topic),
                message,
                name,
                axes,
                steps_per_sample(scene.pickups[name].sample_rate, step),
                round(step * 1e9),
            )
            for name, (topic, message) in prefilled.items()
        ]
        for name, pickup in scene.pickups.items():
            if aliases := pickup.aliasing(step):
                self._node.get_logger().warning(f"sensor {name} {aliases}")

    def publish(self, runs: Iterable[Trajectory], faults: ActiveFaults) -> None:
        """Publish the samples taken during some integration steps, altered by sensor faults."""
        for run in runs if self._streams else ():
            for stream in self._streams if len(run) else ():
                stream.publish(run, faults)

    def _publisher(self, topic: Topic) -> Publisher[Any]:
        # Publishers are kept: a scene loaded later may have the same sensor.
        if topic.name not in self._publishers:
            self._publishers[topic.name] = topic.publisher(self._node)
        return self._publishers[topic.name]


class TurnVectorPublisher:
    """Publishes the once-per-turn vector over the last turn, if there are subscribers.

    Parameters
    ----------
    node
        Publishing node; its namespace is part of the frame's name.
    """

    def __init__(self, node: Node) -> None:
        self._publisher = topics.ONCE_PER_TURN.publisher(node)
        frame = frame_of(node.get_namespace(), SPINDLE)
        self._message = Prefilled(
            topics.ONCE_PER_TURN.message(WhirlSample(0, (0.0, 0.0, 0.0), frame))
        )
        self._turn: TurnVector | None = None

    def begin(self, scene: Scene) -> None:
        """Forget earlier samples, because the next one belongs to another run."""
        self._turn, self._step_ns = None, round(scene.solver.step * 1e9)

    def publish(self, runs: Sequence[Trajectory]) -> None:
        """Publish the vector over the turn before the last sample, if there was a whole turn.

        Parameters
        ----------
        runs
            Samples of all integration steps since the last call.
        """
        if not self._publisher.get_subscription_count():
            self._turn = None
            return
        if self._turn is None:
            self._turn = TurnVector()
        vector = complex(np.nan)
        for run in runs:
            if len(run):
                vector = self._turn.of(run["angle"], run["x"], run["y"])[-1]
                time = round(run["step"][-1]) * self._step_ns
        if np.isfinite(vector):
            place = float(vector.real), float(vector.imag), 0.0
            self._publisher.publish(self._message.at(time, place))


class FaultPublisher:
    """Publisher of the drive's present faults.

    Parameters
    ----------
    node
        Publishing node.
    """

    def __init__(self, node: Node) -> None:
        self._node, self._topic = node, topics.FAULTS.publisher(node)
        self._texts: list[str] | None = None

    @property
    def words(self) -> str:
        """Present faults as one line of text."""
        return ", ".join(self._texts or []) or "none"

    def publish(self, faults: Sequence[Fault]) -> None:
        """Publish the present faults, and log a change."""
        before, self._texts = self._texts or [], [fault.text for fault in faults]
        # Also published without faults, because the topic is latched: late subscribers would
        # receive earlier faults.
        self._topic.publish(topics.FAULTS.message(self._texts))
        if self._texts != before:
            self._node.get_logger().warning(f"faults in force: {self.words}")

    def warnings(self) -> list[str]:
        """Return a warning for each fault."""
        return [f"fault: {text}" for text in self._texts or []]

    def values(self) -> dict[str, str]:
        """Return values for the diagnostics."""
        return {"faults": self.words}

    def close(self) -> None:
        """Destroy the publisher."""
        self._node.destroy_publisher(self._topic)


class Outputs:
    """Publishes a drive's state (`ab_sim.drive.published`), and the deck's pose on tf.

    It also publishes the drive's URDF, every sensor sample, and the once-per-turn vector. A deck in
    the plane has the same topics as one in space: it moves along two axes and does not rotate. tf
    needs tf2_msgs; without it a message is logged. All publishers exist as long as the node, so
    that subscribers are matched before a scene is loaded.

    Parameters
    ----------
    node
        Publishing node; its namespace is part of the frames' names.
    scene
        Name or file of the first scene.
    hardware
        ``hardware_id`` in the diagnostics; empty: namespace and scene.
    clock
        Whether simulated time is published.
    """

    def __init__(self, node: BaseNode, scene: str, hardware: str, clock: bool) -> None:
        self._node, self._hardware = node, hardware
        self._namespace = node.get_namespace()
        self._block = topics.BLOCK.publisher(node)
        self._clock = topics.CLOCK.publisher(node) if clock else None
        self._now = Prefilled(topics.CLOCK.message(0))
        self.diagnostics = DiagnosticsPublisher(node, Task.DRIVE)
        """Publisher of the node's diagnostics."""
        self._name_hardware(Path(scene).stem)
        self._publishers = {topic: topic.publisher(node) for topic in STATE_TOPICS}
        self._model = topics.MODEL.publisher(node)
        self._accelerometers = Accelerometers(node)
        self._turn_vector = TurnVectorPublisher(node)
        self._streams: list[_Stream] = []
        self._subscribed: list[_Stream] = []
        self._tf_static = None
        if topics.TF.type is None:
            node.get_logger().info(
                "tf is not published: tf2_msgs is not installed; deck_pose has the deck's pose"
            )
            return
        self._publishers[topics.TF] = topics.TF.publisher(node)
        self._tf_static = topics.TF_STATIC.publisher(node)

    def begin(self, scene: Scene, channels: Sequence[str]) -> None:
        """Publish the state of a scene's drive from now on.

        Parameters
        ----------
        scene
            Scene of the drive.
        channels
            Channels of its samples.
        """
        self._name_hardware(scene.name)
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
            # Also published without sensors, because the topic is latched: the sensors of an
            # earlier scene would remain.
            placed = [(named.frame(name), _place(scene, name, named)) for name in scene.sensors]
            self._tf_static.publish(topics.TF_STATIC.message(placed))

    def _name_hardware(self, scene: str) -> None:
        """Set ``hardware_id`` for a scene, if the user has not set one."""
        self.diagnostics.hardware = self._hardware or f"{self._namespace}/{scene}".lstrip("/")

    def end(self) -> None:
        """Publish empty messages on the latched topics, to clear them."""
        self._model.publish(topics.MODEL.message(""))
        if self._tf_static is not None:
            self._tf_static.publish(topics.TF_STATIC.message([]))

    def state_values(
        self, present: Trajectory, faults: ActiveFaults
    ) -> tuple[list[float], Set[str]]:
        """Return the numbers of the last sample's state messages, and the silent sensors.

        Parameters
        ----------
        present
            Trajectory that ends with the sample.
        faults
            Faults of the drive.

        Returns
        -------
        tuple[list[float], Set[str]]
            Numbers from which ``publish_state`` selects; empty if no topic has a subscriber. Names
            of the sensors that a fault has silenced.
        """
        self._subscribed = [stream for stream in self._streams if stream.listeners()]
        if not self._subscribed:
            return [], frozenset()
        row, turning = present.samples[-1], AXES
        if self._tilts:
            present = present.last(1)
            forces = self._driven.forces(present)[0]
            turning = present.angular_acceleration[0].tolist()
        else:
            # The same forces in a third of the time, because no channel is looked up by name.
            x, y, psi, omega, theta, rate = (row[at] for at in self._driving)
            forces = self._driven.force(x, y, psi + theta, omega + rate)
        efforts = (-self._radius * forces).tolist()
        values = [*row.tolist(), *CONSTANTS.values(), *efforts, *turning]
        if not faults.faults:
            return values, frozenset()
        # Faulty sensors report altered values.
        read, silent = faults.readings(present.last(1))
        values[: len(read.channels)] = read.samples[0].tolist()
        for ball in faults.lost:
            values[self._names.index(effort(ball))] = 0.0
        return values, silent

    def publish_state(self, time_ns: int, values: list[float], silent: Set[str]) -> None:
        """Publish the results of ``state_values``, and the clock.

        Topics that had no subscriber in ``state_values`` are omitted.

        Parameters
        ----------
        time_ns
            Time of the sample [ns].
        values, silent
            Results of ``state_values``.
        """
        for stream in self._subscribed:
            if stream.sensor not in silent:
                stream.send(stream.message.at(time_ns, stream.numbers(values)))
        self.publish_clock(time_ns)

    def sampled(self, runs: Sequence[Trajectory], faults: ActiveFaults) -> None:
        """Publish all sensor samples of some integration steps, and once-per-turn vectors."""
        self._accelerometers.publish(runs, faults)
        self._turn_vector.publish(runs)

    def publish_clock(self, time_ns: int) -> None:
        """Publish simulated time [ns] on /clock, if the parameter `publish_clock` is set."""
        if self._clock is not None:
            self._clock.handle.publish_raw(self._now.at(time_ns, ()))

    def write(self, parts: Sequence[Trajectory]) -> None:
        """Publish one block with the samples of all ``parts``, unless there are none."""
        if parts and len(block := Trajectory.join(list(parts))):
            self._block.publish(topics.block_bytes(Block(block.channels, block.samples)))

    def other_clock(self) -> str:
        """Return an error text if another node publishes to this node's clock topic, else ''."""
        if self._clock is None or topics.CLOCK.publishers(self._node) < 2:
            return ""
        clock = self._node.resolve_topic_name(topics.CLOCK.name)
        return f"another simulator publishes {clock}: remap one of them, or use another domain"

    def _stream(self, topic: Topic, messages: Template) -> _Stream:
        """Return the publisher of a message template."""
        handle = self._publishers[topic].handle
        # With the C handle, because rclpy's `publish` takes twice as long.
        return _Stream(
            handle.get_subscription_count,
            handle.publish_raw,
            Prefilled(topic.message(messages.sample)),
            _numbers_at([self._names.index(name) for name in messages.numbers]),
            messages.sensor,
        )


class _Stream(NamedTuple):
    """Publisher of one message template."""

    listeners: Callable[[], int]
    """Number of subscribers."""
    send: Callable[[bytes], None]
    message: Prefilled
    numbers: Callable[[list[float]], tuple[float, ...]]
    """Function that selects the numbers of the message from all published ones."""
    sensor: str
    """Sensor that the message reports; empty: the true state."""


def _numbers_at(places: Sequence[int]) -> Callable[[list[float]], tuple[float, ...]]:
    """Return a function from a list to the tuple of its numbers at the indices ``places``."""
    selected = itemgetter(*places)
    return selected if len(places) > 1 else lambda values: (selected(values),)


def _place(scene: Scene, name: str, state: StateChannels) -> PoseSample:
    """Return the pose of a sensor in the deck's frame."""
    sensor = scene.sensors[name]
    half = 0.5 * sensor.axis_angle
    turn = (math.cos(half), 0.0, 0.0, math.sin(half))
    return PoseSample(0, sensor.position, turn, state.frame(DECK))
