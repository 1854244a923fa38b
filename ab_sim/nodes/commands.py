"""Commands from a topic: taken at wake-ups, put on their path, reported."""

import time
from typing import Any

from rclpy.node import Node
from rclpy.subscription import Subscription

from ab_msgs_py import topics
from ab_msgs_py.topic import arrived
from ab_sim.errors import CommandError, exact
from ab_sim.nodes.command_path import CommandPath, Silence
from ab_sim.nodes.duration_histogram import DurationHistogram

AT_ONCE = 1000
"""Most commands taken at a wake-up: some 4 ms. The others wait, so that a flood stops no clock."""
NAMELESS = "_NODE_NAME_UNKNOWN_"
"""What rmw calls the node of a publisher that it has not been told of yet."""

ON_SILENCE = {
    Silence.HOLD: "the speed is held",
    Silence.COAST: "the spindle coasts to standstill",
    Silence.STOP: "the spindle stops",
}


def at_wake_ups(message: Any) -> None:
    """In the place of a callback, which nobody is to call: marks what wake-ups take themselves."""


class PendingCommands:
    """What has been commanded since the last wake-up.

    The executor does not answer their subscription (``DriveSim.subscriptions``): a flood then makes
    no service wait behind it, and no thread fight the loop for Python's lock. What is in the
    subscription's queue when a wake-up begins acts in that wake-up, up to ``AT_ONCE`` of them. DDS
    keeps the newest ``topics.COMMAND.qos.depth`` that wait, whoever sent them; these are all
    counted.

    Args:
        node: it listens as.
        path: where they go.
    """

    def __init__(self, node: Node, path: CommandPath) -> None:
        self._node, self._path = node, path
        self._subscription: Subscription[Any] | None = None
        self._delays = DurationHistogram()
        self._told = 0
        self._sources = 0
        self._unheard: dict[tuple[int, ...], str] = {}
        """Publishers of another type, as they were last looked for: what is wrong, by endpoint."""
        self._nameless: set[tuple[int, ...]] = set()
        """Those whose node had no name yet."""

    def listen(self) -> None:
        """From now on; what was commanded before is not heard."""
        self._subscription = topics.COMMAND.subscription(self._node, at_wake_ups)

    def close(self) -> None:
        """Listen no more."""
        if self._subscription is not None:
            self._node.destroy_subscription(self._subscription)
        self._subscription, self._sources = None, 0
        self._unheard.clear()
        self._nameless.clear()

    def take(self, now: int, standing: bool) -> None:
        """Put on their path what has come by a step; rejecting costs no more than accepting.

        Args:
            now: the step.
            standing: whether time stands still: such a command waits as long as somebody likes.
        """
        if self._subscription is not None:
            # On the steady clock: the system's may be set while a command is on its way.
            steady = time.monotonic_ns() - time.time_ns()
            for message, received in arrived(self._subscription, AT_ONCE):
                self._path.hear(
                    topics.COMMAND.sample(message), now, 0 if standing else received + steady
                )

    def shown(self) -> None:
        """Outputs have been published: of those commands that have led to them it was the first."""
        if self._path.acted:
            now = time.monotonic_ns()
            for received in filter(None, self._path.acted):
                self._delays.add(1e-9 * max(now - received, 0))
            self._path.acted.clear()

    def others_came(self) -> bool:
        """Whether there are more or fewer who can command than at the last call."""
        before = self._sources
        if self._subscription is not None:
            self._sources = self._subscription.get_publisher_count()
        return before != self._sources

    def look_for_other_types(self) -> None:
        """Whether somebody publishes something else on the topic, which DDS passes over silently.

        Takes a query of the graph: not for every wake-up. Each one is logged when it is found; the
        name of its node may be known some time after its publisher, so that without one it is
        logged at the second look.
        """
        if self._subscription is None:
            return
        before, topic = self._unheard, self._subscription.topic_name
        found = {
            tuple(info.endpoint_gid): info
            for info in self._node.get_publishers_info_by_topic(topic)
            if info.topic_type != topics.COMMAND.type_name
        }
        nameless = {gid for gid, info in found.items() if info.node_name == NAMELESS}
        self._unheard = {
            gid: (
                f"{info.node_namespace.rstrip('/')}/{info.node_name} publishes {info.topic_type} "
                f"on {topic} and is not heard: commands are {topics.COMMAND.type_name}"
            )
            for gid, info in found.items()
            if gid not in nameless - self._nameless
        }
        self._nameless = nameless
        for endpoint in self._unheard.keys() - before.keys():
            self._node.get_logger().warning(self._unheard[endpoint])

    def news(self) -> list[str]:
        """What is wrong, for people."""
        path, news = self._path, sorted(self._unheard.values())
        if path.stopped:
            news.append("emergency stop: commands are ignored until ~/reset_emergency_stop")
        elif path.silent:
            rules = path.rules
            news.append(f"no command for {rules.age_limit:g} s: {ON_SILENCE[rules.silence]}")
        if self._sources > 1:
            topic = self._node.resolve_topic_name(topics.COMMAND.name)
            news.append(f"{self._sources} publishers on {topic}: the last to speak leads the drive")
        return news

    def values(self, now: int) -> dict[str, str]:
        """For the diagnostics; counts are since the scene was configured."""
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

    def refusals(self) -> str:
        """What has been rejected since this was asked, for people; nothing, if nothing was.

        Asked now and then, as a log entry costs a hundred times what a command does.
        """
        path = self._path
        count, self._told = path.rejected - self._told, path.rejected
        if not count:
            return ""
        try:
            path.limits.check(path.last_rejected)
        except CommandError as error:
            return f"rejected {count} commands, the last one: {error}"
        last = exact(path.last_rejected)
        return f"rejected {count} commands, the last one: {last} rad/s, beyond the limit then"
