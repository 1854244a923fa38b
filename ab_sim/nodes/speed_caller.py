"""Client that publishes one speed command, and reports the drive's reaction."""

from typing import Any, NamedTuple

from rclpy.duration import Duration

from ab_msgs_py import Health, topics
from ab_sim.base.errors import AbSimError, InputError, Refused
from ab_sim.model.spindle import SpeedServo
from ab_sim.nodes.caller import ANSWER, Caller
from ab_sim.nodes.session import INACTIVE

COUNTS = ("commands accepted", "commands rejected", "commands ignored")
ROUNDED = 1.0 + 1e-5
"""Factor on the speed limit, because diagnostics report it with six digits only; up to the enlarged
limit the drive decides."""

SPEED_WAIT = 1.0
"""Longest time to wait for the drive's present speed [s], which is part of the answer."""


class AcceptedSpeed(NamedTuple):
    """Command that the drive has accepted."""

    before: float | None
    """Spindle speed before the command [rad/s]; None if the drive publishes none."""
    limits: SpeedServo
    """Limits of the drive's commands."""
    health: Health
    """Diagnostics of the drive after the command."""

    @property
    def standing(self) -> bool:
        """True if the drive's time is paused."""
        return self.health.message.startswith("paused")

    @property
    def other_sources(self) -> int:
        """Number of other nodes that publish commands."""
        return max(int(self.health.values["sources of commands"]) - 1, 0)


class SpeedCaller(Caller):
    """Service client that can also command a speed."""

    def command(self, node: str, speed: float) -> AcceptedSpeed:
        """Publish a speed command when a drive subscribes, and wait for the drive's reaction.

        Args:
            node: full name of the drive's node.
            speed: target speed of the spindle [rad/s].

        Raises:
            InputError: the drive does not exist.
            CommandError: the speed exceeds the drive's limit.
            Refused: the drive does not subscribe to commands, or ignores them.
            AbSimError: the drive does not report the command.
        """
        healths: list[Health] = []
        speeds: list[float] = []

        def receive(message: Any) -> None:
            healths.extend(h for h in topics.DIAGNOSTICS.sample(message) if h.node == node)

        namespace = node.rpartition("/")[0]
        topic, joints = (
            topic._replace(name=topic.within(namespace))
            for topic in (topics.COMMAND, topics.JOINT_STATES)
        )
        topics.DIAGNOSTICS.subscription(self._node, receive)
        joints.subscription(
            self._node, lambda message: speeds.append(joints.sample(message).spindle_speed)
        )
        publisher = topic.publisher(self._node)

        if not self._until(lambda: healths and _counts(healths[-1]), self._timeout):
            raise InputError(self._no_drive_text(node, healths))
        if healths[-1].message == INACTIVE:
            raise Refused(f"{node}: {INACTIVE}; nothing was commanded")
        if not self._until(publisher.get_subscription_count, self._timeout):
            raise Refused(f"{node} does not subscribe to {topic.name} (waited {self._timeout:g} s)")
        limits = _limits(healths[-1])
        if abs(speed) > limits.max_speed * ROUNDED:
            limits.check(speed)
        if healths[-1].values["led by"] == "emergency stop":
            raise Refused(
                f"{node}: commands are ignored after an emergency stop, until reset-emergency-stop"
            )
        # A drive whose time is paused publishes no speed.
        self._until(lambda: speeds, SPEED_WAIT)
        before, seen = _counts(healths[-1]), len(healths)
        standing_at = speeds[-1] if speeds else None
        publisher.publish(topic.message(speed))
        publisher.wait_for_all_acked(Duration(seconds=ANSWER))
        if not self._until(lambda: len(healths) > seen and _counts(healths[-1]) != before, ANSWER):
            raise AbSimError(f"{node} did not report the command within {ANSWER:g} s")
        health = healths[-1]
        accepted, *others = (now - then for now, then in zip(_counts(health), before, strict=True))
        if not accepted and any(others):
            raise Refused(f"{node} has not followed the command: {health.message}")
        return AcceptedSpeed(standing_at, _limits(health), health)

    def _no_drive_text(self, node: str, healths: list[Health]) -> str:
        if healths:
            return f"{node} accepts no commands; its message is: {healths[-1].message}"
        nodes = self.nodes()
        there = f"found {', '.join(sorted(nodes))}" if nodes else self.no_nodes_text
        return (
            f"there is no drive {node} (waited {self._timeout:g} s); {there}; start one, or choose "
            "another with --namespace and --node"
        )


def _counts(health: Health) -> tuple[int, ...]:
    """Return the numbers of accepted, rejected and ignored commands; empty if not reported."""
    return tuple(int(health.values[key]) for key in COUNTS if key in health.values)


def _limits(health: Health) -> SpeedServo:
    speed, acceleration = (
        float(health.values[key]) for key in ("speed limit [rad/s]", "acceleration limit [rad/s^2]")
    )
    return SpeedServo(speed, acceleration)
