"""Reader of the command topics, which passes commands to the command path and reports on them."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from typing import Any, NamedTuple

from rclpy.node import Node
from rclpy.subscription import Subscription

from ab_msgs_py import MalformedMessage, topics
from ab_msgs_py.samples import nanoseconds_of
from ab_msgs_py.topic import GID_LENGTH, Topic, arrived
from ab_sim.base.errors import CommandError, exact, shortened
from ab_sim.nodes.command_path import CommandPath, TrajectoryAnswer, WatchdogAction
from ab_sim.nodes.pacing import DurationHistogram

_PARTICIPANT = 12
"""Length of an endpoint identifier's first part, which identifies the participant [bytes]."""


class Endpoint(NamedTuple):
    """Publisher of commands."""

    topic: str
    node: str
    """Full name of the publisher's node."""
    gid: bytes
    """Identifier of the publisher in DDS."""


class CommandSources(NamedTuple):
    """Nodes that command a drive."""

    alive: int = 0
    """Number of sources; a node with publishers on several topics counts once."""
    dead: int = 0
    """Number of publishers that may be dead, although their DDS lease has not ended."""

    @staticmethod
    def of(
        endpoints: Sequence[Endpoint], senders: Collection[bytes], recent: set[bytes]
    ) -> CommandSources:
        """Count the nodes among publishers of commands, and the publishers that may be dead.

        DDS lists a killed process for another 20 s. It does not count if another process with a
        node of the same name has recently sent, because the node was then restarted. A publisher
        without recent messages may be dead, or may only send changes.

        Parameters
        ----------
        endpoints
            All publishers that DDS lists.
        senders
            Identifiers of the publishers that have sent a message at any time.
        recent
            Identifiers of the publishers that have recently sent a message.
        """
        talking = {
            (endpoint.node, endpoint.gid[:_PARTICIPANT])
            for endpoint in endpoints
            if endpoint.gid in recent
        }
        names = {node for node, _ in talking}
        publishers = Counter[tuple[str, bytes, str]]()
        dead = 0
        for topic, node, gid in endpoints:
            talks = (node, gid[:_PARTICIPANT]) in talking
            if talks or node not in names:
                publishers[node, gid[:_PARTICIPANT], topic] += 1
            dead += not talks and (node in names or gid in senders)
        counts = dict[tuple[str, bytes], int]()
        for (node, participant, _), count in publishers.items():
            source = node, participant
            counts[source] = max(counts.get(source, 0), count)
        return CommandSources(sum(counts.values()), dead)


AT_ONCE = 1000
"""Largest number of commands of a topic read at a wake-up, in about 4 ms; others remain queued."""
PAUSE = 0.1
"""Shortest time between two reports on trajectories [s]."""
_CLOCK_SET = 20_000_000
"""Change of the difference between system clock and steady clock that shows that the system clock
was set [ns]."""
_LATELY = 2.0
"""Silence after which a publisher of commands counts as possibly dead [s]."""
_MOST_REFUSALS = 20
"""Largest number of different reasons of refused joint commands that are logged."""
_TOPICS = (topics.COMMAND, topics.TRAJECTORY, topics.JOINT_COMMAND)
"""Topics of commands."""
_NAMELESS = "_NODE_NAME_UNKNOWN_"
"""Node name that rmw reports for a publisher until its node has been discovered."""

_WATCHDOG_TEXTS = {
    WatchdogAction.HOLD: "the speed is held",
    WatchdogAction.COAST: "the spindle coasts to standstill",
    WatchdogAction.STOP: "the spindle stops",
}


def unused_callback(message: Any) -> None:
    """Do nothing: the callback of subscriptions that are read at wake-ups, not by the executor."""


class PendingCommands:
    """Reader of target speeds and trajectories that were received since the last wake-up.

    The executor does not serve these subscriptions (``DriveSim.subscriptions``), so that a flood of
    commands neither delays services nor competes with the loop for Python's lock. Commands that are
    queued when a wake-up begins act in that wake-up, up to ``AT_ONCE`` of them. DDS keeps the
    newest ``topics.COMMAND.qos.depth`` queued commands; all of these are counted.

    Parameters
    ----------
    node
        Node that subscribes.
    path
        Command path to which the commands are passed.
    """

    def __init__(self, node: Node, path: CommandPath) -> None:
        self._node, self._path = node, path
        self._subscriptions: tuple[Subscription[Any], ...] = ()
        self._delays = DurationHistogram()
        self._rejections_reported = 0
        self._answered = -math.inf
        self._last_trajectory: TrajectoryAnswer | None = None
        self._publishers: list[int] = []
        self._sources = CommandSources()
        self._awake, self._taken = 0, time.monotonic_ns()
        """Total time by the steady clock without pauses, and the last reading of the clock [ns]."""
        self._last_command: dict[bytes, int] = {}
        """Value of ``_awake`` at the last command of each publisher."""
        self._renewed = False
        """True if the last command came from ros2_control, which does not repeat commands."""
        self._refusals: set[str] = set()
        """Reasons for which joint commands were refused, each of which is logged once."""
        self._steady = time.monotonic_ns() - time.time_ns()
        """Steady clock minus system clock [ns]."""
        self._wrong_type: list[str] = []
        """Warnings of the last check, about publishers of another message type."""
        self._nameless: set[tuple[int, ...]] = set()
        """Publishers whose node had no name yet at the last check."""

    def listen(self) -> None:
        """Subscribe to the topics."""
        self._subscriptions = tuple(
            topic.subscription(self._node, unused_callback) for topic in _TOPICS
        )

    def close(self) -> None:
        """Destroy the subscriptions."""
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)
        self._subscriptions, self._publishers, self._sources = (), [], CommandSources()
        self._last_command.clear()
        self._renewed = False
        self._wrong_type.clear()
        self._nameless.clear()

    def take(self, now: int, standing: bool) -> None:
        """Pass the received commands to the command path, in the order of their arrival.

        Parameters
        ----------
        now
            Present step.
        standing
            Whether time is paused; the delays of commands are then not measured.
        """
        if not self._subscriptions:
            return
        arrivals = [
            (topic, *message)
            for topic, reader in self._read()
            for message in arrived(reader, AT_ONCE)
        ]
        if len({topic for topic, *_ in arrivals}) > 1:
            arrivals.sort(key=lambda arrival: arrival[2])
        # Delays are measured by the steady clock, because the system clock may be set. If it was
        # set since the last wake-up, the times of arrival are unknown.
        steady = time.monotonic_ns()
        if not standing:
            self._awake += steady - self._taken
        self._taken = steady
        before, self._steady = self._steady, steady - time.time_ns()
        unknown = standing or abs(self._steady - before) > _CLOCK_SET
        for topic, message, received, sender in arrivals:
            self._last_command[sender] = self._awake
            stamp = 0 if unknown else received + self._steady
            self._pass_on(topic, message, now, stamp)
        if self._renewed and self._publishers[-1:] != [0]:
            self._path.renew(now)

    def _read(self) -> Iterator[tuple[Topic, Subscription[Any]]]:
        """Return each topic of commands with the subscription to it."""
        return zip(_TOPICS, self._subscriptions, strict=True)

    def _pass_on(self, topic: Topic, message: Any, now: int, stamp: int) -> None:
        """Pass a message to the command path, or count and log it if it is malformed.

        Parameters
        ----------
        topic
            Topic of the message.
        message
            Received message.
        now
            Present step.
        stamp
            Receive time by the steady clock [ns]; 0: unknown.
        """
        if topic is topics.TRAJECTORY:
            self._renewed = False
            try:
                self._path.receive_trajectory(topic.sample(message), now, stamp)
            except MalformedMessage as error:
                self._path.reject_trajectory(nanoseconds_of(message.header.stamp), str(error))
            return
        try:
            speed = topic.sample(message)
        except MalformedMessage as error:
            self._path.reject_joint_command()
            reason = shortened(str(error))  # it quotes the message, which may be of any size
            if reason not in self._refusals and len(self._refusals) < _MOST_REFUSALS:
                self._refusals.add(reason)
                self._node.get_logger().warning(f"{topic.name}, refused: {reason}; logged once")
            return
        self._renewed = topic is topics.JOINT_COMMAND
        self._path.receive(speed, now, stamp)

    def trajectories_answered(self) -> bool:
        """Return whether trajectories were answered since the last call, and log refusals.

        Answers are reported at most ten times a second, so that a flood of invalid trajectories
        does not keep the loop busy.
        """
        news, now = self._path.trajectory_news, time.monotonic()
        if not news or now - self._answered < PAUSE:
            return False
        self._answered, self._last_trajectory = now, news[-1]
        refused = [answer.refusal for answer in news if answer.refusal]
        if refused:
            others = f" ({len(refused) - 1} more were refused)" if len(refused) > 1 else ""
            name = topics.TRAJECTORY.name
            self._node.get_logger().warning(f"{name}, refused: {refused[-1]}{others}")
        news.clear()
        return True

    def outputs_published(self) -> None:
        """Record the delays of the commands that acted before the newest outputs."""
        if self._path.acted:
            now = time.monotonic_ns()
            for received in filter(None, self._path.acted):
                self._delays.add(1e-9 * max(now - received, 0))
            self._path.acted.clear()

    def publishers_changed(self) -> bool:
        """Return whether the number of publishers has changed since the last call."""
        before = self._publishers
        self._publishers = [
            subscription.get_publisher_count() for subscription in self._subscriptions
        ]
        return before != self._publishers

    def check_publishers(self) -> None:
        """Count the sources of commands, and find publishers of another message type.

        DDS silently ignores publishers of another type. The query of the ROS graph is too slow for
        every wake-up. A publisher may be discovered before the name of its node; without a name, it
        is reported from the second check on.
        """
        self._sources = self._count_sources()
        publishers = {
            tuple(info.endpoint_gid): (topic, info)
            for topic in _TOPICS[: len(self._subscriptions)]
            for info in self._publishers_of(topic)
            if info.topic_type != topic.type_name
        }
        nameless = {gid for gid, (_, info) in publishers.items() if info.node_name == _NAMELESS}
        self._wrong_type = sorted(
            {
                f"{info.node_namespace.rstrip('/')}/{info.node_name} publishes {info.topic_type} "
                f"on {self._node.resolve_topic_name(topic.name)} and is ignored: commands are "
                f"{topic.type_name}"
                for gid, (topic, info) in publishers.items()
                if gid not in nameless - self._nameless
            }
        )
        self._nameless = nameless

    def _publishers_of(self, topic: Topic) -> list[Any]:
        return self._node.get_publishers_info_by_topic(self._node.resolve_topic_name(topic.name))

    def _count_sources(self) -> CommandSources:
        """Count the sources of commands in the ROS graph, and forget publishers that have left."""
        endpoints = [
            Endpoint(
                topic.name,
                f"{info.node_namespace}/{info.node_name}",
                bytes(info.endpoint_gid[:GID_LENGTH]),
            )
            for topic in _TOPICS[: len(self._subscriptions)]
            for info in self._publishers_of(topic)
            if info.topic_type == topic.type_name
        ]
        present = {endpoint.gid for endpoint in endpoints}
        self._last_command = {
            gid: time for gid, time in self._last_command.items() if gid in present
        }
        since = self._awake - round(_LATELY * 1e9)
        return CommandSources.of(
            endpoints, self._last_command, {g for g, t in self._last_command.items() if t >= since}
        )

    def warnings(self) -> list[str]:
        """Return warnings for the diagnostics."""
        path, warnings = self._path, [*self._wrong_type]
        if path.stopped:
            warnings.append("emergency stop: commands are ignored until ~/reset_emergency_stop")
        elif path.silent:
            rules = path.rules
            warnings.append(
                f"no command for {rules.age_limit:g} s: {_WATCHDOG_TEXTS[rules.silence]}"
            )
        if self._sources.alive > 1:
            names = " and ".join(
                self._node.resolve_topic_name(topic.name)
                for topic, count in zip(_TOPICS, self._publishers, strict=True)
                if count
            )
            alive, dead = self._sources
            maybe = f", {dead} possibly dead" if dead else ""
            warnings.append(
                f"{alive} publishers on {names}{maybe}: the drive follows the newest command"
            )
        return warnings

    def values(self, now: int) -> dict[str, str]:
        """Return values for the diagnostics at step ``now``; counts begin at the configuration."""
        path, age = self._path, self._path.age(now)
        state = "emergency stop" if path.stopped else "watchdog" if path.silent else "commands"
        if path.trajectory is not None:
            state = "trajectory"
        answer = self._last_trajectory
        return {
            "sources of commands": str(self._sources.alive),
            "sources possibly dead": str(self._sources.dead),
            "commands accepted": str(path.accepted),
            "commands rejected": str(path.rejected),
            "commands ignored": str(path.ignored),
            "commands dropped from the bus": str(path.dropped),
            "command age [s]": "none yet" if age is None else f"{age:.6g}",
            "speed set by": state,
            topics.TRAJECTORY_START: "none yet" if answer is None else str(answer.start),
            topics.TRAJECTORY_ANSWER: "" if answer is None else answer.refusal or topics.FOLLOWED,
            "watchdog has acted": str(path.silences),
            "speed limit [rad/s]": f"{path.limits.max_speed:g}",
            "acceleration limit [rad/s^2]": f"{path.limits.max_acceleration:g}",
            **self._delays.values("command to output"),
        }

    def rejections(self) -> str:
        """Return a text on the commands rejected since the last call; empty if there are none.

        There is one text for all, because a log message takes a hundred times as long as a command.
        """
        path = self._path
        rejected = path.rejected - path.rejected_with_report
        count, self._rejections_reported = rejected - self._rejections_reported, rejected
        if not count:
            return ""
        try:
            path.limits.check(path.last_rejected)
        except CommandError as error:
            return f"commands rejected: {count}, the last one: {error}"
        last = exact(path.last_rejected)
        return f"commands rejected: {count}, the last one: {last} rad/s, above the earlier limit"
