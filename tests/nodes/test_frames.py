"""What RViz, robot_state_publisher and an IMU's driver need, from one process in a namespace."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ab_msgs_py import Block, ImuSample, JointSample, PoseSample, topics
from ab_msgs_py.samples import text_of
from ab_sim.drive.pickup import noise_variance
from ab_sim.drive.trajectory import Trajectory
from ab_sim.drive.urdf import urdf_of
from ab_sim.scene import Scene, load_scene
from tests.kinematics import Tree, pose
from tests.nodes.fleet import Fleet

pytestmark = pytest.mark.ros

PLANE = [
    "start.ball_angles=[0.5, 2.0]",
    "sensors.pickup={sample_rate: 200, bandwidth: 20, axis_angle: 0.3}",
    "sensors.second={sample_rate: 100, bandwidth: 400}",
]
SPACE = [
    "balls.race=[0, 1]",
    "race.height=[0.004, -0.002]",
    "rotor.height=0.003",
    "start.deck.tilt=[0.01, -0.02, 0.005]",
    "rotor.inertia=[6.75e-6, 6.75e-6, 1.35e-5]",
    "sensors.aside={position: [0.02, -0.05, 0.01], sample_rate: 200}",
]
HEARD = (topics.JOINT_STATES, topics.DECK_POSE, topics.IMU, topics.MODEL, topics.BLOCK)


def since_reset(samples: list[Any]) -> list[Any]:
    """Those of the last run: time went back before it."""
    back = [at for at in range(1, len(samples)) if samples[at].time < samples[at - 1].time]
    return samples[back[-1] :] if back else samples


def run_in(messages: list[Any]) -> Trajectory:
    """All steps since the last reset that blocks have told of."""
    blocks = [Block.of(message) for message in messages]
    first = max(at for at, block in enumerate(blocks) if at == 0 or block.samples[0, 0] < 2)
    samples = np.concatenate([block.samples for block in blocks[first:]])
    return Trajectory(blocks[first].channels, samples)


def row_of(run: Trajectory, times: list[int]) -> np.ndarray:
    """Of stamps that lie within a run, the rows."""
    rows = np.searchsorted(1e9 * run["time"], np.array(times) - 10)
    np.testing.assert_array_equal(np.rint(1e9 * run["time"][rows]), times)
    return rows


def check_balls(scene: Scene, tree: Tree, heard: dict[str, list[Any]], run: Trajectory) -> None:
    """Frames, as robot_state_publisher makes them of joint_states and the drive's tf, are right."""
    joints = {s.time: s for s in since_reset([JointSample.of(m) for m in heard["joint_states"]])}
    poses = since_reset([PoseSample.of(message) for message in heard["deck_pose"]])
    until = round(1e9 * run["time"][-1])
    poses = [sample for sample in poses if 0 < sample.time <= until and sample.time in joints]
    assert len(poses) > 50
    for at, sample in zip(row_of(run, [p.time for p in poses]), poses, strict=True):
        held = joints[sample.time]
        angles = {"spindle": held.spindle_angle}
        angles |= {f"ball_{ball}": angle for ball, angle in enumerate(held.ball_angles)}
        turn = Rotation.from_quat(np.roll(sample.turn, -1))
        deck = {"deck": pose(np.array(sample.place), turn)}
        for ball, race in enumerate(scene.balls.races):
            angle = run["angle"][at] + run.ball_angles[at, ball]
            on_deck = scene.race.radius * np.array([math.cos(angle), math.sin(angle), 0.0])
            on_deck[2] = scene.race.heights[race]
            moved = np.zeros(3)
            moved[: run.position.shape[1]] = run.position[at]
            expected = moved + run.turned[at] @ on_deck
            frame = tree.place(f"ball_{ball}", angles, deck)
            np.testing.assert_allclose(frame[:3, 3], expected, rtol=0, atol=1e-14)


def check_imu(scene: Scene, name: str, messages: list[Any], run: Trajectory) -> np.ndarray:
    """Every sample of a sensor is there once, dated by when it was taken; the forces."""
    sensor = scene.sensors[name]
    samples = since_reset(list(map(ImuSample.of, messages)))
    period = round(1e9 / sensor.sample_rate)
    times = [sample.time for sample in samples]
    assert times[0] % period == 0 and set(np.diff(times)) == {period}
    assert {sample.frame for sample in samples} == {f"left/{name}"}
    (variance,) = {sample.variance for sample in samples}
    assert variance == noise_variance(sensor, scene.solver.step) > 0
    samples = [sample for sample in samples if sample.time <= 1e9 * run["time"][-1]]
    assert len(samples) > 50
    forces = np.array([sample.force for sample in samples])
    rows = row_of(run, [sample.time for sample in samples])
    for axis in range(3):
        channel = f"{name}_{axis + 1}"
        shown = run[channel][rows] if channel in run.channels else np.zeros(len(rows))
        np.testing.assert_array_equal(forces[:, axis], shown)
    return forces


def test_a_drive_in_the_plane_and_then_one_in_space(fleet: Fleet) -> None:
    heard = {t.name: fleet.listen(t._replace(name=f"left/{t.name}")) for t in HEARD}
    second = fleet.listen(topics.IMU._replace(name="left/imu_second/data_raw"))
    models, node = heard["robot_description"], "left/drive_sim"
    plane, space = load_scene("thesis-hold", PLANE), load_scene("feeding-deck", SPACE)

    # Slowly enough for this listener to hear every sample, however busy the machine is.
    fleet.start(node, scene="thesis-hold", changes=str(PLANE), wake_rate=50.0)
    fleet.until(lambda: len(heard["imu/data_raw"]) > 400 and len(second) > 200, "2 s of samples")
    assert fleet.call(f"{node}/pause", True)[0]
    assert [text_of(message) for message in models] == [urdf_of(plane)]
    late = fleet.listen(topics.MODEL._replace(name=f"/left/{topics.MODEL.name}"))
    fleet.until(lambda: late, "who comes late has it, too")
    run = run_in(heard["vibration/block"])
    check_balls(plane, Tree(text_of(models[0])), heard, run)
    assert not np.any(check_imu(plane, "pickup", heard["imu/data_raw"], run)[:, 2])
    check_imu(plane, "second", second, run)
    assert fleet.log(node).count("sensor second aliases: up to 100 %") == 1
    assert "sensor pickup" not in fleet.log(node)

    assert fleet.set(node, scene="feeding-deck", changes=SPACE) == (True, "")
    assert fleet.call(f"{node}/load_scene")[0]
    fleet.until(lambda: len(models) == 2, "the new drive's description")
    assert text_of(models[1]) == urdf_of(space)
    before, told = len(heard["imu/data_raw"]), len(second)
    assert fleet.call(f"{node}/pause", False)[0]
    fleet.until(lambda: len(heard["imu/data_raw"]) > before + 400, "2 s of samples")
    assert fleet.call(f"{node}/pause", True)[0]
    run = run_in(heard["vibration/block"])
    check_balls(space, Tree(text_of(models[1])), heard, run)
    forces = check_imu(space, "aside", heard["imu/data_raw"], run)
    assert np.all(np.ptp(forces, axis=0) > 0.01), "along the shaft, too"
    assert len(second) == told, "a sensor that is no more says nothing"
    assert fleet.stop(node) == 0
