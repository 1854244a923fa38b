"""Bags of others, unfinished ones, and what is none."""

from __future__ import annotations

import shutil
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer

from ab_msgs_py import JointSample, VibrationSample
from ab_msgs_py.topics import BLOCK, COMMAND, DESCRIPTION, JOINT_STATES, PROFILE_STATUS, VIBRATION
from ab_sim.base.errors import AbSimError, InputError, RecordingError
from ab_sim.record.bags.contract import TYPES, encoded, offered_qos
from ab_sim.record.bags.importing import import_bag
from ab_sim.record.bags.reader import Bag
from ab_sim.record.bags.writer import BagWriter
from tests.bags.made import bag_of, block_of, export_of
from tests.recorded import read_recording
from tests.recording.runs import describe, run
from tests.recording.test_errors import files_limited_to

CHANNELS, SAMPLES = run(600)


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("bags") / "bag"
    export_of(path, describe(), CHANNELS, SAMPLES)
    return path


def blocks(*ends: int, times: bool = True) -> list[tuple[str, int, bytes]]:
    """Of the steps up to each end, dated by their ends [ms]."""
    cut = [0, *ends]
    return [
        ("/vibration/block", b * 10**6, block_of(CHANNELS, SAMPLES[a:b]))
        for a, b in zip(cut[:-1], cut[1:], strict=True)
    ]


def described(**changes: Any) -> tuple[str, int, bytes]:
    return "/drive_description", 0, encoded(DESCRIPTION, describe(**changes))


def imported(bag: Path, **options: Any) -> Any:
    out = bag.parent / "out.rrd"
    return import_bag(bag, out, **options), read_recording(out)


# --- unfinished ones -----------------------------------------------------------------------


@pytest.mark.parametrize("cut", [0.3, 0.7, 0.999])
def test_one_that_was_cut_off_is_read_up_to_there(
    finished: Path, tmp_path: Path, cut: float
) -> None:
    """Chunks are 1 MB here, so make them small: written as live, flushed now and then."""
    with Bag(finished) as bag:
        everything = list(bag.messages(bag.topics))
        kinds = dict(bag.topics)
    writer = BagWriter(tmp_path / "bag")
    for name, topic in kinds.items():
        assert topic.qos is not None
        writer.topic(name, topic.type, topic.qos)
    for count, message in enumerate(everything):
        writer.write(*message)
        if count % 50 == 0:
            writer.flush()
    file = tmp_path / "bag" / "bag_0.mcap"
    data = file.read_bytes()  # as a killed writer would leave it, or the machine's end
    file.write_bytes(data[: int(cut * len(data))])
    with Bag(tmp_path / "bag") as bag:
        there = list(bag.messages(bag.topics))
        assert not bag.complete and there == everything[: len(there)]
        assert len(there) > 0.9 * cut * len(everything) - 100
        assert bag.span == (there[0].time, there[-1].time)
    made, back = imported(tmp_path / "bag")
    assert not made.complete and made.missing == 0
    assert back.samples.tobytes() == SAMPLES[: len(back.samples)].tobytes()
    writer.close()
    assert (tmp_path / "bag" / "metadata.yaml").exists()


def test_one_without_metadata_is_read_and_called_unfinished(finished: Path, tmp_path: Path) -> None:
    shutil.copytree(finished, tmp_path / "bag")
    (tmp_path / "bag" / "metadata.yaml").unlink()
    made, back = imported(tmp_path / "bag")
    assert not made.complete and back.samples.tobytes() == SAMPLES.tobytes()


def test_metadata_is_read_within_limits(finished: Path, tmp_path: Path) -> None:
    shutil.copytree(finished, tmp_path / "bag")
    pairs = zip("abcdefghi", "bcdefghij", strict=True)
    nines = [f"&{new} [{', '.join([f'*{old}'] * 9)}]" for old, new in pairs]
    metadata = tmp_path / "bag" / "metadata.yaml"
    said = "storage_identifier: "
    assert said + "mcap" in metadata.read_text()
    bomb = f"{said}[&a [x], {', '.join(nines)}]"
    metadata.write_text(metadata.read_text().replace(said + "mcap", bomb))
    with pytest.raises(RecordingError, match="has more than 50000 values"):
        imported(tmp_path / "bag")


def test_the_file_alone_is_a_bag(finished: Path, tmp_path: Path) -> None:
    file = shutil.copy(finished / "bag_0.mcap", tmp_path / "alone.mcap")
    made, back = imported(Path(file))
    assert made.complete and back.samples.tobytes() == SAMPLES.tobytes()


def test_write_error_is_told_and_what_was_written_is_readable(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag")
    writer.topic("/vibration/block", BLOCK.type_name, offered_qos(BLOCK.qos))
    rng, sent = np.random.default_rng(0), 0
    with (
        files_limited_to(300_000),
        pytest.raises(RecordingError, match=r"bag .* \d+ of \d+ .*File too large"),
    ):
        while True:
            noise = np.column_stack([np.arange(99.0), np.arange(99.0), rng.normal(size=(99, 3))])
            block = block_of(("step", "time", "x", "y", "z"), noise)
            writer.write("/vibration/block", sent, block)
            sent += 1
            writer.flush()
    writer.close()  # was told already
    with pytest.raises(RecordingError, match="written any further"):
        writer.flush()
    with Bag(tmp_path / "bag") as bag:
        there = list(bag.messages({"/vibration/block"}))
    assert len(there) == writer.messages_written == sent - 1 > 10


# --- of other makers -----------------------------------------------------------------------


def test_sqlite_as_older_ros_wrote_it(finished: Path, tmp_path: Path) -> None:
    with (
        Bag(finished) as bag,
        Writer(tmp_path / "old", version=8, storage_plugin=StoragePlugin.SQLITE3) as writer,
    ):
        known = {
            name: writer.add_connection(name, topic.type, typestore=TYPES)
            for name, topic in bag.topics.items()
        }
        for message in bag.messages(bag.topics):
            writer.write(known[message.topic], message.time, message.data)
    _, back = imported(tmp_path / "old")
    assert back.samples.tobytes() == SAMPLES.tobytes()
    assert back.description == describe()


def test_command_and_vibration_alone(tmp_path: Path) -> None:
    """Of a rig whose clock hangs on the wall: there is what it said, and no drawing."""
    start, rng = 1_700_000_000_000_000_000, np.random.default_rng(0)
    felt = rng.normal(size=(50, 3))
    said = [("/rig/spindle/command", start - 5, encoded(COMMAND, 7.0))]
    for row in range(50):
        time = start + row * 1_000_000
        said.append(
            (
                "/rig/vibration",
                time + 300,
                encoded(VIBRATION, VibrationSample(time, felt[row], frame="imu")),
            )
        )
        if row == 20:
            said.append(("/rig/spindle/command", time + 400, encoded(COMMAND, 9.0)))
    made, back = imported(bag_of(tmp_path / "rig", said))
    assert (made.rows, made.missing, made.ignored) == (50, 0, {})
    assert back.channels == ("step", "time", "imu_1", "imu_2", "imu_3", "command")
    np.testing.assert_array_equal(back.samples[:, 2:5], felt)
    np.testing.assert_allclose(back["time"], 1e-3 * np.arange(50), rtol=0, atol=1e-12)
    assert back["command"].tolist() == [7.0] * 21 + [9.0] * 29
    assert back.description["time_zero"] == start and back.description["namespace"] == "/rig"


def test_joints_at_half_the_rate_are_interpolated(finished: Path, tmp_path: Path) -> None:
    """Held ones would be late, and a fit that follows the spindle wrong."""
    with Bag(finished) as bag:
        messages = [tuple(m) for m in bag.messages({"/joint_states", "/vibration"})]
    joints = [each for each in messages if each[0] == "/joint_states"]
    kept = set(joints[::2])
    few = [each for each in messages if each[0] == "/vibration" or each in kept]
    _, back = imported(bag_of(tmp_path / "half", few))
    rows = np.searchsorted(SAMPLES[:, 1], back["time"] - 1e-6)
    assert len(rows) == len(joints)
    for channel in ("angle", "speed", "ball_0_angle"):
        true = SAMPLES[rows, CHANNELS.index(channel)]
        np.testing.assert_array_equal(back[channel][::2], true[::2])
        middle = 0.5 * (true[:-2:2] + true[2::2])
        np.testing.assert_allclose(back[channel][1:-1:2], middle, rtol=1e-12, atol=1e-12)
    end = back["angle"]
    assert end[-1] - end[-2] == pytest.approx(end[-2] - end[-3]), "extrapolated by one interval"


def test_joints_of_a_simulated_clock_and_a_slower_sensor(finished: Path, tmp_path: Path) -> None:
    """The drive's own state topics, without its blocks: values are those of its samples."""
    with Bag(finished) as bag:
        wanted = {"/joint_states", "/whirl", "/vibration", "/drive_description"}
        said = [tuple(m) for m in bag.messages(wanted)]
    slow = [(t, n, d) for t, n, d in said if t != "/vibration" or n // 4_000_000 % 3 == 1]
    _, back = imported(bag_of(tmp_path / "few", slow))
    rows = np.searchsorted(SAMPLES[:, 1], back["time"] - 1e-6)
    assert len(rows) == 150 and back["step"].tolist() == list(range(150))
    for channel in ("angle", "speed", "ball_0_angle", "ball_1_rate", "x", "y"):
        np.testing.assert_array_equal(back[channel], SAMPLES[rows, CHANNELS.index(channel)])
    felt = SAMPLES[rows, CHANNELS.index("ax")]
    heard = back["ax"]
    fresh = heard == felt
    assert 30 < fresh.sum() < 60, "one in three is new"
    first = int(np.argmax(fresh))
    assert np.isnan(heard[:first]).all(), "nothing was said before"
    last = np.maximum.accumulate(np.where(fresh, np.arange(150), -1))[first:]
    np.testing.assert_array_equal(heard[first:], felt[last], "and then what was said last")
    assert back.description["race_radius"] == 0.01


@pytest.mark.parametrize("torque", [0.25, None])
def test_the_motors_torque_is_read_unless_there_is_no_motor(
    torque: float | None, tmp_path: Path
) -> None:
    """Without a motor the spindle's effort is NaN. Stamps of 6 years are a simulated clock."""
    start = 200_000_000_000_000_000
    samples = [
        JointSample(start + row * 1_000_000, 0.1, 2.0, (), (), (), torque) for row in range(5)
    ]
    said = [("/joint_states", each.time, encoded(JOINT_STATES, each)) for each in samples]
    _, back = imported(bag_of(tmp_path / "bag", said))
    expected = ("angle", "speed") if torque is None else ("angle", "speed", "motor_torque")
    assert back.channels == ("step", "time", *expected)
    if torque is not None:
        assert back["motor_torque"].tolist() == [torque] * 5
    assert back["time"][0] == pytest.approx(2e8) and back.description["time_zero"] == 0


def test_topics_match_whatever_quality_of_service_the_metadata_has(
    finished: Path, tmp_path: Path
) -> None:
    """Where a topic had two publishers, or a bag was converted, the two can differ."""
    shutil.copytree(finished, tmp_path / "bag")
    metadata = tmp_path / "bag" / "metadata.yaml"
    text = metadata.read_text()
    other = text.replace("depth: 1000", "depth: 7").replace("RIHS01_", "RIHS01_0")
    assert other != text
    metadata.write_text(other)
    made, back = imported(tmp_path / "bag")
    assert made.complete and back.samples.tobytes() == SAMPLES.tobytes()


def test_a_reset_begins_another_recording(tmp_path: Path) -> None:
    twice = [described(), *blocks(200, 400), *blocks(100, 300)]
    made = import_bag(bag_of(tmp_path / "bag", twice), tmp_path / "r.rrd")
    assert [file.name for file in made.files] == ["r.rrd", "r-2.rrd"]
    for file, rows in zip(made.files, (400, 300), strict=True):
        assert read_recording(file).samples.tobytes() == SAMPLES[:rows].tobytes()
    assert (made.rows, made.missing) == (700, 0)
    (tmp_path / "r-2.rrd").write_text("precious")
    again = import_bag(tmp_path / "bag", tmp_path / "r.rrd")
    assert [file.name for file in again.files] == ["r.rrd", "r-3.rrd"]
    assert (tmp_path / "r-2.rrd").read_text() == "precious"


def test_a_description_that_comes_late_is_that_of_what_was_before(tmp_path: Path) -> None:
    late = [*blocks(100), ("/drive_description", 10**8, described()[2]), *blocks(100, 300)[1:]]
    made, back = imported(bag_of(tmp_path / "bag", late))
    assert len(made.files) == 1 and back.description == describe()
    assert back.samples.tobytes() == SAMPLES[:300].tobytes()


# --- several drives, and what is wrong -----------------------------------------------------


def test_of_several_drives_one_must_be_chosen(tmp_path: Path) -> None:
    both = [
        (side + name, time, data)
        for side in ("/left", "/right")
        for name, time, data in [described(), *blocks(100 if side == "/left" else 200)]
    ]
    bag = bag_of(tmp_path / "bag", both)
    with pytest.raises(InputError, match=r"several drives.*--namespace: /left, /right"):
        import_bag(bag, tmp_path / "r.rrd")
    with pytest.raises(InputError, match="--namespace middle.* /left, /right"):
        import_bag(bag, tmp_path / "r.rrd", "middle")
    assert not (tmp_path / "r.rrd").exists()
    for name, rows in (("left", 100), ("/right/", 200)):
        _, back = imported(bag, namespace=name)
        assert len(back.samples) == rows


def test_messages_that_cannot_be_used_are_counted_and_told(tmp_path: Path) -> None:
    half, timeless, back = SAMPLES[:20].copy(), SAMPLES[20:40].copy(), SAMPLES[40:60].copy()
    half[3, 0], timeless[3, 1], back[3, 1] = 3.5, np.nan, 0.0
    bad = [block_of(CHANNELS, rows) for rows in (half, timeless, back)]
    bad.append(block_of([*CHANNELS[:-1], "else"], SAMPLES[60:80]))
    bad.append(block_of(["step", "step"], SAMPLES[:5, :2]))
    bad += [b"", b"\x00\x01\x00\x00garbage", bad[0][:-9]]
    named = describe(channels=CHANNELS)
    said = [("/drive_description", 0, encoded(DESCRIPTION, named))]
    said += [("/vibration/block", 10**8, data) for data in bad]
    said += [
        ("/drive_description", 10**8, encoded(PROFILE_STATUS, text))
        for text in ("{", "[]", "[" * 10**5)
    ]
    made, run = imported(bag_of(tmp_path / "bag", [*said, *blocks(100, 300)[1:]]))
    assert {topic: count for topic, (count, _) in made.ignored.items()} == {
        "/vibration/block": len(bad),
        "/drive_description": 3,
    }
    assert run.samples.tobytes() == SAMPLES[100:300].tobytes()
    nothing = bag_of(tmp_path / "nothing", said)
    with pytest.raises(RecordingError, match="no samples .*ignored 8"):
        import_bag(nothing, tmp_path / "n.rrd")


def vibrating(*stamps: int) -> list[tuple[str, int, bytes]]:
    here = np.array([np.nan, 0.0, 1.0])
    return [
        ("/vibration", 5, encoded(VIBRATION, VibrationSample(stamp, here, frame="")))
        for stamp in stamps
    ]


def test_stamps_that_go_back_and_values_that_are_no_numbers(tmp_path: Path) -> None:
    made, back = imported(bag_of(tmp_path / "bag", vibrating(10, 20, 20, 5, 30)))
    assert made.ignored["/vibration"][0] == 2 and "not later than" in made.ignored["/vibration"][1]
    assert back["time"].tolist() == [1e-8, 2e-8, 3e-8] and np.isnan(back["ax"]).all()


def _folder_of_text(path: Path) -> None:
    path.mkdir()
    (path / "notes.txt").write_text("no bag")


def _of_text(path: Path) -> None:
    path.mkdir()
    (path / "metadata.yaml").write_text("rosbag2_bagfile_information: 7")


def _file_missing(path: Path) -> None:
    bag_of(path, vibrating(1))
    (path / f"{path.name}_0.mcap").unlink()


def _states_huge_sizes(path: Path) -> None:
    bag_of(path.with_name("whole"), [])
    (whole,) = path.with_name("whole").glob("*.mcap")
    content = bytearray(whole.read_bytes())
    content[9:17] = struct.pack("<Q", 1 << 60)  # length of the first record
    path.write_bytes(content)


def _two_files(path: Path) -> None:
    path.mkdir()
    for name in ("a.mcap", "b.mcap"):
        (path / name).touch()


@pytest.mark.parametrize(
    ("name", "make", "match"),
    [
        ("no", lambda path: None, "no such folder"),
        ("bag", _folder_of_text, "no metadata.yaml, no .mcap"),
        ("bag", _of_text, "not a ROS 2 bag"),
        ("bag", _file_missing, "missing"),
        ("bag", _two_files, "several files; .* a.mcap, b.mcap"),
        (
            "run.rrd",
            lambda path: path.write_text("x"),
            "a folder .* .mcap or .db3",
        ),
        ("run.mcap", lambda path: path.touch(), "not a ROS 2 bag"),
        ("run.mcap", lambda path: path.write_text("text" * 99), "begin like MCAP"),
        ("run.mcap", _states_huge_sizes, "a size that exceeds"),
        ("run.db3", lambda path: path.write_text("text" * 99), "not a ROS 2 bag"),
        ("bag", lambda path: bag_of(path, []), "no topics at all"),
        (
            "bag",
            lambda path: bag_of(path, [("/chat", 1, encoded(PROFILE_STATUS, "hi"))]),
            r"no topics .* drive_description.* /chat \(geometry_msgs",
        ),
        (
            "bag",
            lambda path: bag_of(path, vibrating(1), vibration="sensor_msgs/msg/Imu"),
            r"no topics .* /vibration \(sensor_msgs/msg/Imu\)",
        ),
        (
            "bag",
            lambda path: bag_of(path, [described(), *vibrating(1)], vibration="std_msgs/msg/Bool"),
            r"/vibration .* std_msgs/msg/Bool; expected geometry_msgs/msg/AccelStamped",
        ),
        ("bag", lambda path: bag_of(path, [described()]), "no message that can"),
    ],
)
def test_what_is_no_bag_of_a_drive(
    tmp_path: Path, name: str, make: Callable[[Path], Any], match: str
) -> None:
    make(tmp_path / name)
    with pytest.raises(AbSimError, match=match):
        import_bag(tmp_path / name, tmp_path / "out.rrd")
    assert not (tmp_path / "out.rrd").exists()


def test_a_bag_that_is_there_and_a_folder_that_is_not(finished: Path, tmp_path: Path) -> None:
    before = (finished / "bag_0.mcap").read_bytes()
    with pytest.raises(RecordingError, match="it exists already"):
        BagWriter(finished)
    assert (finished / "bag_0.mcap").read_bytes() == before
    (tmp_path / "file").touch()
    with pytest.raises(RecordingError, match="the bag .*Not a directory"):
        BagWriter(tmp_path / "file" / "bag")


def test_a_finished_bag_whose_data_is_damaged(finished: Path, tmp_path: Path) -> None:
    shutil.copytree(finished, tmp_path / "bag")
    file = tmp_path / "bag" / "bag_0.mcap"
    data = bytearray(file.read_bytes())
    data[5000:6000] = bytes(1000)
    file.write_bytes(data)
    with pytest.raises(RecordingError, match="is damaged"), Bag(tmp_path / "bag") as bag:
        list(bag.messages({"/" + BLOCK.name, "/" + DESCRIPTION.name}))
