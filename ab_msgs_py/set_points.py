"""Speed set-points over time, the content of ``spindle/trajectory``."""

from typing import Any, NamedTuple

from ab_msgs_py.ros_messages import Fields, MalformedMessage
from ab_msgs_py.samples import nanoseconds_of, stamp

JOINT = "spindle"
"""Name of the only joint that follows a trajectory."""
MOST_POINTS = 2000
"""Largest number of points of a trajectory; the drive processes all of them between two steps."""


class SetPoint(NamedTuple):
    """Speed of the spindle at one instant."""

    time: int
    """Time since the start of the trajectory [ns]."""
    speed: float
    """Speed of the spindle [rad/s]."""
    acceleration: float | None = None
    """Acceleration from this point to the next [rad/s^2]; None: derived from the speeds."""


class SetPoints(NamedTuple):
    """Trajectory of the spindle: its speed is linear between points, and held after the last."""

    start: int
    """Simulated time of the start [ns]; 0: when the drive receives the message."""
    points: tuple[SetPoint, ...]

    @property
    def text(self) -> str:
        """Return a summary in one line, for logs and recordings."""
        first, last = self.points[0], self.points[-1]
        return (
            f"trajectory from t = {self.start * 1e-9:g} s: {len(self.points)} points, "
            f"{first.speed:g} to {last.speed:g} rad/s in {last.time * 1e-9:g} s"
        )

    def fields(self) -> Fields:
        """Return the fields of a JointTrajectory."""
        return {
            "header": {"stamp": stamp(self.start), "frame_id": ""},
            "joint_names": [JOINT],
            "points": [
                {
                    "positions": [],
                    "velocities": [float(speed)],
                    "accelerations": [] if acceleration is None else [float(acceleration)],
                    "effort": [],
                    "time_from_start": stamp(time),
                }
                for time, speed, acceleration in self.points
            ],
        }

    @classmethod
    def of(cls, message: Any) -> "SetPoints":
        """Return the set-points in a JointTrajectory.

        Raises
        ------
        MalformedMessage
            The message names other joints than the spindle; or it has no or too many points; or a
            point does not have one velocity and at most one acceleration.
        """
        if list(message.joint_names) != [JOINT]:
            raise MalformedMessage(
                f"joint_names = {[*message.joint_names]}: must be [{JOINT!r}], the only joint that "
                "follows a trajectory"
            )
        if not 1 <= len(message.points) <= MOST_POINTS:
            raise MalformedMessage(
                f"points: there are {len(message.points)}, and 1 to {MOST_POINTS} are allowed; "
                "send a long trajectory in parts, each with its own header.stamp"
            )
        points = []
        for number, point in enumerate(message.points):
            values = {
                name: len(getattr(point, name))
                for name in ("positions", "velocities", "accelerations", "effort")
            }
            if values["positions"] or values["effort"]:
                raise MalformedMessage(
                    f"points[{number}]: has positions or effort; the spindle follows velocities, "
                    "leave the others empty"
                )
            if values["velocities"] != 1 or values["accelerations"] > 1:
                raise MalformedMessage(
                    f"points[{number}]: has {values['velocities']} velocities and "
                    f"{values['accelerations']} accelerations; give one velocity [rad/s], and one "
                    "acceleration [rad/s^2] or none"
                )
            accelerations = [float(value) for value in point.accelerations]
            points.append(
                SetPoint(
                    nanoseconds_of(point.time_from_start),
                    float(point.velocities[0]),
                    accelerations[0] if accelerations else None,
                )
            )
        return cls(nanoseconds_of(message.header.stamp), tuple(points))
