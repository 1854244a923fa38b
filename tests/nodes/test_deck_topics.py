"""A deck in space as a process over real DDS: its pose, tf, and vibration along three axes."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ab_msgs_py import Block, JointSample, PoseSample, VibrationSample, WhirlSample, topics
from ab_sim.drive.trajectory import Trajectory
from ab_sim.drive.turn_vector import once_per_turn
from tests.nodes.fleet import Fleet
from tests.recorded import read_recording

pytestmark = pytest.mark.ros

CHANGES = (
    "['balls.race=[0, 1]', 'race.height=[0.004, -0.002]', 'rotor.height=0.003', "
    "'start.deck.tilt=[0.01, -0.02, 0.005]', 'rotor.inertia=[6.75e-6, 6.75e-6, 1.35e-5]'"
)
"""Where disc and races are not level with the mounts, the deck tilts; it starts tilted, too."""
SENSOR = "'sensors.pickup={position: [0.02, -0.05, 0.01], axis_angle: 0.3}'"


def heard_in(blocks: list[Any]) -> Trajectory:
    whole = [Block.of(message) for message in blocks]
    return Trajectory(whole[0].channels, np.concatenate([block.samples for block in whole]))


def by_time(trajectory: Trajectory, values: np.ndarray) -> dict[int, tuple[float, ...]]:
    """Rows of values by the time [ns] of their samples."""
    stamps = np.rint(1e9 * trajectory["time"]).astype(int).tolist()
    return dict(zip(stamps, map(tuple, values.tolist()), strict=True))


def test_pose_whirl_and_vibration_are_the_samples(fleet: Fleet, tmp_path: Path) -> None:
    """What topics show is what blocks hold and what is recorded; frames say on which axes."""
    heard = {
        topic.name: fleet.listen(topic._replace(name=f"left/{topic.name}"))
        for topic in (
            topics.JOINT_STATES,
            topics.VIBRATION,
            topics.WHIRL,
            topics.DECK_POSE,
            topics.ONCE_PER_TURN,
        )
    }
    blocks = fleet.listen(topics.BLOCK._replace(name="left/vibration/block"))
    tf = fleet.listen(topics.TF) if topics.TF.type else []
    fleet.start("left/recorder", path=tmp_path / "left.rrd")
    fleet.start("left/drive_sim", scene="feeding-deck", changes=f"{CHANGES}]", start_paused=True)
    fleet.until(lambda: fleet.value("left/recorder", "file"), "it records")
    # By now this listener is known on each topic.
    assert fleet.call("left/drive_sim/pause", False)[0]
    fleet.until(lambda: len(heard["deck_pose"]) > 300, "300 poses")
    if topics.TF.type:
        fleet.until(lambda: len(tf) > 200, "200 transforms")
    assert fleet.stop("left/drive_sim") == 0
    assert fleet.stop("left/recorder") == 0

    run = heard_in(blocks)
    back = read_recording(tmp_path / "left.rrd")
    assert back.complete and back.missing == 0 and back.channels == run.channels
    _, here, there = np.intersect1d(run["step"], back["step"], return_indices=True)
    assert len(here) > 500, "the recorder heard what this test did, but for the ends"
    assert back.samples[there].tobytes() == run.samples[here].tobytes()
    assert np.ptp(run["z"]) > 1e-7 and np.ptp(run.tilt, axis=0).min() > 1e-5, "it moves"
    place, turn = by_time(run, run.position), by_time(run, run.turn)
    linear, angular = by_time(run, run.acceleration), by_time(run, run.angular_acceleration)
    poses = [PoseSample.of(message) for message in heard["deck_pose"]]
    for pose in poses:
        assert pose.frame == "left/drive_housing"
        assert pose.place == place[pose.time] and pose.turn == turn[pose.time]
        assert math.fsum(q * q for q in pose.turn) == pytest.approx(1.0, abs=1e-14)
    for whirl in map(WhirlSample.of, heard["whirl"]):
        assert (whirl.place, whirl.frame) == (place[whirl.time], "left/drive_housing")
    vectors = once_per_turn(run)
    turning = by_time(run, np.column_stack([vectors.real, vectors.imag, 0.0 * vectors.real]))
    seen = [WhirlSample.of(message) for message in heard["whirl/once_per_turn"]]
    assert {one.frame for one in seen} == {"left/spindle"}
    known = [one for one in seen if not math.isnan(turning[one.time][0])]
    assert len(known) > 200, "but for the first turn after this test listened"
    for one in known:
        assert one.place == pytest.approx(turning[one.time], rel=1e-9, abs=1e-12)
    for shaken in map(VibrationSample.of, heard["vibration"]):
        assert (shaken.linear, shaken.frame) == (linear[shaken.time], "left/drive_housing")
        assert shaken.angular == pytest.approx(angular[shaken.time], rel=1e-12)
    joints = JointSample.of(heard["joint_states"][-1])
    assert joints.spindle_speed == 335.0 and len(joints.ball_angles) == 2

    if topics.TF.type is None:
        assert "tf is not published: tf2_msgs is not installed" in fleet.log("left/drive_sim")
        return
    frames = [frame for message in tf for frame in topics.TF.sample(message)]
    assert {child for child, _ in frames} == {"left/deck"}
    assert {pose for _, pose in frames} <= set(poses)


def test_the_pickups_reading_has_three_axes(fleet: Fleet) -> None:
    vibration, blocks = fleet.listen(topics.VIBRATION), fleet.listen(topics.BLOCK)
    static = fleet.listen(topics.TF_STATIC) if topics.TF.type else []
    fleet.start(
        "drive_sim", scene="feeding-deck", changes=f"{CHANGES}, {SENSOR}]", start_paused=True
    )
    assert fleet.call("drive_sim/pause", False)[0]
    fleet.until(lambda: len(vibration) > 100, "100 readings")
    if topics.TF.type:
        told = fleet.until(lambda: static, "the sensor's frame")[0]
        ((child, sits),) = topics.TF_STATIC.sample(told)
        assert (sits.frame, child) == ("deck", "pickup")
        assert sits.place == (0.02, -0.05, 0.01)
        assert sits.turn == pytest.approx((math.cos(0.15), 0.0, 0.0, math.sin(0.15)))
    assert fleet.stop("drive_sim") == 0
    run = heard_in(blocks)
    names = ("pickup_1", "pickup_2", "pickup_3")
    readings = by_time(run, np.column_stack([run[name] for name in names]))
    assert np.ptp(run["pickup_3"]) > 0.01, "along the shaft, too"
    for read in map(VibrationSample.of, vibration):
        assert (read.linear, read.frame) == (readings[read.time], "pickup")
        assert read.angular == (0.0, 0.0, 0.0), "an accelerometer reads none"
