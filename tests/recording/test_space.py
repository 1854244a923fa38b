"""A deck in space in a recording: every channel bit for bit, and a drawing of it that is true."""

import re
from pathlib import Path

import numpy as np
import pytest
import rerun as rr
from scipy.spatial.transform import Rotation

from ab_sim.base.errors import RecordingError
from ab_sim.drive import Drive
from ab_sim.drive.description import describe
from ab_sim.drive.trajectory import Trajectory
from ab_sim.record.recording import Recording
from ab_sim.record.recording.curves import FRAMES
from ab_sim.record.recording.layout import DERIVED, SAMPLES
from ab_sim.record.recording.views import PERIOD
from ab_sim.scene import Scene, load_scene
from tests.recorded import read_recording
from tests.recording.runs import cells, channel, curves, plotted, still, views

CHANGES = (
    "rotor.height=0.004",
    "race.height=[0.006, -0.003]",
    "balls.race=[0, 1]",
    "start.deck.tilt=[0.002, -0.001, 0.003]",
    "sensors.pickup={position: [0.02, -0.05, 0.01]}",
)
MM = 1e3


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene("feeding-deck", CHANGES)


@pytest.fixture(scope="module")
def run(scene: Scene) -> Trajectory:
    return Drive(scene).advance(200)


@pytest.fixture(scope="module")
def file(scene: Scene, run: Trajectory, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("space") / "run.rrd"
    with Recording(path, description=describe(scene)) as recording:
        recording.block(run.channels, run.samples)
    return path


@pytest.fixture(scope="module")
def seen(scene: Scene, run: Trajectory) -> Trajectory:
    """The rows that are drawn."""
    drawn = run["step"] % round(PERIOD / scene.solver.step) == 0
    drawn[0] = True
    return Trajectory(run.channels, run.samples[drawn])


def factor(file: Path) -> float:
    """By which the text says that motion is exaggerated."""
    (text,) = still(file, "/about", "TextDocument:text")
    (times,) = re.findall(r"displacement and tilt ([0-9.e+]+) times as large", text)
    return float(times)


def test_every_channel_comes_back_bit_for_bit(file: Path, run: Trajectory) -> None:
    back = read_recording(file)
    assert back.channels == run.channels and back.complete
    assert back.samples.tobytes() == run.samples.tobytes()


@pytest.mark.parametrize(
    ("group", "names"),
    [
        ("deck_displacement", "x y z"),
        ("deck_velocity", "vx vy vz"),
        ("deck_acceleration", "ax ay az"),
        ("deck_turn", "qw qx qy qz"),
        ("deck_angular_velocity", "wx wy wz"),
        ("deck_angular_acceleration", "wx_rate wy_rate wz_rate"),
        ("sensor_pickup", "pickup_1 pickup_2 pickup_3"),
    ],
)
def test_channels_that_belong_together_are_in_one_component(
    file: Path, run: Trajectory, group: str, names: str
) -> None:
    expected = np.column_stack([run[name] for name in names.split()])
    np.testing.assert_array_equal(channel(file, group), expected)


def test_the_views_are_named_and_say_the_exaggeration(file: Path) -> None:
    assert {"In space", "Top view", "Tilt about x, y, shaft [mrad]"} <= set(views(file))
    assert factor(file) > 1


def test_points_of_the_deck_move_by_so_many_times_what_they_moved(
    file: Path, seen: Trajectory, scene: Scene
) -> None:
    """To first order: the rest is the second order of the exaggerated angles."""
    times = factor(file)
    moved = np.array(cells(file, "/space/deck", "Transform3D:translation"))[:, 0]
    turns = np.array(cells(file, "/space/deck", "Transform3D:quaternion"))[:, 0]
    np.testing.assert_allclose(moved, times * MM * seen.position, atol=1e-5)
    true = Rotation.from_quat(np.roll(seen.turn, -1, axis=1)).as_rotvec()
    np.testing.assert_allclose(Rotation.from_quat(turns).as_rotvec(), times * true, atol=1e-6)
    mounts = np.array([mount.position for mount in scene.mounts])
    springs = np.array(cells(file, "/space/deck", "LineStrips3D:strips"))  # on deck axes
    for k, place in enumerate(mounts):
        end, anchor = (moved + Rotation.from_quat(turns).apply(springs[:, k, i]) for i in (0, 1))
        np.testing.assert_allclose(anchor, np.tile(anchor[0], (len(anchor), 1)), atol=1e-4)
        np.testing.assert_allclose(anchor[0, :2], MM * place[:2], atol=1e-4)
        np.testing.assert_allclose(springs[:, k, 0], np.tile(MM * place, (len(end), 1)), rtol=1e-6)
        drawn, angle = end - MM * place, times * np.abs(true).max()
        actual = seen.position + Rotation.from_rotvec(true).apply(place) - place
        second = angle**2 * MM * np.linalg.norm(place)
        np.testing.assert_allclose(drawn, times * MM * actual, atol=second)
        assert np.abs(drawn).max() > 2 * second, "and it moves"


def test_spindle_balls_and_races_are_where_they_are(
    file: Path, seen: Trajectory, scene: Scene
) -> None:
    """On deck axes, z upwards, not exaggerated."""
    turns = np.array(cells(file, "/space/deck/rotor", "Transform3D:quaternion"))[:, 0]
    direction = Rotation.from_quat(turns).apply([1.0, 0.0, 0.0])
    expected = np.column_stack([np.cos(seen["angle"]), np.sin(seen["angle"]), np.zeros(len(seen))])
    np.testing.assert_allclose(direction, expected, atol=1e-6)
    balls = np.array(cells(file, "/space/deck/rotor", "Points3D:positions"))
    for ball, height in enumerate((6.0, -3.0)):
        theta = seen.ball_angles[:, ball]
        place = np.column_stack(
            [30 * np.cos(theta), 30 * np.sin(theta), np.full_like(theta, height)]
        )
        np.testing.assert_allclose(balls[:, ball], place, atol=1e-4)
        (ring,) = still(file, f"/space/deck/races/{ball}", "LineStrips3D:strips")
        assert {point[2] for point in ring} == {height}
    (heavy,) = still(file, "/space/deck/rotor/unbalance", "Points3D:positions")
    assert heavy[1] == 0.0 and heavy[2] == pytest.approx(4.0)


def test_tilt_and_height_are_plotted(
    file: Path, run: Trajectory, seen: Trajectory, scene: Scene
) -> None:
    np.testing.assert_allclose(plotted(file, FRAMES, "tilt"), MM * seen.tilt, rtol=1e-6)
    policy = curves(file)[f"{DERIVED}:tilt"]
    assert policy == rr.components.AggregationPolicy.MinMax.value, "a mean of swings is nothing"
    whirl = np.log10(run.whirl / scene.rotor.eccentricity)
    np.testing.assert_allclose(plotted(file, SAMPLES, "whirl")[:, 0], whirl, rtol=1e-5)
    np.testing.assert_allclose(plotted(file, SAMPLES, "height")[:, 0], 1e6 * run["z"], rtol=1e-6)
    sizes = np.linalg.norm(run.acceleration, axis=1)
    np.testing.assert_allclose(plotted(file, SAMPLES, "vector_lengths")[:, 0], sizes, rtol=1e-6)


def test_what_the_drawing_needs_is_asked_for(scene: Scene, run: Trajectory, tmp_path: Path) -> None:
    path, told = tmp_path / "run.rrd", describe(scene)
    with Recording(path, description=told) as recording:
        flat = [name for name in run.channels if name not in ("z", "qw")]
        with pytest.raises(RecordingError, match="angle, x, y, z, qw"):
            recording.block(flat, np.zeros((1, len(flat))))
    without = {key: value for key, value in told["deck"].items() if key != "rotor_height"}
    with pytest.raises(RecordingError, match="rotor_height"):
        Recording(path, description=told | {"deck": without})
    with pytest.raises(RecordingError, match="1 ball_heights for 2 balls"):
        Recording(path, description=told | {"deck": told["deck"] | {"ball_heights": [0.0]}})


@pytest.mark.parametrize(
    "changes",
    [
        ["mounts=[]"],
        ["rotor.eccentricity=0"],
        ["balls.count=0", "start.ball_angles=[]", "balls.mass="],
    ],
)
def test_decks_without_mounts_unbalance_or_balls(changes: list[str], tmp_path: Path) -> None:
    scene = load_scene("feeding-deck", changes)
    run = Drive(scene).advance(20)
    with Recording(tmp_path / "run.rrd", description=describe(scene)) as recording:
        recording.block(run.channels, run.samples)
    assert read_recording(tmp_path / "run.rrd").samples.tobytes() == run.samples.tobytes()
