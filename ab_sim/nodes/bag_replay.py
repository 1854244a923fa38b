"""Replay of a bag's messages at the intervals at which they were recorded."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from rclpy.duration import Duration
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosbags.interfaces import Qos, QosDurability, QosReliability

from ab_msgs_py import topics
from ab_msgs_py.ros_messages import class_of
from ab_msgs_py.services import PAUSE, Answer
from ab_sim.base.errors import InputError, Interrupted
from ab_sim.base.presentation import CountProgress
from ab_sim.nodes.base_node import BaseNode
from ab_sim.nodes.process import run_node
from ab_sim.record.bags.contract import topic_by_name
from ab_sim.record.bags.reader import Bag, choose_namespace

_DISCOVERY = 1.0
"""Time before the first message for the discovery of subscribers [s]."""
GLANCE = 0.05
"""Time between two checks for a pause or a stop [s]."""
_ACKNOWLEDGED = 5.0
"""Longest time for subscribers to acknowledge the last messages [s]."""


class BagReplay(BaseNode):
    """Publishes a bag's messages unchanged, each topic with its recorded quality of service.

    A message is published when the elapsed time equals its time on the bag's clock, divided by the
    rate. A late message is published immediately, so that none is missing. The drive description is
    published first, after the discovery of subscribers.

    Parameters
    ----------
    bag
        Open bag.
    namespace
        Namespace of the drive to replay, with the topics outside of namespaces; None: all topics.
    rate
        Playback speed factor.
    paused
        Whether to wait until ``~/pause`` is called with false.

    Raises
    ------
    InputError
        A type of the bag is not installed, or the bag lacks the namespace.
    """

    def __init__(self, bag: Bag, namespace: str | None, rate: float, paused: bool) -> None:
        super().__init__("replay")
        self._bag, self._rate, self._paused = bag, rate, paused
        self.left_out: dict[str, str] = {}
        """Topics that cannot be published, and the reasons."""
        self._topics: dict[str, Publisher[Any]] = {}
        for name in chosen(bag, namespace):
            topic = bag.topics[name]
            try:
                message_class: Any = class_of(topic.type)
            except ImportError as error:
                self.left_out[name] = f"{topic.type} is not installed ({error})"
                continue
            self._topics[name] = self.create_publisher(
                message_class, name, _profile(name, topic.qos)
            )
        if not self._topics:
            raise InputError(f"{bag.path}: nothing to replay: {self.left_out or 'no topics'}")
        self.offer_switch(PAUSE, self.pause)

    def pause(self, pause: bool) -> Answer:
        """Pause or resume the replay."""
        self._paused = pause
        return True, "paused" if pause else "running"

    def run(self, stopping: threading.Event, progress: CountProgress) -> int:
        """Publish all messages, wait until they have arrived, and return the number published.

        Parameters
        ----------
        stopping
            Set when the process is to exit.
        progress
            Progress callback.

        Raises
        ------
        Interrupted
            A stop was requested.
        InputError
            A simulator publishes the same clock.
        RecordingError
            The bag is damaged.
        """
        stopping.wait(_DISCOVERY)
        self._refuse_other_publishers()
        published = self._publish_descriptions()
        begin, end = self._bag.span
        count, start, last_update = len(published), time.monotonic(), -1
        for topic, stamp, data in self._bag.messages(self._topics):
            # A description that was published before all others is not repeated.
            if published.pop(topic, None) == data:
                continue
            due = (stamp - begin) * 1e-9 / self._rate
            start += self._wait(stopping, start + due)
            self._topics[topic].publish(data)
            count += 1
            if (seconds := (stamp - begin) // 10**9) != last_update:
                progress(seconds, -((begin - end) // 10**9))
                last_update = seconds
        until = time.monotonic() + _ACKNOWLEDGED
        for publisher in self._topics.values():
            remaining = Duration(seconds=max(until - time.monotonic(), 0.0))
            publisher.wait_for_all_acked(remaining)
        return count

    def _wait(self, stopping: threading.Event, until: float) -> float:
        """Wait until a time on the steady clock [s], and return the duration of pauses [s]."""
        paused = 0.0
        while True:
            if stopping.is_set():
                raise Interrupted("interrupted")
            now = time.monotonic()
            if self._paused:
                stopping.wait(GLANCE)
                paused += time.monotonic() - now
            elif (remaining := until + paused - now) > 0:
                stopping.wait(min(remaining, GLANCE))
            else:
                return paused

    def _publish_descriptions(self) -> dict[str, bytes]:
        """Publish the first description of each drive; return them by topic, serialised.

        Recorders need the description before the first samples.
        """
        published = {}
        for name, publisher in self._topics.items():
            if name.endswith(f"/{topics.DESCRIPTION.name}"):
                for message in self._bag.messages({name}):
                    publisher.publish(message.data)
                    published[name] = message.data
                    break
        return published

    def _refuse_other_publishers(self) -> None:
        """Refuse to replay while another node publishes a clock of the bag, as time would jump."""
        for name in self._topics:
            if name.endswith("/clock") and self.count_publishers(name) > 1:
                raise InputError(
                    f"another node publishes {name}: end that simulator, or replay on another "
                    "domain, e.g. ROS_DOMAIN_ID=17 ab-sim replay ..."
                )


def replay(
    path: Path,
    namespace: str | None,
    rate: float,
    paused: bool,
    bar: Callable[[], AbstractContextManager[CountProgress]],
) -> None:
    """Replay a bag, close the progress bar, and exit the process.

    Parameters
    ----------
    path
        Folder or file of the bag.
    namespace
        See `BagReplay`.
    rate
        Playback speed factor.
    paused
        See `BagReplay`.
    bar
        Returns the context manager of a progress bar.
    """
    with Bag(path) as bag:
        run_node(
            lambda: BagReplay(bag, namespace, rate, paused),
            lambda node, stopping: _run(node, stopping, bar),
            ["ab-sim"],
        )


def _run(
    node: BagReplay,
    stopping: threading.Event,
    bar: Callable[[], AbstractContextManager[CountProgress]],
) -> None:
    for name, why in node.left_out.items():
        node.get_logger().warning(f"{name} is not published: {why}")
    with bar() as progress:
        count = node.run(stopping, progress)
    node.get_logger().info(f"published {count} messages")


def chosen(bag: Bag, namespace: str | None) -> list[str]:
    """Return the topics to replay: all, or those of a namespace and those outside of any."""
    if namespace is None:
        return list(bag.topics)
    prefix = choose_namespace(bag, namespace).rstrip("/") + "/"
    outside = {topic.name for topic in topics.ALL if topic.name.startswith("/")}
    if f"{prefix}clock" in bag.topics:
        outside.discard("/clock")
    return [name for name in bag.topics if name.startswith(prefix) or name in outside]


def _profile(name: str, qos: Qos | None) -> QoSProfile:
    """Return the QoS of a topic's publisher: as recorded, else as in the contract.

    Only the policies that decide whether subscribers match are copied.
    """
    if qos is None:
        topic = topic_by_name(name)
        return topic.qos.profile if topic else QoSProfile(depth=10)
    latched = qos.durability is QosDurability.TRANSIENT_LOCAL
    unsure = qos.reliability is QosReliability.BEST_EFFORT
    return QoSProfile(
        depth=min(max(qos.depth, 1), 5000),
        reliability=ReliabilityPolicy.BEST_EFFORT if unsure else ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )
