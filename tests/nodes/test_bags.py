"""A drive's messages in a bag, as they came; and the bag published again."""

import resource
import signal
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import Reader

from ab_msgs_py import Block, topics
from ab_sim.base.errors import RecordingError
from ab_sim.record.bags.contract import decoded
from ab_sim.record.bags.importing import import_bag
from ab_sim.record.bags.reader import Bag
from tests.nodes.fleet import Fleet, Process
from tests.recorded import read_recording

pytestmark = pytest.mark.ros


def samples_in(path: Path, topic: str = "/vibration/block") -> np.ndarray:
    with Bag(path) as bag:
        blocks = [decoded(m.data, "std_msgs/msg/Float64MultiArray") for m in bag.messages({topic})]
    return np.concatenate([b.data.reshape(b.layout.dim[0].size, -1) for b in blocks])


def replaying(fleet: Fleet, *arguments: object) -> Process:
    """`ab-sim replay` as one of the fleet."""
    return fleet.start_process(
        "replay", sys.executable, "-m", "ab_sim", "replay", *map(str, arguments)
    )


def test_a_bag_has_what_the_recording_has_and_replays_it(fleet: Fleet, tmp_path: Path) -> None:
    began = time.time_ns()
    fleet.start("recorder", path=tmp_path / "run.rrd", bag=tmp_path / "bags" / "run")
    fleet.start("drive_sim", scene="thesis-hold", start_paused=True)
    fleet.until(lambda: fleet.value("recorder", "file"), "the recorder has a drive")
    assert fleet.call("drive_sim/pause", False)[0]
    fleet.command(10.0, 20.0)
    fleet.until(lambda: int(fleet.value("recorder", "samples written") or 0) > 1500, "samples")
    for node in ("drive_sim", "recorder"):
        assert fleet.stop(node) == 0, fleet.log(node)
    recorded = read_recording(tmp_path / "run.rrd")
    last = fleet.health("recorder")
    assert last is not None and last.values["bag messages dropped"] == "0"
    assert recorded.complete and recorded.missing == 0

    bag_path = tmp_path / "bags" / "run"
    assert samples_in(bag_path).tobytes() == recorded.samples.tobytes()
    with Bag(bag_path) as bag:
        assert bag.complete
        assert int(last.values["bag messages written"]) <= sum(
            t.messages for t in bag.topics.values()
        )
        received = [message.time for message in bag.messages(bag.topics)]
        joints = [
            decoded(m.data, bag.topics[m.topic].type) for m in bag.messages({"/joint_states"})
        ]
        assert bag.topics["/drive_description"].qos.durability.name == "TRANSIENT_LOCAL"
        assert bag.topics["/vibration"].qos.durability.name == "VOLATILE"
    assert began < received[0] <= received[-1] < time.time_ns(), "dated by the clock on the wall"
    assert received == sorted(received)
    stamps = [j.header.stamp.sec * 10**9 + j.header.stamp.nanosec for j in joints]
    assert stamps[-1] == pytest.approx(1e9 * recorded["time"][-1], abs=25e6)

    made = import_bag(bag_path, tmp_path / "imported.rrd")
    imported = read_recording(tmp_path / "imported.rrd")
    assert not made.ignored and imported.samples.tobytes() == recorded.samples.tobytes()
    assert imported.description == recorded.description
    commands = imported.scalars["commands_received"][:, 1]
    assert commands.tolist() == recorded.scalars["commands_received"][:, 1].tolist() == [10.0, 20.0]

    blocks = fleet.listen(topics.BLOCK)
    descriptions: list[object] = []
    fleet.start("recorder", path=tmp_path / "again.rrd")
    replaying(fleet, bag_path, "--rate", 4, "--start-paused")
    fleet.until(lambda: "recording to" in fleet.log("recorder"), "a recorder listens")
    fleet.until(lambda: list(tmp_path.glob("again.rrd")), "it was told what is simulated")
    late = topics.DESCRIPTION
    assert late.qos.latched
    late.subscription(fleet.node, descriptions.append)
    fleet.until(lambda: descriptions, "who comes late is told, too")
    assert fleet.call("replay/pause", False)[0]
    assert fleet.ended("replay") == 0, fleet.log("replay")
    fleet.until(
        lambda: blocks and Block.of(blocks[-1]).samples[-1, 0] == recorded["step"][-1], "all of it"
    )
    assert fleet.stop("recorder") == 0
    again = read_recording(tmp_path / "again.rrd")
    assert again.complete and again.samples.tobytes() == recorded.samples.tobytes()


def test_a_killed_recorder_leaves_a_bag_that_can_be_read(fleet: Fleet, tmp_path: Path) -> None:
    fleet.start("recorder", keep=False, bag=tmp_path / "run")
    fleet.start("drive_sim", scene="thesis-hold")
    fleet.until(
        lambda: int(fleet.value("recorder", "bag messages written") or 0) > 1000, "messages"
    )
    written = int(fleet.value("recorder", "bag messages written"))
    process = fleet.processes.pop("recorder")
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert fleet.stop("drive_sim") == 0
    with Reader(tmp_path / "run") as others:
        assert sum(1 for _ in others.messages(others.connections)) >= written
    assert not list(tmp_path.glob("*.rrd"))
    with Bag(tmp_path / "run") as bag:
        assert not bag.complete
        assert sum(topic.messages for topic in bag.topics.values()) >= written
    made = import_bag(tmp_path / "run", tmp_path / "run.rrd")
    back = read_recording(tmp_path / "run.rrd")
    assert not made.complete and made.missing == back.missing == 0
    assert (
        back.samples.tobytes() == samples_in(tmp_path / "run").tobytes() and len(back.samples) > 500
    )


def test_a_full_disk_is_told_and_what_was_written_is_readable(fleet: Fleet, tmp_path: Path) -> None:
    """A real write error: the kernel lets its files grow no further."""
    process = fleet.start("recorder", keep=False, bag=tmp_path / "run")
    fleet.start("drive_sim", scene="thesis-hold")
    fleet.until(lambda: int(fleet.value("recorder", "bag messages written") or 0) > 500, "messages")
    size = (tmp_path / "run" / "run_0.mcap").stat().st_size + 100_000
    resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (size, size))
    assert fleet.ended("recorder") == RecordingError.exit_code
    fleet.until(lambda: "contains" in fleet.health("recorder").message, "its last diagnostics")
    with Bag(tmp_path / "run") as bag:
        there = sum(topic.messages for topic in bag.topics.values())
        assert not bag.complete and there == len(list(bag.messages(bag.topics)))
    last = fleet.health("recorder")
    assert f"contains {there} of " in last.message and "File too large" in last.message
    assert int(last.values["bag messages written"]) == there
    assert last.message in fleet.log("recorder")
    assert import_bag(tmp_path / "run", tmp_path / "run.rrd").missing == 0


def test_two_drives_in_a_bag_and_ctrl_c_in_a_replay(fleet: Fleet, tmp_path: Path) -> None:
    """Only the chosen one is published, and a replay ends when it is told to."""
    from ab_sim.drive import Drive
    from ab_sim.drive.description import describe
    from ab_sim.scene import load_scene
    from tests.bags.made import export_of

    scene = load_scene("thesis-hold")
    run = Drive(scene).advance(3000)
    export_of(tmp_path / "left", describe(scene), run.channels, run.samples, namespace="/left")
    joints = fleet.listen(topics.JOINT_STATES._replace(name="left/joint_states"))
    process = replaying(fleet, tmp_path / "left", "--namespace", "left", "--rate", 0.5)
    fleet.until(lambda: len(joints) > 20, "it publishes")
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=20) == 130
    del fleet.processes["replay"]
    assert "Traceback" not in fleet.log("replay") and "interrupted" in fleet.log("replay")


def test_decimated_recording_keeps_what_happens(fleet: Fleet, tmp_path: Path) -> None:
    fleet.start("recorder", path=tmp_path / "run.rrd", every=100, around=0.1)
    fleet.start("drive_sim", scene="thesis-hold", start_paused=True)
    fleet.until(lambda: fleet.value("recorder", "file"), "the recorder has a drive")
    assert fleet.call("drive_sim/pause", False)[0]
    fleet.until(
        lambda: int(fleet.value("recorder", "samples left out by intent") or 0) > 600, "decimated"
    )
    fleet.command(20.0)
    before = int(fleet.value("recorder", "samples left out by intent"))
    fleet.until(
        lambda: int(fleet.value("recorder", "samples left out by intent")) > before + 1500, "after"
    )
    for node in ("drive_sim", "recorder"):
        assert fleet.stop(node) == 0
    recorded = read_recording(tmp_path / "run.rrd")
    assert recorded.complete and recorded.missing == recorded.gaps == 0
    steps, changes = recorded["step"], np.flatnonzero(np.diff(recorded["command"]))
    (turn,) = steps[changes + 1].tolist()
    assert set(range(int(turn) - 99, int(turn) + 99)) <= set(steps.tolist())
    assert recorded.left_out == int(steps[-1] - steps[0]) + 1 - len(steps) > 2000
    assert int(fleet.health("recorder").values["samples written"]) == len(steps)
