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
from ab_msgs_py.samples import frame_of  # noqa: E402
from ab_msgs_py.topics import (  # noqa: E402
    BLOCK,
    CLOCK,
    COMMAND,
    DECK_POSE,
    DESCRIPTION,
    DIAGNOSTICS,
    FAULTS,
    JOINT_STATES,
    TF,
    VIBRATION,
    WHIRL,
    block_bytes,
)

TIME = 12_345_678_901


def over_the_wire(message: object) -> object:
    return deserialize_message(serialize_message(message), type(message))


def test_the_table_of_topics() -> None:
    relative = (COMMAND, JOINT_STATES, VIBRATION, WHIRL, DECK_POSE, BLOCK)
    table = {topic.name: topic.type.__name__ for topic in relative}
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
    message = over_the_wire(CLOCK.message(TIME))
    assert (message.clock.sec, message.clock.nanosec) == (12, 345_678_901)  # type: ignore[attr-defined]
    assert CLOCK.sample(message) == TIME


def test_joints() -> None:
    sample = JointSample(TIME, 1e9 + 0.125, 100.0, (0.1, -2.0), (0.5, -0.5), (1e-4, 2e-4))
    message = JOINT_STATES.message(sample)
    assert list(message.name) == ["spindle", "ball_0", "ball_1"]
    assert math.isnan(message.effort[0]), "the motor's torque is not modelled"
    assert JOINT_STATES.sample(over_the_wire(message)) == sample


def test_the_motors_torque_is_the_spindles_effort() -> None:
    sample = JointSample(TIME, 1.0, 2.0, (), (), (), -1.5e-3)
    assert JOINT_STATES.message(sample).effort[0] == -1.5e-3
    assert JOINT_STATES.sample(over_the_wire(JOINT_STATES.message(sample))) == sample


def test_joints_without_balls() -> None:
    sample = JointSample(0, 0.0, 0.0, (), (), ())
    assert JOINT_STATES.sample(JOINT_STATES.message(sample)) == sample


@pytest.mark.parametrize("field", ["name", "position", "velocity", "effort"])
def test_malformed_joints(field: str) -> None:
    message = JOINT_STATES.message(JointSample(TIME, 1.0, 2.0, (3.0,), (4.0,), (5.0,)))
    setattr(message, field, list(getattr(message, field))[:0])
    with pytest.raises(MalformedMessage, match="joint_states"):
        JointSample.of(message)


def test_displacements_and_accelerations() -> None:
    whirl = WhirlSample(TIME, (1e-4, -2e-3, 3e-5))
    assert WhirlSample.of(over_the_wire(WHIRL.message(whirl))) == whirl  # type: ignore[arg-type]
    shaken = VibrationSample(TIME, (1.0, -2.0, 0.5), (10.0, -20.0, 30.0))
    assert VibrationSample.of(over_the_wire(VIBRATION.message(shaken))) == shaken  # type: ignore[arg-type]
    assert VIBRATION.message(shaken).header.frame_id == "drive_housing"


def test_a_reading_names_its_own_axes() -> None:
    sample = VibrationSample(TIME, (1e-4, -2e-3, 9.81), frame="pickup")
    assert VIBRATION.message(sample).header.frame_id == "pickup"
    assert VibrationSample.of(VIBRATION.message(sample)) == sample


def test_a_pose_is_the_same_as_a_transform() -> None:
    pose = PoseSample(TIME, (1e-4, -2e-3, 3e-5), (0.5, -0.5, 0.1, 0.7), "left/drive_housing")
    message = over_the_wire(DECK_POSE.message(pose))
    assert PoseSample.of(message) == pose  # type: ignore[arg-type]
    assert message.pose.orientation.w == 0.5  # type: ignore[attr-defined]
    if TF.type is not None:
        assert TF.sample(over_the_wire(TF.message([("left/deck", pose)]))) == [("left/deck", pose)]


def test_frames_are_named_by_the_namespace() -> None:
    assert frame_of("/", "deck") == "deck"
    assert frame_of("/left", "deck") == "left/deck"
    assert frame_of("/rack/left", "pickup") == "rack/left/pickup"


@pytest.mark.parametrize("value", [0.0, -3.5, math.inf, 1e308])
def test_commands_are_not_judged_here(value: float) -> None:
    assert COMMAND.sample(COMMAND.message(value)) == value


def test_blocks_are_bit_exact() -> None:
    samples = np.random.default_rng(0).normal(size=(1000, 5))
    samples[:, 0] = np.arange(1000)
    block = Block(("step", "time", "a", "b", "c"), samples)
    got = Block.of(over_the_wire(BLOCK.message(block)))  # type: ignore[arg-type]
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
    assert deserialize_message(block_bytes(block), Float64MultiArray) == BLOCK.message(block)


def test_labelled_dimensions() -> None:
    message = BLOCK.message(Block(("step", "time"), np.arange(6.0).reshape(3, 2)))
    assert [(d.label, d.size, d.stride) for d in message.layout.dim] == [
        ("sample", 3, 6),
        ("step,time", 2, 2),
    ]


def broken(change: str) -> Float64MultiArray:
    message = BLOCK.message(Block(("step", "time"), np.arange(6.0).reshape(3, 2)))
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
    message = BLOCK.message(Block(("step", "time"), np.column_stack([steps, [0.0, 0.0]])))
    with pytest.raises(MalformedMessage, match="^vibration/block: step must"):
        Block.of(message)


@pytest.mark.parametrize("change", ["no layout", "label", "first channel", "data", "size"])
def test_malformed_blocks(change: str) -> None:
    with pytest.raises(MalformedMessage, match="vibration/block"):
        Block.of(broken(change))


def test_health() -> None:
    health = Health(
        "/left/drive_sim",
        Task.DRIVE,
        Level.WARN,
        "fell behind",
        {"steps dropped": "7"},
        "drive 3",
        TIME,
    )
    message = DIAGNOSTICS.message(health)
    assert message.status[0].name == "/left/drive_sim: real time"
    assert message.status[0].hardware_id == "drive 3"
    assert Health.all_of(message) == [health]
    for foreign in ("/left/drive_sim", "/left/arm: motor", "real time", ""):
        message.status[0].name = foreign
        assert Health.all_of(message) == []


def test_description() -> None:
    assert DESCRIPTION.sample(DESCRIPTION.message({"a": [1, None]})) == {"a": [1, None]}
    for text in ("{", "[1]", "[" * 10**5):
        with pytest.raises(MalformedMessage, match="JSON"):
            DESCRIPTION.sample(String(data=text))


def test_faults() -> None:
    for faults in ([], ["ball_0 sticks", "pickup drifts 0.1"]):
        assert FAULTS.sample(over_the_wire(FAULTS.message(faults))) == faults
    for text in ("{", "{}", "[1]", "none", "[" * 10**5):
        with pytest.raises(MalformedMessage, match="faults .* JSON list"):
            FAULTS.sample(String(data=text))
