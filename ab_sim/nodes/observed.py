"""What a drive shows of itself at every wake-up, on the topics that anybody can read."""

import math
from typing import Any

import numpy as np
from rclpy.node import Node

from ab_msgs_py import JointSample, PoseSample, VibrationSample, WhirlSample, topics
from ab_msgs_py.samples import DECK, HOUSING, Triple, frame_of
from ab_msgs_py.topics import transforms
from ab_sim.drive.observation import Observation
from ab_sim.scene import Scene


class Observed:
    """Publishes observations: joints, vibration, whirl, and the deck's pose, as tf too.

    A deck in the plane has all of these: it moves along two axes and does not turn. tf is published
    where tf2_msgs is installed; the log says so if not.

    Args:
        node: it publishes as; its namespace is part of the frames' names.
    """

    def __init__(self, node: Node) -> None:
        self._radius = math.nan
        self._namespace = node.get_namespace()
        self._housing, self._deck = self._frame(HOUSING), self._frame(DECK)
        self._joints = topics.JOINT_STATES.publisher(node)
        self._vibration = topics.VIBRATION.publisher(node)
        self._whirl = topics.WHIRL.publisher(node)
        self._pose = topics.DECK_POSE.publisher(node)
        self._tf = None
        if topics.TF.type is None:
            node.get_logger().info(
                "tf is not published: tf2_msgs is not installed; deck_pose says where the deck is"
            )
            return
        self._tf = topics.TF.publisher(node)
        self._tf_static = topics.TF_STATIC.publisher(node)

    def begin(self, scene: Scene) -> None:
        """What is observed from now on."""
        self._radius = scene.race.radius
        if self._tf is not None and scene.sensors:
            places = (self._of_sensor(scene, name) for name in scene.sensors)
            self._tf_static.publish(transforms(places))

    def publish(self, time: int, now: Observation) -> None:
        """Publish an observation, stamped with a time [ns]."""
        joints = JointSample(
            time,
            now.psi,
            now.omega,
            tuple(now.theta.tolist()),
            tuple(now.theta_rate.tolist()),
            tuple((-now.driving_force * self._radius).tolist()),
            None if math.isnan(now.motor_torque) else now.motor_torque,
            self._housing,
        )
        self._joints.publish(joints.message())
        if now.readings:
            for name, reading in now.readings.items():
                read = VibrationSample(time, _triple(reading), frame=self._frame(name))
                self._vibration.publish(read.message())
        else:
            linear, angular = _triple(now.acceleration), _triple(now.angular_acceleration)
            moved = VibrationSample(time, linear, angular, self._housing)
            self._vibration.publish(moved.message())
        place = _triple(now.position)
        self._whirl.publish(WhirlSample(time, place, self._housing).message())
        w, x, y, z = now.turn.tolist()
        pose = PoseSample(time, place, (w, x, y, z), self._housing)
        self._pose.publish(pose.message())
        if self._tf is not None:
            self._tf.publish(transforms([pose.transform(self._deck)]))

    def _frame(self, name: str) -> str:
        return frame_of(self._namespace, name)

    def _of_sensor(self, scene: Scene, name: str) -> Any:
        sensor = scene.sensors[name]
        half = 0.5 * sensor.axis_angle
        turn = (math.cos(half), 0.0, 0.0, math.sin(half))
        return PoseSample(0, sensor.position, turn, self._deck).transform(self._frame(name))


def _triple(vector: np.ndarray) -> Triple:
    """Along three axes: a deck in the plane does not move along the shaft."""
    x, y, z = (*vector.tolist(), 0.0)[:3]
    return x, y, z
