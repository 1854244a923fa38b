"""The topic contract: samples survive the way through messages; malformed ones are named."""

import math

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="needs ROS 2")

import rclpy  # noqa: E402
from rclpy.serialization import deserialize_message, serialize_message  # noqa: E402
from std_msgs.msg import Float64MultiArray, String  # noqa: E402

from ab_msgs_py import (  # noqa: E402
    Block,
    Health,
    JointSample,
    Level,
    MalformedMessage,
    PoseSample,
    Task,
    VibrationSample,
    WhirlSample,
)
from ab_msgs_py.samples import (  # noqa: E402
    clock_message,
    command_message,
    command_of,
    description_message,
    description_of,
    faults_message,
    faults_of,
    frame_of,
    nanoseconds_of,
    stamp,
)
from ab_msgs_py.topics import (  # noqa: E402
    BLOCK,
    CLOCK,
    COMMAND,
    DECK_POSE,
    DIAGNOSTICS,
    JOINT_STATES,
    VIBRATION,
    WHIRL,
)

TIME = 12_345_678_901


def over_the_wire(message: object) -> object:
    return deserialize_message(serialize_message(message), type(message))


def test_the_table_of_topics() -> None:
    relative = (COMMAND, JOINT_STATES, VIBRATION, WHIRL, DECK_POSE, BLOCK)
    table = {t.name: t.type.__name__ for t in relative}
    assert table == {
        "spindle/command": "Float64",
        "joint_states": "JointState",
        "vibration": "AccelStamped",
        "whirl": "PointStamped",
        "deck_pose": "PoseStamped",
        "vibration/block": "Float64MultiArray",
    }
    assert CLOCK.name == "/clock" and DIAGNOSTICS.name == "/diagnostics"


@pytest.mark.ros
def test_an_override_is_of_one_topic_and_one_end() -> None:
    """Topics share their profiles, and rclpy writes the overrides of one into what it is given."""
    deeper = JOINT_STATES.qos.depth + 1
    override = f"qos_overrides./joint_states.publisher.depth:={deeper}"
    context = rclpy.Context()
    rclpy.init(args=["--ros-args", "-p", override], context=context)
    node = rclpy.create_node("overridden", context=context)
    try:
        assert JOINT_STATES.publisher(node).qos_profile.depth == deeper
        assert JOINT_STATES.subscription(node, print).qos_profile.depth == deeper - 1
        assert WHIRL.publisher(node).qos_profile.depth == deeper - 1
    finally:
        node.destroy_node()
        rclpy.shutdown(context=context)


def test_stamps_are_integers() -> None:
    assert nanoseconds_of(stamp(TIME)) == TIME
    assert (stamp(TIME).sec, stamp(TIME).nanosec) == (12, 345_678_901)
    assert nanoseconds_of(over_the_wire(clock_message(TIME)).clock) == TIME  # type: ignore[attr-defined]


def test_joints() -> None:
    sample = JointSample(TIME, 1e9 + 0.125, 100.0, (0.1, -2.0), (0.5, -0.5), (1e-4, 2e-4))
    message = sample.message()
    assert list(message.name) == ["spindle", "ball_0", "ball_1"]
    assert math.isnan(message.effort[0]), "the motor's torque is not modelled"
    assert JointSample.of(over_the_wire(message)) == sample  # type: ignore[arg-type]


def test_the_motors_torque_is_the_spindles_effort() -> None:
    sample = JointSample(TIME, 1.0, 2.0, (), (), (), -1.5e-3)
    assert sample.message().effort[0] == -1.5e-3
    assert JointSample.of(over_the_wire(sample.message())) == sample  # type: ignore[arg-type]


def test_joints_without_balls() -> None:
    sample = JointSample(0, 0.0, 0.0, (), (), ())
    assert JointSample.of(sample.message()) == sample


@pytest.mark.parametrize("field", ["name", "position", "velocity", "effort"])
def test_malformed_joints(field: str) -> None:
    message = JointSample(TIME, 1.0, 2.0, (3.0,), (4.0,), (5.0,)).message()
    setattr(message, field, list(getattr(message, field))[:0])
    with pytest.raises(MalformedMessage, match="joint_states"):
        JointSample.of(message)


def test_displacements_and_accelerations() -> None:
    whirl = WhirlSample(TIME, (1e-4, -2e-3, 3e-5))
    assert WhirlSample.of(over_the_wire(whirl.message())) == whirl  # type: ignore[arg-type]
    shaken = VibrationSample(TIME, (1.0, -2.0, 0.5), (10.0, -20.0, 30.0))
    assert VibrationSample.of(over_the_wire(shaken.message())) == shaken  # type: ignore[arg-type]
    assert shaken.message().header.frame_id == "drive_housing"


def test_a_reading_names_its_own_axes() -> None:
    sample = VibrationSample(TIME, (1e-4, -2e-3, 9.81), frame="pickup")
    assert sample.message().header.frame_id == "pickup"
    assert VibrationSample.of(sample.message()) == sample


def test_a_pose_is_the_same_as_a_transform() -> None:
    pose = PoseSample(TIME, (1e-4, -2e-3, 3e-5), (0.5, -0.5, 0.1, 0.7), "left/drive_housing")
    message = over_the_wire(pose.message())
    assert PoseSample.of(message) == pose  # type: ignore[arg-type]
    assert message.pose.orientation.w == 0.5  # type: ignore[attr-defined]
    transform = over_the_wire(pose.transform("left/deck"))
    assert PoseSample.of_transform(transform) == pose  # type: ignore[arg-type]
    assert transform.child_frame_id == "left/deck"  # type: ignore[attr-defined]


def test_frames_are_named_by_the_namespace() -> None:
    assert frame_of("/", "deck") == "deck"
    assert frame_of("/left", "deck") == "left/deck"
    assert frame_of("/rack/left", "pickup") == "rack/left/pickup"


@pytest.mark.parametrize("value", [0.0, -3.5, math.inf, 1e308])
def test_commands_are_not_judged_here(value: float) -> None:
    assert command_of(command_message(value)) == value


def test_blocks_are_bit_exact() -> None:
    samples = np.random.default_rng(0).normal(size=(1000, 5))
    samples[:, 0] = np.arange(1000)
    block = Block(("step", "time", "a", "b", "c"), samples)
    got = Block.of(over_the_wire(block.message()))  # type: ignore[arg-type]
    assert got.channels == block.channels
    assert got.samples.tobytes() == samples.tobytes()


@pytest.mark.parametrize(
    "label", ["a", "ab", "abc", "abcd", "abcde", "abcdef", "abcdefg", "abcdefgh"]
)
@pytest.mark.parametrize("rows", [1, 2, 20])
def test_a_block_as_bytes_is_the_same_message(label: str, rows: int) -> None:
    """Whatever there is to pad before its numbers."""
    steps = np.arange(2.0 * rows, dtype=float).reshape(2, rows).T
    block = Block(("step", label), steps)
    assert deserialize_message(block.encoded(), Float64MultiArray) == block.message()


def test_labelled_dimensions() -> None:
    message = Block(("step", "time"), np.arange(6.0).reshape(3, 2)).message()
    assert [(d.label, d.size, d.stride) for d in message.layout.dim] == [
        ("sample", 3, 6),
        ("step,time", 2, 2),
    ]


def broken(change: str) -> Float64MultiArray:
    message = Block(("step", "time"), np.arange(6.0).reshape(3, 2)).message()
    if change == "no layout":
        message.layout.dim = []
    elif change == "label":
        message.layout.dim[1].label = "step"
    elif change == "first channel":
        message.layout.dim[1].label = "a,b"
    elif change == "data":
        message.data = message.data[:-1]
    elif change == "size":
        message.layout.dim[0].size = 4
    return message


@pytest.mark.parametrize(
    "steps", [[0.0, 0.0], [1.0, 0.0], [0.5, 1.0], [math.nan, 1.0], [0.0, math.inf]]
)
def test_steps_that_do_not_count(steps: list[float]) -> None:
    message = Block(("step", "time"), np.column_stack([steps, [0.0, 0.0]])).message()
    with pytest.raises(MalformedMessage, match="whole numbers that grow"):
        Block.of(message)


@pytest.mark.parametrize("change", ["no layout", "label", "first channel", "data", "size"])
def test_malformed_blocks(change: str) -> None:
    with pytest.raises(MalformedMessage, match="vibration/block"):
        Block.of(broken(change))


def test_health() -> None:
    health = Health(
        "/left/drive_sim", Task.DRIVE, Level.WARN, "fell behind", {"steps dropped": "7"}, "drive 3"
    )
    message = health.message_at(TIME)
    assert message.status[0].name == "/left/drive_sim: real time"
    assert message.status[0].hardware_id == "drive 3"
    assert Health.all_of(message) == [health]
    for foreign in ("/left/drive_sim", "/left/arm: motor", "real time", ""):
        message.status[0].name = foreign
        assert Health.all_of(message) == []


def test_description() -> None:
    assert description_of(description_message({"a": [1, None]})) == {"a": [1, None]}
    for text in ("{", "[1]", "[" * 10**5):
        with pytest.raises(MalformedMessage, match="JSON"):
            description_of(String(data=text))


def test_faults() -> None:
    for faults in ([], ["ball_0 sticks", "pickup drifts 0.1"]):
        assert faults_of(over_the_wire(faults_message(faults))) == faults  # type: ignore[arg-type]
    for text in ("{", "{}", "[1]", "none", "[" * 10**5):
        with pytest.raises(MalformedMessage, match="faults must be a JSON list"):
            faults_of(String(data=text))
