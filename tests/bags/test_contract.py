"""What files say is what nodes say: quality of service, and every field of every topic."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from rosbags.interfaces import QosDurability

pytest.importorskip("rclpy", reason="needs ROS 2")
from rclpy.qos import DurabilityPolicy, HistoryPolicy, ReliabilityPolicy  # noqa: E402
from rclpy.serialization import deserialize_message, serialize_message  # noqa: E402

from ab_msgs_py import (  # noqa: E402
    Block,
    Health,
    ImuSample,
    JointSample,
    Level,
    PoseSample,
    Task,
    Topic,
    VibrationSample,
    WhirlSample,
    samples,
    topics,
)
from ab_msgs_py.set_points import SetPoint, SetPoints  # noqa: E402
from ab_sim.record.bags import contract  # noqa: E402
from ab_sim.scene import sensors  # noqa: E402

TIME = 3_123_456_789
PLACE, TURN = (0.1, -0.0, 5e-324), (0.5, 0.5, -0.5, 0.5)
SAMPLES: dict[Topic, Any] = {
    topics.COMMAND: 0.1,
    topics.JOINT_COMMAND: 0.1,
    topics.JOINT_STATES: JointSample(TIME, 1.0, 2.0, (3.0,), (4.0,), (5.0,), None, "a/b"),
    topics.VIBRATION: VibrationSample(TIME, PLACE, (1.0, 2.0, 3.0), "f"),
    topics.WHIRL: WhirlSample(TIME, PLACE),
    topics.DECK_POSE: PoseSample(TIME, PLACE, TURN),
    topics.TF: [("deck", PoseSample(TIME, PLACE, TURN))],
    topics.TF_STATIC: [],
    topics.IMU: ImuSample(TIME, PLACE, 0.25, "pickup"),
    topics.PROBE: WhirlSample(TIME, PLACE, "probe"),
    topics.ONCE_PER_TURN: WhirlSample(TIME, PLACE, "spindle"),
    topics.MODEL: "<robot/>",
    topics.DESCRIPTION: {"a": "ß"},
    topics.FAULTS: ["ball_0 sticks"],
    topics.PROFILE_STATUS: "running",
    topics.CLOCK: TIME,
    topics.DIAGNOSTICS: [Health("/a", Task.DRIVE, Level.WARN, "said", {"b": "1"}, time=TIME)],
    topics.EVENTS: samples.Event(TIME, "WARN", "left.recording.x", "said"),
}


@pytest.mark.parametrize("topic", topics.ALL, ids=[topic.name for topic in topics.ALL])
def test_quality_of_service_is_that_of_the_nodes(topic: Topic) -> None:
    profile, offered = topic.qos.profile, contract.offered_qos(topic.qos)
    assert profile.depth == offered.depth and profile.history is HistoryPolicy.KEEP_LAST
    assert profile.reliability is ReliabilityPolicy.RELIABLE
    latched = profile.durability is DurabilityPolicy.TRANSIENT_LOCAL
    assert latched == (offered.durability is QosDurability.TRANSIENT_LOCAL)


@pytest.mark.parametrize("topic", SAMPLES, ids=[topic.name for topic in SAMPLES])
def test_a_sample_survives_either_way_and_both_are_one_message(topic: Topic) -> None:
    expected = SAMPLES[topic]
    given = expected[0] if topic is topics.DIAGNOSTICS else expected
    data = contract.encoded(topic, given)
    assert topic.sample(contract.decoded(data, topic.type_name)) == expected
    if topic.type is not None:
        message = topic.message(given)
        assert topic.sample(message) == expected
        assert repr(deserialize_message(data, topic.type)) == repr(message)  # of NaN, too
        # Between the fields ROS leaves what was in memory, so bytes differ there.
        spare = 12 if topic is topics.JOINT_COMMAND else 0  # after a list that is last and empty
        assert len(serialize_message(message)) == len(data) + spare
        assert (
            topic.sample(contract.decoded(serialize_message(message), topic.type_name)) == expected
        )


def test_blocks() -> None:
    """Not among the samples: arrays do not compare by one word."""
    assert {*topics.ALL} - {*SAMPLES} == {topics.BLOCK, topics.TRAJECTORY}
    block = Block(("step", "time", "x", "y"), np.arange(12.0).reshape(3, 4))
    data = contract.encoded(topics.BLOCK, block)
    message = topics.BLOCK.message(block)
    assert repr(deserialize_message(data, topics.BLOCK.type)) == repr(message)
    for back in (message, contract.decoded(data, topics.BLOCK.type_name)):
        assert topics.BLOCK.sample(back).channels == block.channels
        assert topics.BLOCK.sample(back).samples.tobytes() == block.samples.tobytes()


def test_messages_with_other_numbers_are_what_encoding_makes_of_them() -> None:
    for topic in (topics.JOINT_STATES, topics.DECK_POSE, topics.IMU):
        sample = SAMPLES[topic]
        made = contract.prefilled(topic, sample)
        message = topic.message(sample)
        read = deserialize_message(made.at(TIME, numbers_in(message)), topic.type)
        assert repr(read) == repr(message)


def numbers_in(message: Any) -> list[float]:
    """All floating-point numbers of a message, in the order of its fields."""
    if isinstance(message, float):
        return [message]
    if hasattr(message, "get_fields_and_field_types"):
        parts = [getattr(message, name) for name in message.get_fields_and_field_types()]
    elif isinstance(message, (str, int)):
        return []
    else:
        parts = list(message)
    return [number for part in parts for number in numbers_in(part)]


def test_frames_are_those_of_the_scenes() -> None:
    assert (samples.HOUSING, samples.DECK) == (sensors.HOUSING, sensors.DECK)


def test_trajectories() -> None:
    """Bags hold them as they came. Files do not read them.

    rosbags 0.11 aligns a sequence of numbers that is empty, and ROS does not.
    """
    wanted = SetPoints(TIME, (SetPoint(0, 1.5, 0.1), SetPoint(TIME, -2.5, None)))
    data = serialize_message(topics.TRAJECTORY.message(wanted))
    back = deserialize_message(data, topics.TRAJECTORY.type)
    assert topics.TRAJECTORY.sample(back) == wanted
    with pytest.raises(ValueError, match="not a trajectory_msgs"):
        contract.decoded(data, topics.TRAJECTORY.type_name)
