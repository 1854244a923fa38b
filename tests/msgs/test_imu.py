"""Readings as sensor_msgs/Imu: made as bytes they are what they are as objects."""

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="needs ROS 2")

from rclpy.serialization import deserialize_message  # noqa: E402
from sensor_msgs.msg import Imu  # noqa: E402

from ab_msgs_py.prefilled import Prefilled  # noqa: E402
from ab_msgs_py.samples import FORCE, ImuSample  # noqa: E402
from ab_msgs_py.topics import IMU, imu_of  # noqa: E402

TIMES = (0, 999_999_999, 12_345_678_901, 2_147_483_647_999_999_999)
FORCES = ((0.0, -0.0, 1.0), (0.1, -2.5e-300, 3e300), (5e-324, 9.80665, -1 / 3), (1.0, 2.0, 3.0))


@pytest.mark.parametrize("frame", ["a", "left/pickup", "a/long/namespace/of/it", "ä" * 7])
def test_bytes_are_those_of_the_message(frame: str) -> None:
    prefilled = Prefilled(IMU.message(ImuSample(0, (0.0, 0.0, 0.0), 0.25, frame)), FORCE)
    made = [prefilled.at(time, force) for time, force in zip(TIMES, FORCES, strict=True)]
    for time, force, message in zip(TIMES, FORCES, made, strict=True):
        sample, sent = ImuSample(time, force, 0.25, frame), deserialize_message(message, Imu)
        assert sent == IMU.message(sample) and IMU.sample(sent) == sample


def test_what_is_not_reported_is_marked() -> None:
    message = IMU.message(ImuSample(0, (1.0, 2.0, 3.0), 0.5, "a"))
    assert message.orientation_covariance.tolist() == [-1.0, *[0.0] * 8]
    assert message.angular_velocity_covariance.tolist() == [-1.0, *[0.0] * 8]
    covariance = np.reshape(message.linear_acceleration_covariance, (3, 3))
    np.testing.assert_array_equal(covariance, 0.5 * np.eye(3))


def test_the_first_sensor_is_the_imu_and_others_are_beside_it() -> None:
    assert imu_of("pickup", first=True) is IMU and IMU.name == "imu/data_raw"
    assert imu_of("pickup", first=False).name == "imu_pickup/data_raw"
