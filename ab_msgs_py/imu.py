"""An accelerometer's readings as sensor_msgs/Imu."""

from dataclasses import dataclass

from sensor_msgs.msg import Imu

from ab_msgs_py.prefilled import Prefilled
from ab_msgs_py.samples import Triple, nanoseconds_of

_FORCE = slice(25, 28)
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

    def message(self) -> Imu:
        """As Imu."""
        message = Imu()
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(self.time, 10**9)
        message.header.frame_id = self.frame
        force = message.linear_acceleration
        force.x, force.y, force.z = self.force
        message.orientation_covariance[0] = message.angular_velocity_covariance[0] = -1.0
        for axis in range(3):
            message.linear_acceleration_covariance[4 * axis] = self.variance
        return message

    @classmethod
    def of(cls, message: Imu) -> "ImuSample":
        """Out of an Imu."""
        force = message.linear_acceleration
        return cls(
            nanoseconds_of(message.header.stamp),
            (force.x, force.y, force.z),
            float(message.linear_acceleration_covariance[0]),
            str(message.header.frame_id),
        )


class ImuEncoder:
    """Makes such messages as bytes: made and published in a fourth of the time of objects.

    Args:
        frame: of the sensor's axes.
        variance: as of `ImuSample`.
    """

    def __init__(self, frame: str, variance: float) -> None:
        sample = ImuSample(0, (0.0, 0.0, 0.0), variance, frame)
        self._made = Prefilled(sample.message(), _FORCE)

    def message(self, time: int, force: Triple) -> bytes:
        """In CDR, for `Publisher.publish`; arguments as of `ImuSample`."""
        return self._made.at(time, force)
