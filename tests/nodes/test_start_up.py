"""The three nodes together: a start-up, recorded, read back, and run again offline."""

import math
from pathlib import Path

import numpy as np
import pytest

from ab_msgs_py import Block, Health, Level, Task, topics
from ab_msgs_py.samples import text_of
from ab_sim.analysis import run_scene
from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene import check_scene, find_scene
from ab_sim.show.compare import PROFILE, compare_recording
from tests.nodes.fleet import Fleet
from tests.recorded import read_recording
from tests.recording.runs import cells

pytestmark = [pytest.mark.ros, pytest.mark.long]


@pytest.fixture
def brisk(tmp_path: Path) -> Path:
    """The thesis' drive with the hold, started up ten times as fast, so that a test can wait."""
    text = find_scene("thesis-hold").read_text()
    for old, new in (
        ("acceleration: 40.0", "acceleration: 400.0"),
        ("max_acceleration: 50.0", "max_acceleration: 500.0"),
        ("duration: 0.5", "duration: 0.2"),
    ):
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "brisk.yaml"
    path.write_text(text)
    return path


def test_recorded_start_up_equals_an_offline_run(fleet: Fleet, brisk: Path, tmp_path: Path) -> None:
    status, joints = fleet.listen(topics.PROFILE_STATUS), fleet.listen(topics.JOINT_STATES)
    file = tmp_path / "run.rrd"
    fleet.start("recorder", path=file)
    fleet.start("drive_sim", scene=brisk, start_paused=True)
    fleet.start("profile_controller", profile=brisk, use_sim_time=True)
    fleet.until(lambda: fleet.value("recorder", "file"), "the recorder has a drive")
    from_0 = (True, "started at t = 0 s")
    fleet.until(lambda: fleet.call("profile_controller/start") == from_0, "the profile starts")
    fleet.until(
        lambda: fleet.value("drive_sim", topics.TRAJECTORY_ANSWER) == topics.FOLLOWED,
        "the drive has the profile",
    )
    assert fleet.call("profile_controller/start") == (False, "running already; abort first")
    assert fleet.call("drive_sim/pause", False)[0]
    fleet.until(lambda: status and text_of(status[-1]) == "done", "the profile is done")
    fleet.until(lambda: joints and joints[-1].velocity[0] == 200.0, "the drive is there")
    fleet.until(lambda: fleet.value("drive_sim", "real-time factor"), "its pace is measured")
    assert fleet.set("drive_sim", speed_factor=0.5)[0]
    fleet.until(
        lambda: "speed_factor = 0.5" in fleet.value("drive_sim", "parameters"),
        "it says what it was told",
    )
    for node in ("drive_sim", "profile_controller", "recorder"):
        assert fleet.stop(node) == 0, node
        assert "Traceback" not in fleet.log(node)

    recorded = read_recording(file)
    assert recorded.complete and recorded.missing == recorded.gaps == 0
    assert recorded.description["scene"]["name"] == "brisk"
    live = Trajectory(recorded.channels, recorded.samples)
    assert live["step"][0] == 0
    assert live["speed"].max() == pytest.approx(200.0)
    assert len(set(live["command"].tolist())) > 20, "a history of commands"
    assert np.abs(live.ball_angles[-1]).min() > 0.1, "the balls moved"
    offline = run_scene(check_scene(recorded.description["scene"], "the recording")).trajectory
    # The first sample was taken before the drive was commanded.
    last = min(len(offline), len(live))
    assert last > 600 and np.array_equal(offline.samples[1:last], live.samples[1:last])
    compared = compare_recording(file, brisk)
    assert compared.same and compared.driven_by == PROFILE
    texts = [event.text for event in recorded.events]
    assert any("profile: running" in text for text in texts)
    assert any("profile: done" in text for text in texts)
    parameters = [text for text in texts if ": parameters: " in text]
    for parameter in (
        "drive_sim: parameters: ", "start_paused = True", "use_sim_time = True",
        "speed_factor = 0.5",
    ):  # fmt: skip
        assert any(parameter in text for text in parameters), parameter
    assert not any("command_rate" in text for text in parameters), "it has its default"
    assert cells(file, "/health/profile", "StateChange:state")[-1] == ["done"]
    assert {"OK"} <= {state for [state] in cells(file, "/health/drive_sim", "StateChange:state")}
    factors = recorded.scalars["real_time_factor"][:, 1]
    assert len(factors) > 0 and factors.min() > 0.0, "while it stood still there was none"


def test_abort_commands_standstill(fleet: Fleet) -> None:
    status, joints = fleet.listen(topics.PROFILE_STATUS), fleet.listen(topics.JOINT_STATES)
    fleet.start("drive_sim", scene="thesis-hold")
    fleet.start("profile_controller", profile="thesis-hold", use_sim_time=True)
    assert fleet.call("profile_controller/abort") == (False, "not running")
    fleet.until(lambda: fleet.call("profile_controller/start")[0], "the profile starts")
    fleet.until(lambda: joints and joints[-1].velocity[0] > 2.0, "2 rad/s")
    assert fleet.call("profile_controller/abort") == (True, "ramping down to standstill")
    fleet.until(lambda: joints and joints[-1].velocity[0] == 0.0, "standstill")
    fleet.until(lambda: status and text_of(status[-1]) == "aborted", "the status says so")
    assert max(message.velocity[0] for message in joints) < 199.0, "it never got to the end"


def test_reset_of_the_drive_aborts_the_profile(fleet: Fleet) -> None:
    """Time goes back; the profile's own time means nothing any more, and nothing goes backwards."""
    status, joints = fleet.listen(topics.PROFILE_STATUS), fleet.listen(topics.JOINT_STATES)
    fleet.start("drive_sim", scene="thesis-hold")
    fleet.start("profile_controller", profile="thesis-hold", use_sim_time=True, auto_start=True)
    fleet.until(lambda: joints and joints[-1].velocity[0] > 2.0, "2 rad/s")
    assert fleet.call("drive_sim/reset")[0]
    fleet.until(
        lambda: status and text_of(status[-1]).startswith("aborted: time jumped from"),
        "the profile is aborted, with the reason",
    )
    fleet.reads("profile_controller", "time jumped from")
    fleet.until(lambda: joints and joints[-1].velocity[0] == 0.0, "standstill")
    assert min(message.velocity[0] for message in joints) == 0.0
    fleet.until(lambda: fleet.call("profile_controller/start")[0], "it may start again")


def test_recorder_survives_malformed_messages(fleet: Fleet, tmp_path: Path) -> None:
    file, blocks = tmp_path / "run.rrd", fleet.listen(topics.BLOCK)
    fleet.start("recorder", path=file)
    fleet.start("drive_sim", scene="thesis-hold")
    fleet.until(lambda: int(fleet.value("recorder", "samples written") or 0) > 100, "samples")
    fleet.until(lambda: blocks, "the watcher, too, has heard a block")
    block = topics.BLOCK.publisher(fleet.node)
    description = topics.DESCRIPTION.publisher(fleet.node)
    diagnostics = topics.DIAGNOSTICS.publisher(fleet.node)
    timeless = Block.of(blocks[-1])
    timeless.samples[0, 1] = math.nan
    for bad in (
        Block(("step", "time"), np.zeros((3, 2))),
        Block(("step", "time"), np.array([[math.nan, 0.0]])),
        Block(("step", "time"), np.array([[1e9, 0.0]])),
        timeless,
    ):
        block.publish(topics.BLOCK.message(bad))
    description.publish(topics.DESCRIPTION.message({"balls": "two"}))
    factor = {"real-time factor": "one"}
    health = Health("/drive_sim", Task.DRIVE, Level.OK, "", factor)
    diagnostics.publish(topics.DIAGNOSTICS.message(health))
    fleet.until(
        lambda: int(fleet.value("recorder", "messages malformed") or 0) == 6, "six are counted"
    )
    for topic in (topics.BLOCK, topics.DESCRIPTION, topics.DIAGNOSTICS):
        fleet.until(
            lambda name=topic.name: f"messages on {name}, the last one" in fleet.log("recorder"),
            f"each kind is told of: {topic.name}",
        )
    for node in ("drive_sim", "recorder"):
        assert fleet.stop(node) == 0
    recorded = read_recording(file)
    assert recorded.complete and recorded.missing == 0


def test_a_flood_of_commands_costs_no_samples(fleet: Fleet, tmp_path: Path) -> None:
    file = tmp_path / "run.rrd"
    fleet.start("recorder", path=file, queue=200)
    fleet.start("drive_sim", scene="thesis-hold")
    fleet.until(lambda: int(fleet.value("recorder", "samples written") or 0) > 100, "samples")

    def lost() -> int:
        fleet.command(*[50.0] * 500)
        return int(fleet.value("recorder", "messages dropped") or 0)

    fleet.until(lambda: lost() > 1000, "messages are dropped")
    for node in ("drive_sim", "recorder"):
        assert fleet.stop(node) == 0
    last, recorded = fleet.health("recorder"), read_recording(file)
    assert recorded.complete and recorded.missing == int(last.values["samples missing"]) == 0
    assert int(last.values["samples written"]) == len(recorded.samples)
    assert last.level is Level.WARN
    assert last.values["messages dropped"] == last.values["messages dropped, spindle/command"]


def test_no_start_without_a_drive(fleet: Fleet) -> None:
    fleet.start("profile_controller", profile="thesis-hold")
    done, text = fleet.call("profile_controller/start")
    assert not done and "no drive subscribes to /spindle/command" in text
    assert fleet.stop("profile_controller") == 0


def test_recorder_without_a_drive_says_so_and_ends_cleanly(fleet: Fleet, tmp_path: Path) -> None:
    fleet.start("recorder", path=tmp_path / "none.rrd")
    fleet.until(lambda: "no message from a drive" in fleet.log("recorder"), "a warning")
    assert fleet.stop("recorder") == 0
    assert not (tmp_path / "none.rrd").exists()
