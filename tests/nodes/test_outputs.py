"""What goes out as bytes is what the drive says of itself, number by number and name by name."""

import math
import time
from collections.abc import Iterator
from typing import Any

import pytest

pytest.importorskip("rclpy", reason="needs ROS 2")

import rclpy  # noqa: E402
from rclpy.node import Node  # noqa: E402

from ab_msgs_py import JointSample, PoseSample, VibrationSample, WhirlSample, topics  # noqa: E402
from ab_msgs_py.topic import arrived  # noqa: E402
from ab_sim.drive import Drive  # noqa: E402
from ab_sim.drive.faults.active import ActiveFaults  # noqa: E402
from ab_sim.nodes.outputs import Outputs  # noqa: E402
from ab_sim.scene import load_scene  # noqa: E402
from tests.waiting import until

pytestmark = pytest.mark.ros

TIME = 12_345_678_901
FRAME = "left/drive_housing"
HEARD = (topics.JOINT_STATES, topics.VIBRATION, topics.WHIRL, topics.DECK_POSE)


@pytest.fixture
def node(domain: int) -> Iterator[Node]:
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain)
    made = rclpy.create_node("shows", context=context, namespace="left")
    yield made
    made.destroy_node()
    rclpy.shutdown(context=context)


def heard(subscription: Any, count: int) -> list[Any]:
    messages: list[Any] = []
    end = time.monotonic() + 30.0
    while len(messages) < count:
        assert time.monotonic() < end, f"{len(messages)} of {count} on {subscription.topic_name}"
        messages += [message for message, *_ in arrived(subscription, 10)]
        time.sleep(0.01)
    return messages


@pytest.mark.parametrize(
    ("scene", "changes"),
    [
        ("thesis-hold", []),
        ("thesis-hold", ["sensors.effort={}", "sensors.side.axis_angle=1.5"]),
        ("feeding-deck", ["balls.race=[0, 1]", "race.height=[0.004, -0.002]"]),
        ("weak-motor", []),
    ],
)
def test_topics_show_the_drive(node: Node, scene: str, changes: list[str]) -> None:
    drive = Drive(load_scene(scene, changes), commanded=True)
    drive.command(100.0)
    taken = drive.advance(50)
    now, sensors = drive.observe(), drive.scene.sensors
    observed = Outputs(node, scene, hardware="", clock=False)
    # Begun before with another scene: nothing of it is left.
    other = Drive(load_scene("nsc-case-1"))
    observed.begin(other.scene, other.channels)
    observed.begin(drive.scene, drive.channels)
    subscriptions = [topic.subscription(node, print) for topic in HEARD]
    names = [subscription.topic_name for subscription in subscriptions]
    publishers = [each for each in node.publishers if each.topic_name in names]
    until(lambda: all(p.get_subscription_count() for p in publishers), "they know each other")
    observed.publish_state(TIME, *observed.state_values(taken, ActiveFaults(drive)))
    joints, vibration, whirl, pose = (
        heard(subscription, max(len(sensors), 1) if topic is topics.VIBRATION else 1)
        for topic, subscription in zip(HEARD, subscriptions, strict=True)
    )

    shown = JointSample.of(joints[0])
    assert (shown.time, shown.frame) == (TIME, FRAME)
    assert (shown.spindle_angle, shown.spindle_speed) == (now.psi, now.omega)
    assert shown.ball_angles == tuple(now.theta) and shown.ball_rates == tuple(now.theta_rate)
    efforts = -now.driving_force * drive.scene.race.radius
    assert shown.ball_torques == pytest.approx(efforts.tolist(), rel=1e-12)
    assert any(shown.ball_torques)
    torque = math.nan if shown.spindle_torque is None else shown.spindle_torque
    assert torque == pytest.approx(now.motor_torque, nan_ok=True, rel=1e-12)

    def three(vector: Any) -> tuple[float, ...]:
        return (*vector.tolist(), 0.0)[:3]

    samples = {sample.frame: sample for sample in map(VibrationSample.of, vibration)}
    expected = {f"left/{name}": (three(now.readings[name]), (0.0, 0.0, 0.0)) for name in sensors}
    moved = {FRAME: (three(now.acceleration), tuple(now.angular_acceleration.tolist()))}
    for frame, (linear, angular) in (expected or moved).items():
        sample = samples.pop(frame)
        assert sample.time == TIME and sample.linear == pytest.approx(linear, rel=1e-12)
        assert sample.angular == pytest.approx(angular, rel=1e-12)
    assert not samples, "and no others"
    place, (w, x, y, z) = three(now.position), now.turn.tolist()
    assert WhirlSample.of(whirl[0]) == WhirlSample(TIME, place, FRAME)
    assert PoseSample.of(pose[0]) == PoseSample(TIME, place, (w, x, y, z), FRAME)
