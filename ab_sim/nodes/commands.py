"""Commands from the topic: read at wake-ups, passed to the command path, reported."""

import time
from typing import Any

from rclpy.node import Node
from rclpy.subscription import Subscription

from ab_msgs_py import topics
from ab_msgs_py.topic import arrived
from ab_sim.errors import CommandError, exact
from ab_sim.nodes.command_path import CommandPath, WatchdogAction
from ab_sim.nodes.duration_histogram import DurationHistogram

AT_ONCE = 1000
"""Largest number of commands read at a wake-up, in some 4 ms; the others wait in the queue."""
NAMELESS = "_NODE_NAME_UNKNOWN_"
"""Name that rmw gives the node of a publisher until it has discovered the node."""

WATCHDOG_TEXTS = {
    WatchdogAction.HOLD: "the speed is held",
    WatchdogAction.COAST: "the spindle coasts to standstill",
    WatchdogAction.STOP: "the spindle stops",
}


def not_called(message: Any) -> None:
    """Callback of a subscription that is read at wake-ups and not by the executor."""


class PendingCommands:
    """The commands received since the last wake-up.

    The executor does not serve this subscription (``DriveSim.subscriptions``), so that a flood of
    commands neither delays services nor competes with the loop for Python's lock. Commands that are
    in the queue when a wake-up begins act in that wake-up, up to ``AT_ONCE`` of them. DDS keeps the
    newest ``topics.COMMAND.qos.depth`` that wait; these are all counted.

    Args:
        node: the subscriber.
        path: receives the commands.
    """

    def __init__(self, node: Node, path: CommandPath) -> None:
        self._node, self._path = node, path
        self._subscription: Subscription[Any] | None = None
        self._delays = DurationHistogram()
        self._rejections_reported = 0
        self._sources = 0
        self._wrong_type: dict[tuple[int, ...], str] = {}
        """Publishers of another type at the last check: the message for people, by endpoint."""
        self._nameless: set[tuple[int, ...]] = set()
        """Publishers whose node had no name yet."""

    def listen(self) -> None:
        """Subscribe to the topic."""
        self._subscription = topics.COMMAND.subscription(self._node, not_called)

    def close(self) -> None:
        """Destroy the subscription."""
        if self._subscription is not None:
            self._node.destroy_subscription(self._subscription)
        self._subscription, self._sources = None, 0
        self._wrong_type.clear()
        self._nameless.clear()

    def take(self, now: int, standing: bool) -> None:
        """Pass the commands received by a step to the command path.

        Args:
            now: the step.
            standing: whether time stands still: then the commands' delays are not measured.
        """
        if self._subscription is not None:
            # By the steady clock: the system clock may be set in the meantime.
            steady = time.monotonic_ns() - time.time_ns()
            for message, received in arrived(self._subscription, AT_ONCE):
                self._path.receive(
                    topics.COMMAND.sample(message), now, 0 if standing else received + steady
                )

    def outputs_published(self) -> None:
        """Record the delays of commands that acted in the outputs just published."""
        if self._path.acted:
            now = time.monotonic_ns()
            for received in filter(None, self._path.acted):
                self._delays.add(1e-9 * max(now - received, 0))
            self._path.acted.clear()

    def publishers_changed(self) -> bool:
        """Whether the number of publishers has changed since the last call."""
        before = self._sources
        if self._subscription is not None:
            self._sources = self._subscription.get_publisher_count()
        return before != self._sources

    def check_publisher_types(self) -> None:
        """Log publishers of another type on the topic, which DDS ignores silently.

        It queries the graph, which is too slow for every wake-up. A publisher is logged when it is
        found. The name of its node may be discovered later: without a name it is logged at the
        second check.
        """
        if self._subscription is None:
            return
        before, topic = self._wrong_type, self._subscription.topic_name
        found = {
            tuple(info.endpoint_gid): info
            for info in self._node.get_publishers_info_by_topic(topic)
            if info.topic_type != topics.COMMAND.type_name
        }
        nameless = {gid for gid, info in found.items() if info.node_name == NAMELESS}
        self._wrong_type = {
            gid: (
                f"{info.node_namespace.rstrip('/')}/{info.node_name} publishes {info.topic_type} "
                f"on {topic} and is not heard: commands are {topics.COMMAND.type_name}"
            )
            for gid, info in found.items()
            if gid not in nameless - self._nameless
        }
        self._nameless = nameless
        for endpoint in self._wrong_type.keys() - before.keys():
            self._node.get_logger().warning(self._wrong_type[endpoint])

    def warnings(self) -> list[str]:
        """Warnings for the diagnostics."""
        path, warnings = self._path, sorted(self._wrong_type.values())
        if path.stopped:
            warnings.append("emergency stop: commands are ignored until ~/reset_emergency_stop")
        elif path.silent:
            rules = path.rules
            warnings.append(
                f"no command for {rules.age_limit:g} s: {WATCHDOG_TEXTS[rules.silence]}"
            )
        if self._sources > 1:
            topic = self._node.resolve_topic_name(topics.COMMAND.name)
            warnings.append(
                f"{self._sources} publishers on {topic}: the last to speak leads the drive"
            )
        return warnings

    def values(self, now: int) -> dict[str, str]:
        """Values for the diagnostics; counts begin when the scene is configured."""
        path, age = self._path, self._path.age(now)
        state = "emergency stop" if path.stopped else "watchdog" if path.silent else "commands"
        return {
            "sources of commands": str(self._sources),
            "commands accepted": str(path.accepted),
            "commands rejected": str(path.rejected),
            "commands ignored": str(path.ignored),
            "commands dropped from the bus": str(path.dropped),
            "command age [s]": "none yet" if age is None else f"{age:.6g}",
            "led by": state,
            "watchdog has acted": str(path.silences),
            "speed limit [rad/s]": f"{path.limits.max_speed:g}",
            "acceleration limit [rad/s^2]": f"{path.limits.max_acceleration:g}",
            **self._delays.values("command to output"),
        }

    def rejections(self) -> str:
        """Text on the commands rejected since the last call; empty without any.

        It is called once per report: a log message takes a hundred times as long as a command.
        """
        path = self._path
        count, self._rejections_reported = path.rejected - self._rejections_reported, path.rejected
        if not count:
            return ""
        try:
            path.limits.check(path.last_rejected)
        except CommandError as error:
            return f"rejected {count} commands, the last one: {error}"
        last = exact(path.last_rejected)
        return f"rejected {count} commands, the last one: {last} rad/s, beyond the limit then"
