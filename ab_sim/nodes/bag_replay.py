"""A bag, published again with its timing."""

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
from ab_msgs_py.services import PAUSE, Answer, serve_switch
from ab_sim.bags import Bag
from ab_sim.bags.contract import topic_by_name
from ab_sim.bags.importing import choose_namespace
from ab_sim.errors import InputError, Interrupted
from ab_sim.nodes.log import PlainLog
from ab_sim.nodes.process import run_node

DISCOVERY = 1.0
"""s before the first message, in which listeners that are there are found."""
GLANCE = 0.05
"""s between two looks at whether it is to pause or to stop."""
LAST_WORDS = 5.0
"""s for listeners to acknowledge the last messages."""

Progress = Callable[[int, int], None]
"""Is told how many seconds of the bag are done, of how many."""


class BagReplay(PlainLog):
    """Publishes a bag's messages as they are, each topic with the quality of service it had.

    A message goes out when as much time has passed as on the bag's clock, divided by the rate; one
    that is late goes at once, and none is left out. What is being simulated is told before all
    else, once the listeners are there.

    Args:
        bag: open.
        namespace: of the drive of which, with the topics outside of namespaces; None: of all.
        rate: how many times as fast.
        paused: wait for ``~/pause`` with false.

    Raises:
        InputError: a type of the bag is not installed, or the namespace is none in it.
    """

    def __init__(self, bag: Bag, namespace: str | None, rate: float, paused: bool) -> None:
        super().__init__("replay")
        self._bag, self._rate, self._paused = bag, rate, paused
        self.left_out: dict[str, str] = {}
        """Topics that cannot be published, and why."""
        self._topics: dict[str, Publisher[Any]] = {}
        for name in chosen(bag, namespace):
            topic = bag.topics[name]
            try:
                made: Any = class_of(topic.type)
            except ImportError as error:
                self.left_out[name] = f"{topic.type} is not installed ({error})"
                continue
            self._topics[name] = self.create_publisher(made, name, _profile(name, topic.qos))
        if not self._topics:
            raise InputError(f"{bag.path}: nothing to replay: {self.left_out or 'no topics'}")
        serve_switch(self, PAUSE, self.pause)

    def pause(self, pause: bool) -> Answer:
        """Pause, or resume."""
        self._paused = pause
        return True, "paused" if pause else "running"

    def run(self, stopping: threading.Event, progress: Progress) -> int:
        """Publish until there is no more, and wait until it has arrived; how many messages.

        Raises:
            Interrupted: told to stop.
            InputError: a simulator publishes the same clock.
            RecordingError: the bag is torn.
        """
        stopping.wait(DISCOVERY)
        self._refuse_other_publishers()
        published = self._publish_descriptions()
        begin, end = self._bag.span
        count, start, last_update = len(published), time.monotonic(), -1
        for topic, stamp, data in self._bag.messages(self._topics):
            # Once, in its place, it is left out.
            if published.pop(topic, None) == data:
                continue
            due = (stamp - begin) * 1e-9 / self._rate
            start += self._wait(stopping, start + due)
            self._topics[topic].publish(data)
            count += 1
            if (seconds := (stamp - begin) // 10**9) != last_update:
                progress(seconds, -((begin - end) // 10**9))
                last_update = seconds
        until = time.monotonic() + LAST_WORDS
        for publisher in self._topics.values():
            left = Duration(seconds=max(until - time.monotonic(), 0.0))
            publisher.wait_for_all_acked(left)
        return count

    def _wait(self, stopping: threading.Event, until: float) -> float:
        """Until a time; returns how long it was paused meanwhile [s]."""
        paused = 0.0
        while True:
            if stopping.is_set():
                raise Interrupted("interrupted")
            now = time.monotonic()
            if self._paused:
                stopping.wait(GLANCE)
                paused += time.monotonic() - now
            elif (left := until + paused - now) > 0:
                stopping.wait(min(left, GLANCE))
            else:
                return paused

    def _publish_descriptions(self) -> dict[str, bytes]:
        published = {}
        for name, publisher in self._topics.items():
            if name.endswith(f"/{topics.DESCRIPTION.name}"):
                for message in self._bag.messages({name}):
                    publisher.publish(message.data)
                    published[name] = message.data
                    break
        return published

    def _refuse_other_publishers(self) -> None:
        for name in self._topics:
            if name.endswith("/clock") and self.count_publishers(name) > 1:
                raise InputError(
                    f"somebody else publishes {name}: end that simulator, or replay on a domain of "
                    "its own, e.g. ROS_DOMAIN_ID=17 ab-sim replay ..."
                )


def replay(
    path: Path,
    namespace: str | None,
    rate: float,
    paused: bool,
    bar: Callable[[], AbstractContextManager[Progress]],
) -> None:
    """Replay a bag, and end the process; see `BagReplay`. The bar is gone by then."""
    with Bag(path) as bag:
        run_node(
            lambda: BagReplay(bag, namespace, rate, paused),
            lambda node, stopping: _run(node, stopping, bar),
            ["ab-sim"],
        )


def _run(
    node: BagReplay,
    stopping: threading.Event,
    bar: Callable[[], AbstractContextManager[Progress]],
) -> None:
    for name, why in node.left_out.items():
        node.get_logger().warning(f"{name} is left out: {why}")
    with bar() as progress:
        count = node.run(stopping, progress)
    node.get_logger().info(f"published {count} messages")


def chosen(bag: Bag, namespace: str | None) -> list[str]:
    """Topics to replay: all, or those of a namespace and those outside of any."""
    if namespace is None:
        return list(bag.topics)
    own = choose_namespace(bag, namespace).rstrip("/") + "/"
    outside = {topic.name for topic in topics.ALL if topic.name.startswith("/")}
    if f"{own}clock" in bag.topics:
        outside.discard("/clock")
    return [name for name in bag.topics if name.startswith(own) or name in outside]


def _profile(name: str, qos: Qos | None) -> QoSProfile:
    """What was offered, as far as it matters to who listens; by default as the contract says."""
    if qos is None:
        known = topic_by_name(name)
        return known.qos.profile if known else QoSProfile(depth=10)
    latched = qos.durability is QosDurability.TRANSIENT_LOCAL
    unsure = qos.reliability is QosReliability.BEST_EFFORT
    return QoSProfile(
        depth=min(max(qos.depth, 1), 5000),
        reliability=ReliabilityPolicy.BEST_EFFORT if unsure else ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )
