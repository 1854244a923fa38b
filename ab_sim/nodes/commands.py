"""Commands from a topic: taken at wake-ups, judged, counted."""

from rclpy.node import Node

from ab_msgs_py import topics
from ab_msgs_py.samples import command_of
from ab_sim.errors import CommandError
from ab_sim.spindle import SpeedServo

AT_ONCE = 1000
"""Most commands taken at a wake-up: some 4 ms. The others wait, so that a flood stops no clock."""


class Commands:
    """What has been commanded since the last wake-up.

    The executor does not answer this subscription (``DriveSim.subscriptions``): a flood then makes
    no service wait behind it, and no thread fight the loop for Python's lock. What is in the
    subscription's queue when a wake-up begins acts in that wake-up, up to ``AT_ONCE`` of them. DDS
    keeps the newest ``topics.COMMAND.qos.depth`` that wait, whoever sent them; these are all
    counted.

    Args:
        node: it listens as.
        servo: says what may be followed.
    """

    def __init__(self, node: Node, servo: SpeedServo) -> None:
        self._servo = servo
        self.subscription = topics.COMMAND.subscription(node, lambda _: None)
        self.accepted = self.rejected = 0
        self._told = 0
        self._last = 0.0
        self._newest: float | None = None

    @property
    def sources(self) -> int:
        """How many publish commands."""
        return self.subscription.get_publisher_count()

    def take(self) -> None:
        """Judge what has come; rejecting costs no more than accepting."""
        for message in topics.arrived(self.subscription, AT_ONCE):
            speed = command_of(message)
            if self._servo.accepts(speed):
                self.accepted += 1
                self._newest = speed
            else:
                self.rejected += 1
                self._last = speed

    def newest(self) -> float | None:
        """The last good one since this was asked [rad/s]: of those that act at once it remains."""
        newest, self._newest = self._newest, None
        return newest

    def refusals(self) -> str:
        """What has been rejected since this was asked, for people; nothing, if nothing was.

        Asked now and then, as a log entry costs a hundred times what a command does.
        """
        count, self._told = self.rejected - self._told, self.rejected
        if not count:
            return ""
        try:
            self._servo.check(self._last)
        except CommandError as error:
            return f"rejected {count} commands, the last one: {error}"
        raise AssertionError(f"rejected what may be followed: {self._last}")
