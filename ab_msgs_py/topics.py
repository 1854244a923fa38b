"""Topics of the contract, each declared once for pages, bags and nodes."""

from functools import lru_cache

import numpy as np

from ab_msgs_py import samples
from ab_msgs_py.block import Block
from ab_msgs_py.health import Health
from ab_msgs_py.samples import ImuSample, JointSample, PoseSample, VibrationSample, WhirlSample
from ab_msgs_py.set_points import SetPoints
from ab_msgs_py.topic import Conversion, Qos, Topic

# All publishers share a subscription's queue, so that a flood of one evicts messages of others.
# This depth is enough for 50,000 messages/s while the drive waits 0.1 s for a processor. Fast DDS
# does not fill a deeper queue, but refuses new messages instead of dropping old ones.
_BURSTS = Qos(5000)
_TRANSFORMS = Qos(100)  # as in tf2's broadcasters
# Deep enough for the blocks of some seconds in which a recorder does not read, and for a sensor's
# samples of one wake-up.
_DEEP = Qos(1000)
# Facts that change rarely: a late subscriber needs the last message, and only that one.
_LATCHED = Qos(1, latched=True)
_LOG = Qos(1000, latched=True)  # as ROS's own publishers of /rosout

_TEXT = Conversion(samples.text_fields, samples.text_of)
_FRAMES = Conversion(samples.frames_fields, samples.frames_of)
_EACH_SCENE = "once, and after a scene or disc is loaded"

COMMAND = Topic(
    "spindle/command",
    "std_msgs/msg/Float64",
    Conversion(samples.number_fields, samples.number_of),
    "target speed of the spindle",
    "rad/s",
    source="you, or `profile_controller`",
    rate="yours; 200 1/s is enough",
    qos=_BURSTS,
)
TRAJECTORY = Topic(
    "spindle/trajectory",
    "trajectory_msgs/msg/JointTrajectory",
    Conversion(SetPoints.fields, SetPoints.of),
    "speeds of the spindle over simulated time, starting at the header's stamp",
    "rad/s, rad/s²",
    source="you, or `profile_controller`",
    rate="once for each start-up, in advance",
)
JOINT_COMMAND = Topic(
    "spindle/joint_command",
    "sensor_msgs/msg/JointState",
    Conversion(samples.joint_speed_fields, samples.joint_speed_of),
    "target speed of the joint `spindle`, from ros2_control",
    "rad/s",
    source="you, or `controller_manager`",
    rate="yours; need not be repeated",
    qos=_BURSTS,
)
TRAJECTORY_START, TRAJECTORY_ANSWER = "last trajectory [ns]", "last trajectory"
"""Keys in a drive's diagnostics: stamp of the last trajectory, and the answer to it."""
FOLLOWED, PAST = "followed", "begins in the past"
"""Answer to a trajectory that the drive accepts, and beginning of the answer to one that starts in
the past; other answers state why the trajectory is refused."""
JOINT_STATES = Topic(
    "joint_states",
    "sensor_msgs/msg/JointState",
    Conversion(JointSample.fields, JointSample.of),
    "angle, rate and torque of spindle and balls",
    "rad, rad/s, N m",
)
VIBRATION = Topic(
    "vibration",
    "geometry_msgs/msg/AccelStamped",
    Conversion(VibrationSample.fields, VibrationSample.of),
    "readings of the accelerometers; without any, the deck's acceleration",
    "m/s², rad/s²",
    rate="`publish_rate`, for each sensor",
)
WHIRL = Topic(
    "whirl",
    "geometry_msgs/msg/PointStamped",
    Conversion(WhirlSample.fields, WhirlSample.of),
    "displacement of the deck, on inertial axes",
    "m",
)
ONCE_PER_TURN = Topic(
    "whirl/once_per_turn",
    "geometry_msgs/msg/PointStamped",
    Conversion(WhirlSample.fields, WhirlSample.of),
    "once-per-turn part of the displacement, on axes that turn with the spindle, x at the "
    "unbalance",
    "m",
    rate="`wake_rate`, after the first whole turn",
)
DECK_POSE = Topic(
    "deck_pose",
    "geometry_msgs/msg/PoseStamped",
    Conversion(PoseSample.fields, PoseSample.of),
    "position and orientation of the deck, on inertial axes",
    "m",
)
TF = Topic(
    "/tf",
    "tf2_msgs/msg/TFMessage",  # PyPI has no wheel of it; distributions of ROS 2 include it
    _FRAMES,
    "transform of the deck relative to the housing",
    "m",
    qos=_TRANSFORMS,
)
TF_STATIC = TF._replace(
    name="/tf_static",
    meaning="transforms of the accelerometers relative to the deck",
    rate=_EACH_SCENE,
    qos=_LATCHED,
)
BLOCK = Topic(
    "vibration/block",
    "std_msgs/msg/Float64MultiArray",
    Conversion(Block.fields, Block.of),
    "every integration step since the last block",
    "SI",
    rate="`block_rate`",
    qos=_DEEP,
)
IMU = Topic(
    "imu/data_raw",
    "sensor_msgs/msg/Imu",
    Conversion(ImuSample.fields, ImuSample.of),
    "every sample of the scene's first accelerometer (REP-145)",
    "m/s²",
    rate="the sensor's `sample_rate`",
    qos=_DEEP,
)
PROBE = Topic(
    "displacement",
    "geometry_msgs/msg/PointStamped",
    Conversion(WhirlSample.fields, WhirlSample.of),
    "every sample of the scene's first proximity probe, along its axes",
    "m",
    rate="the probe's `sample_rate`",
    qos=_DEEP,
)
MODEL = Topic(
    "robot_description",
    "std_msgs/msg/String",
    _TEXT,
    "URDF of the drive, for robot_state_publisher",
    rate=_EACH_SCENE,
    qos=_LATCHED,
)
DESCRIPTION = Topic(
    "drive_description",
    "std_msgs/msg/String",
    Conversion(samples.json_fields, samples.description_of),
    "scene, step, channels and stepper, as JSON",
    rate="when the drive is ready, and after a scene or disc is loaded",
    qos=_LATCHED,
)
FAULTS = Topic(
    "faults",
    "std_msgs/msg/String",
    Conversion(samples.json_fields, samples.faults_of),
    "faults in force, as a JSON list of texts",
    rate="at each change",
    qos=_LATCHED,
)
PROFILE_STATUS = Topic(
    "profile_controller/status",
    "std_msgs/msg/String",
    _TEXT,
    "state of the profile: a word, with details after a colon",
    source="`profile_controller`",
    rate="at each change",
    qos=_LATCHED,
)
CLOCK = Topic(
    "/clock",
    "rosgraph_msgs/msg/Clock",
    Conversion(samples.clock_fields, samples.clock_of),
    "simulated time",
    "s",
    rate="`wake_rate`",
)
DIAGNOSTICS = Topic(
    "/diagnostics",
    "diagnostic_msgs/msg/DiagnosticArray",
    Conversion(Health.fields, Health.all_of),
    "health of the node",
    source="each node",
    rate="1/s, and when a publisher of commands appears or leaves, or a trajectory arrives",
)
EVENTS = Topic(
    "/rosout",
    "rcl_interfaces/msg/Log",
    Conversion(samples.event_fields, samples.event_of),
    "log of the node",
    source="each node",
    rate="at each log entry",
    qos=_LOG,
)
ALL = [topic for topic in tuple(globals().values()) if isinstance(topic, Topic)]
"""All topics, in the order of their declaration."""


def imu_of(sensor: str, first: bool) -> Topic:
    """Return the topic of a sensor's samples: ``imu_NAME`` after the first sensor (REP-145)."""
    return IMU if first else IMU._replace(name=f"imu_{sensor}/data_raw")


def probe_of(probe: str, first: bool) -> Topic:
    """Return the topic of a probe's samples: ``displacement_NAME`` after the first probe."""
    return PROBE if first else PROBE._replace(name=f"displacement_{probe}")


def block_bytes(block: Block) -> bytes:
    """Serialise a BLOCK message, in a tenth of the time that a message object takes."""
    return _head(block.channels, len(block.samples)) + block.samples.tobytes()


@lru_cache(maxsize=16)
def _head(channels: tuple[str, ...], rows: int) -> bytes:
    """Return the serialised head of a block: all bytes before the samples."""
    from rclpy.serialization import serialize_message

    samples = np.zeros((rows, len(channels)))
    whole: bytes = serialize_message(BLOCK.message(Block(channels, samples)))
    return whole[: len(whole) - samples.nbytes]


def table() -> list[str]:
    """Return a Markdown row for each topic, for the contract's page."""
    head = "topic", "type", "from", "meaning", "unit", "reliability", "durability", "depth", "rate"
    rows = [
        (f"`{topic.name}`", topic.type_name, topic.source, topic.meaning, topic.unit,
         topic.qos.reliability, topic.qos.durability, str(topic.qos.depth), topic.rate)
        for topic in ALL
    ]  # fmt: skip
    return [f"| {' | '.join(row)} |" for row in (head, ("---",) * len(head), *rows)]
