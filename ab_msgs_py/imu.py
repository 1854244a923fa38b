"""Readings of an accelerometer as sensor_msgs/Imu."""

from dataclasses import dataclass
from typing import Any

from ab_msgs_py.ros_messages import Fields
from ab_msgs_py.samples import Triple, axes, header, nanoseconds_of

FORCE = slice(25, 28)
"""Positions of the acceleration among the numbers of a message."""


@dataclass(frozen=True)
class ImuSample:
    """Reading of an accelerometer at one instant as ``imu/data_raw`` (REP-145).

    The axes are the sensor's. Orientation and angular velocity are marked as not reported: their
    covariance begins with -1.
    """

    time: int
    """Simulated time [ns]."""
    force: Triple
    """Specific force on the sensor's axes [m/s^2]."""
    variance: float
    """Variance of the noise on each axis [(m/s^2)^2]; 0: unknown."""
    frame: str

    def fields(self) -> Fields:
        """Return the fields of an Imu."""
        unknown = [-1.0] + [0.0] * 8
        nothing = axes((0.0, 0.0, 0.0))
        return {
            "header": header(self.time, self.frame),
            "orientation": {**nothing, "w": 1.0},
            "orientation_covariance": unknown,
            "angular_velocity": nothing,
            "angular_velocity_covariance": unknown,
            "linear_acceleration": axes(self.force),
            "linear_acceleration_covariance": [
                self.variance if k % 4 == 0 else 0.0 for k in range(9)
            ],
        }

    @classmethod
    def of(cls, message: Any) -> "ImuSample":
        """Return the sample in an Imu."""
        force = message.linear_acceleration
        return cls(
            nanoseconds_of(message.header.stamp),
            (force.x, force.y, force.z),
            float(message.linear_acceleration_covariance[0]),
            str(message.header.frame_id),
        )
