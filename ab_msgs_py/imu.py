"""An accelerometer's readings as sensor_msgs/Imu."""

from dataclasses import dataclass
from typing import Any

from ab_msgs_py.ros_messages import Fields
from ab_msgs_py.samples import Triple, axes, header, nanoseconds_of

FORCE = slice(25, 28)
"""Which of a message's numbers the acceleration is."""


@dataclass(frozen=True)
class ImuSample:
    """What an accelerometer reads at one instant, as ``imu/data_raw``; nothing turns it (REP-145).

    Orientation and angular velocity are marked as not reported, by a covariance that begins with
    -1.
    """

    time: int
    """Simulated time [ns]."""
    force: Triple
    """Specific force on the sensor's axes [m/s^2]."""
    variance: float
    """Of each axis' noise [(m/s^2)^2]; 0: not known."""
    frame: str

    def fields(self) -> Fields:
        """As Imu."""
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
        """Out of an Imu."""
        force = message.linear_acceleration
        return cls(
            nanoseconds_of(message.header.stamp),
            (force.x, force.y, force.z),
            float(message.linear_acceleration_covariance[0]),
            str(message.header.frame_id),
        )
