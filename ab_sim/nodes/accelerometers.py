"""Publishers of every sample of a drive's accelerometers and probes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

from rclpy.node import Node
from rclpy.publisher import Publisher

from ab_msgs_py import ImuSample, Topic, WhirlSample, topics
from ab_msgs_py.imu import FORCE
from ab_msgs_py.prefilled import Prefilled
from ab_msgs_py.samples import frame_of
from ab_sim.drive.faults.active import ActiveFaults
from ab_sim.drive.sensing import noise_variance
from ab_sim.drive.trajectory import Trajectory, taken
from ab_sim.scene import Scene
from ab_sim.scene.sensors import steps_per_sample


class _Stream(NamedTuple):
    """Publisher of one sensor, and the conversion of its samples."""

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
        steps, forces = faults.sampled(self.name, rows[:, 0], rows[:, at : at + self.axes])
        for step, (x, y, *z) in zip(steps.tolist(), forces.tolist(), strict=True):
            force = x, y, z[0] if z else 0.0
            self.publisher.publish(self.message.at(int(step) * self.step_ns, force))


class Accelerometers:
    """Publishes every sample of a scene's accelerometers and probes.

    Args:
        node: publishing node; its namespace is part of the frames' names.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._publishers: dict[str, Publisher[Any]] = {}
        self._streams: list[_Stream] = []

    def begin(self, scene: Scene) -> None:
        """Publish this scene's sensors from now on, and warn of sensors that may alias."""
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
            _Stream(
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
