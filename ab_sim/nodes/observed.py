"""What a drive shows of itself at every wake-up, on the topics that anybody can read."""

import math
from collections.abc import Callable, Iterable, Sequence, Set
from operator import itemgetter
from typing import Any, NamedTuple

from rclpy.node import Node
from rclpy.publisher import Publisher

from ab_msgs_py import JointSample, PoseSample, VibrationSample, WhirlSample, topics
from ab_msgs_py.prefilled import Prefilled
from ab_msgs_py.samples import DECK, HOUSING, frame_of, text_message
from ab_msgs_py.topics import transforms
from ab_sim.drive.driving_forces import DrivenBalls
from ab_sim.drive.faults.active import ActiveFaults
from ab_sim.drive.faults.fault import SPINDLE, VIBRATION
from ab_sim.drive.trajectory import Trajectory
from ab_sim.drive.urdf import urdf_of
from ab_sim.nodes.accelerometers import Accelerometers
from ab_sim.scene import Scene

NOTHING = {"zero": 0.0, "one": 1.0, "none": math.nan}
"""Numbers of messages for which a drive has nothing to show."""
NO_AXES = ("zero", "zero", "zero")
TURNING = ("turning x", "turning y", "turning z")
"""The deck's angular acceleration. No channel has a blank in its name."""
AXES, NO_TURN = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)
"""What messages are made with; whatever they show is written over it."""


class Observed:
    """Publishes samples: joints, vibration, whirl, and the deck's pose, as tf too.

    Beside them what is observed, as a URDF, and every sample of its accelerometers.
    A deck in the plane has all of these: it moves along two axes and does not turn. tf is published
    where tf2_msgs is installed; the log says so if not.

    Args:
        node: it publishes as; its namespace is part of the frames' names.
    """

    def __init__(self, node: Node) -> None:
        self._namespace = node.get_namespace()
        self._housing, self._deck = self._frame(HOUSING), self._frame(DECK)
        self._joints = topics.JOINT_STATES.publisher(node)
        self._vibration = topics.VIBRATION.publisher(node)
        self._whirl = topics.WHIRL.publisher(node)
        self._pose = topics.DECK_POSE.publisher(node)
        self._model = topics.MODEL.publisher(node)
        self._accelerometers = Accelerometers(node)
        self._streams: list[_Stream] = []
        self._heard: list[_Stream] = []
        self._tf = None
        if topics.TF.type is None:
            node.get_logger().info(
                "tf is not published: tf2_msgs is not installed; deck_pose says where the deck is"
            )
            return
        self._tf = topics.TF.publisher(node)
        self._tf_static = topics.TF_STATIC.publisher(node)

    def begin(self, scene: Scene, channels: Sequence[str]) -> None:
        """What is observed from now on.

        Args:
            scene: what the samples are of.
            channels: that they have.
        """
        self._driven, self._radius = DrivenBalls.of(scene), scene.race.radius
        self._model.publish(text_message(urdf_of(scene)))
        self._accelerometers.begin(scene)
        self._tilts = "qw" in channels
        first = channels.index("ball_0_angle") if scene.balls.count else 0
        balls = [slice(k, first + 2 * scene.balls.count, 2) for k in (first, first + 1)]
        self._driving = [*map(channels.index, ("x", "y", "angle", "speed")), *balls]
        self._shown = [*channels, *NOTHING, *_efforts(scene), *TURNING]
        self._streams = [
            self._of_joints(scene),
            *self._of_vibration(scene),
            self._of(self._whirl, WhirlSample(0, AXES, self._housing).message(), self._ways("xyz")),
        ]
        pose = PoseSample(0, AXES, NO_TURN, self._housing)
        turn = ["qx", "qy", "qz", "qw"] if self._tilts else ["zero", "zero", "zero", "one"]
        placed = [*self._ways("xyz"), *turn]
        self._streams.append(self._of(self._pose, pose.message(), placed))
        if self._tf is not None:
            moving = transforms([pose.transform(self._deck)])
            self._streams.append(self._of(self._tf, moving, placed))
            # Latched: of a scene without sensors, too, or those of another one would stay.
            places = (self._of_sensor(scene, name) for name in scene.sensors)
            self._tf_static.publish(transforms(places))

    def end(self) -> None:
        """Nothing is observed any more: who comes late is not told of what has been."""
        self._model.publish(text_message(""))
        if self._tf is not None:
            self._tf_static.publish(transforms([]))

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
        return [*row.tolist(), *NOTHING.values(), *efforts, *turning]

    def heard(self, shown: list[float], present: Trajectory, faults: ActiveFaults) -> Set[str]:
        """Put what faulty sensors say into what ``look`` has seen of the same; who says nothing."""
        heard, silent = faults.readings(present.last(1))
        shown[: len(heard.channels)] = heard.samples[0].tolist()
        for ball in faults.lost:
            shown[self._shown.index(_effort(ball))] = 0.0
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

    def _of(
        self, publisher: Publisher[Any], message: Any, numbers: Sequence[str], sensor: str = ""
    ) -> "_Stream":
        """Messages like this one, whose numbers have these names among what is shown."""
        places = map(self._shown.index, numbers)
        # Past rclpy's publisher, whose ways cost as much as sending does.
        listeners, send = publisher.handle.get_subscription_count, publisher.handle.publish_raw
        return _Stream(listeners, send, Prefilled(message), itemgetter(*places), sensor)

    def _of_joints(self, scene: Scene) -> "_Stream":
        none = (0.0,) * scene.balls.count
        sample = JointSample(0, 0.0, 0.0, none, none, none, 0.0, self._housing)
        angles, rates = (
            [f"ball_{i}_{what}" for i in range(scene.balls.count)] for what in ("angle", "rate")
        )
        torque = "motor_torque" if "motor_torque" in self._shown else "none"
        numbers = ["angle", *angles, "speed", *rates, torque, *_efforts(scene)]
        return self._of(self._joints, sample.message(), numbers, SPINDLE)

    def _of_vibration(self, scene: Scene) -> list["_Stream"]:
        """Of each accelerometer, or of the deck if there is none."""
        turning = TURNING if self._tilts else NO_AXES
        shaken = [
            (name, self._frame(name), [*self._ways([f"{name}_{k}" for k in (1, 2, 3)]), *NO_AXES])
            for name in scene.sensors
        ] or [(VIBRATION, self._housing, [*self._ways(["ax", "ay", "az"]), *turning])]
        made = [VibrationSample(0, AXES, frame=frame).message() for _, frame, _ in shaken]
        return [
            self._of(self._vibration, message, numbers, sensor)
            for message, (sensor, _, numbers) in zip(made, shaken, strict=True)
        ]

    def _ways(self, names: Sequence[str]) -> list[str]:
        """Along three axes: a deck in the plane does not move along the shaft."""
        return [*names] if self._tilts else [*names[:2], "zero"]

    def _frame(self, name: str) -> str:
        return frame_of(self._namespace, name)

    def _of_sensor(self, scene: Scene, name: str) -> Any:
        sensor = scene.sensors[name]
        half = 0.5 * sensor.axis_angle
        turn = (math.cos(half), 0.0, 0.0, math.sin(half))
        return PoseSample(0, sensor.position, turn, self._deck).transform(self._frame(name))


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


def _efforts(scene: Scene) -> list[str]:
    return [_effort(i) for i in range(scene.balls.count)]


def _effort(ball: int) -> str:
    return f"effort of ball {ball}"
