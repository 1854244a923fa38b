"""A recording goes into a bag and comes back to the bit; another library reads the bag."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from ab_sim.drive import Drive
from ab_sim.drive.description import describe
from ab_sim.record.bags.exporting import export_bag
from ab_sim.record.bags.importing import import_bag
from ab_sim.record.bags.reader import Bag
from ab_sim.record.recording import LEFT_OUT, Recording, open_recording
from ab_sim.scene import load_scene
from tests.bags.made import export_of
from tests.recorded import read_recording
from tests.recording import runs


@pytest.fixture(scope="module")
def live(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What a recorder might have written of 0.7 s, of a drive with a sensor, less three steps."""
    path = tmp_path_factory.mktemp("live") / "live.rrd"
    scene = load_scene("thesis-hold", ["sensors.pickup.bandwidth=200.0", "start.speed=90.0"])
    run = Drive(scene).advance(700)
    kept = np.delete(run.samples, [100, 101, 350], axis=0)
    with Recording(path, description=describe(scene)) as recording:
        recording.event(0.0, "profile: running", "INFO", "profile")
        for part in np.array_split(kept, 30):
            recording.block(run.channels, part)
        recording.scalar("commands_received", 0.123456789, 0.1 + 0.2)
        recording.scalar("commands_received", 0.4, -0.0)
        recording.scalar("real_time_factor", 0.5, 0.99)
        recording.event(0.2, 'three "ticks": ```\nand a line', "ERROR", "/ab/drive_sim")
        recording.event(0.2000001, "drive_sim: said", "DEBUG", "log")
        recording.event(0.3, "profile: done", "INFO", "profile")
        recording.event(0.3, "profile: odd", "WARN", "profile")
    return path


@pytest.mark.parametrize("namespace", ["/", "/left", "/a/b"])
def test_to_a_bag_and_back_to_the_bit(live: Path, tmp_path: Path, namespace: str) -> None:
    run = read_recording(live)
    messages = export_bag(open_recording(live), tmp_path / "bag", namespace)
    made = import_bag(tmp_path / "bag", tmp_path / "back.rrd", namespace.strip("/"))
    back = read_recording(tmp_path / "back.rrd")
    assert (made.rows, made.missing, made.ignored, made.complete) == (697, 3, {}, True)
    assert back.channels == run.channels and back.description == run.description
    assert back.samples.tobytes() == run.samples.tobytes()
    assert (back.gaps, back.missing, back.complete) == (run.gaps, run.missing, True)
    order = [tuple(vars(event).values()) for event in run.events]
    assert sorted(tuple(vars(event).values()) for event in back.events) == sorted(order)
    assert set(back.scalars) == set(run.scalars)
    for name, scalar in run.scalars.items():
        assert back.scalars[name].tobytes() == scalar.tobytes(), name
    with Bag(tmp_path / "bag") as bag:
        assert sum(topic.messages for topic in bag.topics.values()) == messages


def test_what_a_decimated_one_left_out_is_known_afterwards(tmp_path: Path) -> None:
    """Row by row, and apart from what is missing; by which rule, too."""
    names, samples = runs.run(3000)
    kept = np.delete(samples, [*range(120, 150), 2005], axis=0)
    with Recording(tmp_path / "a.rrd", description=runs.describe(), every=20, around=0.1) as made:
        for part in np.array_split(kept, 60):
            if part[0, 0] <= 1500 <= part[-1, 0]:
                made.event(1.5, "something happened")
            made.block(names, part)
    there = open_recording(tmp_path / "a.rrd")
    export_bag(there, tmp_path / "bag")
    imported = import_bag(tmp_path / "bag", tmp_path / "b.rrd")
    back = open_recording(tmp_path / "b.rrd")
    assert there.extent.left_out > 2000 and there.extent.missing > 1
    assert back.extent == there.extent and imported.missing == there.extent.missing
    assert (back.every, back.around) == (there.every, there.around) == (20, 0.1)
    assert imported.rows == there.extent.rows and back.complete and not imported.ignored
    for channels in (None, ("step", LEFT_OUT)):
        one, other = (np.concatenate(list(run.blocks(channels))) for run in (there, back))
        assert one.tobytes() == other.tobytes()


def test_special_values_and_odd_channels_survive(tmp_path: Path) -> None:
    """The drive's positions are unknown, and one channel is of nobody's."""
    channels = ["step", "time", "ax", "coil [A]/2"]
    payload = np.array([0x7FF8_0000_0000_1234], dtype=np.uint64).view(np.float64)[0]
    values = [-0.0, 5e-324, np.inf, -np.inf, payload, 0.1]
    steps = np.arange(6.0)
    samples = np.column_stack([steps, 1e-3 * steps, values, values[::-1]])
    with Recording(tmp_path / "a.rrd", description={"note": 1}, drawn=False) as recording:
        recording.block(channels, samples)
    export_bag(open_recording(tmp_path / "a.rrd"), tmp_path / "bag")
    import_bag(tmp_path / "bag", tmp_path / "b.rrd")
    back = read_recording(tmp_path / "b.rrd")
    assert back.channels == tuple(channels) and back.samples.tobytes() == samples.tobytes()


def test_a_long_one_with_many_balls(tmp_path: Path) -> None:
    names, samples = runs.run(2500, 64)
    run = export_of(tmp_path / "bag", runs.describe(64), names, samples)
    import_bag(tmp_path / "bag", tmp_path / "b.rrd")
    back = read_recording(tmp_path / "b.rrd")
    assert back.samples.tobytes() == run.samples.tobytes() == samples.tobytes()


def test_files_need_no_ros() -> None:
    ros = "[m for m in ('rclpy', 'std_msgs') if m in sys.modules]"
    modules = ", ".join(f"ab_sim.record.bags.{name}" for name in ("exporting", "importing"))
    code = f"import sys, {modules}; print({ros})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def decoded_by_mcap(bag: Path) -> dict[str, list[tuple[int, str, Any]]]:
    """Time, type and message of all, by topic, as the MCAP project's own library reads them."""
    said: dict[str, list[tuple[int, str, Any]]] = {}
    with (bag / f"{bag.name}_0.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for schema, channel, message, decoded in reader.iter_decoded_messages():
            assert schema is not None
            entry = message.log_time, schema.name, decoded
            said.setdefault(channel.topic, []).append(entry)
    return said


def test_another_library_reads_every_sample(live: Path, tmp_path: Path) -> None:
    run = read_recording(live)
    export_bag(open_recording(live), tmp_path / "bag", rate=100.0)
    said = decoded_by_mcap(tmp_path / "bag")
    blocks = [message for _, _, message in said["/vibration/block"]]
    rows = [np.array(b.data).reshape(b.layout.dim[0].size, -1) for b in blocks]
    assert np.concatenate(rows).tobytes() == run.samples.tobytes()
    assert blocks[0].layout.dim[1].label.split(",") == list(run.channels)
    assert json.loads(said["/drive_description"][0][2].data) == run.description
    assert {m[1] for m in said["/joint_states"]} == {"sensor_msgs/msg/JointState"}

    joints, vibration = said["/joint_states"], said["/vibration"]
    assert 69 <= len(joints) <= 71, "100 a second for 0.7 s"
    for (time, _, joint), (_, _, felt), (_, _, whirl) in zip(
        joints, vibration, said["/whirl"], strict=True
    ):
        (row,) = np.flatnonzero(np.rint(1e9 * run["time"]) == time)
        assert joint.header.stamp.sec * 10**9 + joint.header.stamp.nanosec == time
        assert joint.name == ["spindle", "ball_0", "ball_1"]
        assert joint.position == [run[n][row] for n in ("angle", "ball_0_angle", "ball_1_angle")]
        assert joint.velocity == [run[n][row] for n in ("speed", "ball_0_rate", "ball_1_rate")]
        assert math.isnan(joint.effort[0]), "no motor is modelled"
        assert felt.header.frame_id == "pickup"
        assert (felt.accel.linear.x, felt.accel.linear.y) == (
            run["pickup_1"][row],
            run["pickup_2"][row],
        )
        assert (whirl.point.x, whirl.point.y, whirl.point.z) == (run["x"][row], run["y"][row], 0.0)
    times = [entry[0] for entries in said.values() for entry in entries]
    clocks = {entry[0] for entry in said["/clock"]}
    assert all(c.clock.sec * 10**9 + c.clock.nanosec == time for time, _, c in said["/clock"])
    assert {t for entries in (joints, said["/spindle/command"]) for t, _, _ in entries} <= clocks
    assert min(times) >= 0 and max(times) == 700_000_000


def test_metadata_is_such_as_rosbag2_writes(live: Path, tmp_path: Path) -> None:
    messages = export_bag(open_recording(live), tmp_path / "bag")
    said = yaml.safe_load((tmp_path / "bag" / "metadata.yaml").read_text())
    about = said["rosbag2_bagfile_information"]
    assert (about["version"], about["storage_identifier"]) == (9, "mcap")
    assert (
        about["relative_file_paths"] == ["bag_0.mcap"] and (tmp_path / "bag/bag_0.mcap").is_file()
    )
    assert about["message_count"] == messages == about["files"][0]["message_count"]
    assert about["starting_time"]["nanoseconds_since_epoch"] == 0
    assert about["duration"]["nanoseconds"] == 700_000_000
    topics = {t["topic_metadata"]["name"]: t for t in about["topics_with_message_count"]}
    assert sum(topic["message_count"] for topic in topics.values()) == messages
    for name, durability in (("/drive_description", "transient_local"), ("/vibration", "volatile")):
        (qos,) = topics[name]["topic_metadata"]["offered_qos_profiles"]
        assert (qos["durability"], qos["reliability"]) == (durability, "reliable")
        assert set(qos) == {
            "history", "depth", "reliability", "durability", "deadline", "lifespan", "liveliness",
            "liveliness_lease_duration", "avoid_ros_namespace_conventions",
        }  # fmt: skip
    hashes = {t["topic_metadata"]["type_description_hash"] for t in topics.values()}
    assert all(each.startswith("RIHS01_") and len(each) == 71 for each in hashes)
