"""What files say is what nodes say: names, types, quality of service, every field."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="needs ROS 2")
from rclpy.qos import DurabilityPolicy  # noqa: E402
from rclpy.serialization import deserialize_message, serialize_message  # noqa: E402

from ab_msgs_py import (  # noqa: E402
    Block,
    JointSample,
    PoseSample,
    Task,
    VibrationSample,
    WhirlSample,
    samples,
    topics,
)
from ab_sim.bags import contract, messages  # noqa: E402

TIME = 3_123_456_789
VECTOR = np.array([0.1, -0.0, 5e-324])


def test_topics_are_those_of_the_nodes() -> None:
    assert [topic.name for topic in topics.ALL] == list(contract.KINDS)
    every = [each for each in vars(topics).values() if isinstance(each, topics.Topic)]
    assert set(map(id, every)) == set(map(id, topics.ALL))
    for topic in topics.ALL:
        kind = contract.KINDS[topic.name]
        assert kind.depth == topic.qos.depth
        assert kind.latched == (topic.qos.durability is DurabilityPolicy.TRANSIENT_LOCAL)
        if topic.type is not None:
            package = topic.type.__module__.partition(".")[0]
            assert kind.type == f"{package}/msg/{topic.type.__name__}"


def test_tasks_are_those_of_the_nodes() -> None:
    assert [task.value for task in Task] == list(contract.TASKS)


def test_messages_are_those_of_the_nodes() -> None:
    block = np.random.default_rng(0).normal(size=(3, 4))
    channels = ("step", "time", "x", "y")
    place, turn = (0.1, -0.0, 5e-324), (0.5, 0.5, -0.5, 0.5)
    pairs = (
        (Block(channels, block).message(), messages.block_message(channels, block)),
        (
            JointSample(TIME, 1.0, 2.0, (3.0,), (4.0,), (5.0,), None, "a/b").message(),
            messages.joint_message(
                TIME, "a/b", np.array([1.0, 3.0]), np.array([2.0, 4.0]), np.array([math.nan, 5.0])
            ),
        ),
        (
            VibrationSample(TIME, place, (1.0, 2.0, 3.0), "f").message(),
            messages.vibration_message(TIME, "f", VECTOR, np.array([1.0, 2.0, 3.0])),
        ),
        (
            WhirlSample(TIME, place).message(),
            messages.whirl_message(TIME, messages.HOUSING, VECTOR),
        ),
        (
            PoseSample(TIME, place, turn).message(),
            messages.pose_message(TIME, samples.HOUSING, VECTOR, np.array(turn)),
        ),
        (samples.description_message({"a": "ß"}), messages.description_message({"a": "ß"})),
        (samples.text_message("running"), messages.text_message("running")),
        (samples.command_message(0.1), messages.number_message(0.1)),
        (samples.clock_message(TIME), messages.clock_message(TIME)),
    )
    for ours, theirs in pairs:
        assert repr(deserialize_message(theirs, type(ours))) == repr(ours)  # of NaN, too
        # Between the fields ROS leaves what was in memory, so bytes differ there.
        assert len(serialize_message(ours)) == len(theirs), type(ours)
    assert samples.DECK == messages.DECK
    for namespace in ("/", "/left", "/a/b"):
        assert samples.frame_of(namespace, "deck") == messages.frame_of(namespace, "deck")


def test_log_entries_come_back_as_nodes_read_them() -> None:
    data = messages.log_message(TIME, "WARN", "left.recording.x", "said")
    entry = deserialize_message(data, topics.EVENTS.type)
    assert samples.event_of(entry) == (TIME, "WARN", "left.recording.x", "said")
