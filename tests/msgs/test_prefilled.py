"""Messages as bytes: what rclpy would serialise, byte for byte, with nothing in the gaps."""

import math
from collections.abc import Sequence
from typing import Any

import pytest

pytest.importorskip("rclpy", reason="needs ROS 2")

from diagnostic_msgs.msg import DiagnosticStatus  # noqa: E402
from rclpy.serialization import deserialize_message, serialize_message  # noqa: E402
from sensor_msgs.msg import Imu  # noqa: E402

from ab_msgs_py import JointSample, PoseSample, VibrationSample, WhirlSample, topics  # noqa: E402
from ab_msgs_py.prefilled import Prefilled  # noqa: E402
from ab_msgs_py.samples import nanoseconds_of  # noqa: E402

TIME = 12_345_678_901
FRAMES = ("", "a", "ab", "abc", "drive_housing", "left/drive_housing", "Gehäuse")
"""Of all lengths that alignment tells apart."""


def check(template: Any, message: Any, numbers: Sequence[float]) -> None:
    """Prefilled from a message with other numbers, it is this one."""
    made = Prefilled(template)
    made.at(1, [math.inf] * len(numbers))
    found, expected = made.at(TIME, numbers), serialize_message(message)
    assert len(found) == len(expected)
    # What rclpy leaves in gaps is whatever has been in memory before.
    gaps = [f for f, e in zip(found, expected, strict=True) if f != e]
    assert gaps == [0] * len(gaps)
    read = deserialize_message(found, type(message))
    assert repr(read) == repr(message), "so gaps they are; by repr, for NaN is not itself"


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("balls", [0, 1, 2, 5, 11])
def test_joints(frame: str, balls: int) -> None:
    nothing = JointSample(0, 0.0, 0.0, (0.0,) * balls, (0.0,) * balls, (0.0,) * balls, 0.0, frame)
    angles, rates, torques = (
        tuple(first + i for i in range(balls)) for first in (0.1, -5e-324, 1e300)
    )
    message = topics.JOINT_STATES.message
    for torque in (None, -1.5e-3):
        sample = JointSample(TIME, 1e9 + 0.125, -0.0, angles, rates, torques, torque, frame)
        effort = math.nan if torque is None else torque
        numbers = [sample.spindle_angle, *angles, sample.spindle_speed, *rates, effort, *torques]
        check(message(nothing), message(sample), numbers)


@pytest.mark.parametrize("frame", FRAMES)
def test_places_and_accelerations(frame: str) -> None:
    none, place, turn = (0.0, 0.0, 0.0), (1e-4, -2e-3, 3e-5), (0.5, -0.5, 0.1, 0.7)
    whirl = topics.WHIRL.message(WhirlSample(TIME, place, frame))
    check(topics.WHIRL.message(WhirlSample(0, none, frame)), whirl, place)
    shaken = VibrationSample(TIME, place, (10.0, -20.0, 30.0), frame)
    message = topics.VIBRATION.message
    check(
        message(VibrationSample(0, none, frame=frame)), message(shaken), [*place, 10.0, -20.0, 30.0]
    )
    nowhere, pose = PoseSample(0, none, (0.0, *none), frame), PoseSample(TIME, place, turn, frame)
    numbers = [*place, *turn[1:], turn[0]]
    check(topics.DECK_POSE.message(nowhere), topics.DECK_POSE.message(pose), numbers)
    if topics.TF.type is not None:
        children = ("deck", "ball_0", "spindle")
        check(
            topics.TF.message((child, nowhere) for child in children),
            topics.TF.message((child, pose) for child in children),
            numbers * len(children),
        )


def test_arrays_of_fixed_length_and_messages_without_numbers() -> None:
    message = Imu(orientation_covariance=[-1.0, *[0.0] * 8])
    message.header.stamp = topics.CLOCK.message(TIME).clock
    read = deserialize_message(
        Prefilled(Imu()).at(TIME, [0.0] * 3 + [1.0] + [-1.0] + [0.0] * 32), Imu
    )
    assert repr(read) == repr(message)
    check(topics.CLOCK.message(0), topics.CLOCK.message(TIME), ())
    assert nanoseconds_of(topics.CLOCK.message(TIME).clock) == TIME


def test_what_cannot_be_prefilled_is_said() -> None:
    with pytest.raises(ValueError, match="type octet cannot be"):
        Prefilled(DiagnosticStatus())
