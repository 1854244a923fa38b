"""Profiles under way, and `ab-sim node` that starts and aborts them: one drive for all of it."""

import json
import math
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from ab_msgs_py import JointSample, Level, topics
from ab_msgs_py.samples import text_of
from tests.cli.tool import ab_sim
from tests.domains import own_domain
from tests.nodes.fleet import Fleet

pytestmark = [pytest.mark.ros, pytest.mark.long]

CONTROLLER = "profile_controller"
SHAKEN = """
kind: segments
segments:
  - {until: {vibration_rms_above: 0.3, over: 0.1, at_most: 20.0}, acceleration: 10.0}
  - {to: 0.0, acceleration: 45.0}
"""
CALM = """
kind: segments
segments:
  - {to: 50.0, acceleration: 100.0}
  - {until: {vibration_rms_below: 0.5, over: 0.2, at_most: 60.0, otherwise: abort}}
  - {to: 0.0, acceleration: 100.0}
"""


@pytest.fixture(scope="module")
def profile(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file with a profile that runs up until the drive shakes."""
    file = tmp_path_factory.mktemp("profile") / "shaken.yaml"
    file.write_text(SHAKEN)
    return file


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Fleet]:
    with own_domain() as domain:
        fleet = Fleet(domain, tmp_path_factory.mktemp("bench"))
        for topic in (topics.JOINT_STATES, topics.PROFILE_STATUS):
            fleet.listen(topic)
        fleet.start("drive_sim", scene="thesis-hold")
        yield fleet
        fleet.close()


@pytest.fixture
def session(drive: Fleet, profile: Path) -> Fleet:
    """A drive in real time that stands still, and a controller that runs no profile."""
    if CONTROLLER not in drive.processes:
        drive.start(
            CONTROLLER, profile=profile, use_sim_time=True, abort_deceleration=20.0,
            vibration_timeout=60.0,
        )  # fmt: skip
        drive.until(lambda: status_of(drive), "the controller is there")
    assert drive.set("drive_sim", speed_factor=1.0)[0]
    drive.call(f"{CONTROLLER}/abort")  # refused if no profile runs
    drive.until(lambda: status_of(drive).partition(":")[0] in ("idle", "aborted"), "none runs")
    drive.until(lambda: speed_of(drive) == 0.0, "it stands still")
    assert drive.set(CONTROLLER, profile=str(profile))[0]
    return drive


@pytest.fixture
def asked(session: Fleet, monkeypatch: pytest.MonkeyPatch) -> Iterator["Asked"]:
    monkeypatch.setenv("ROS_DOMAIN_ID", session.environment["ROS_DOMAIN_ID"])
    yield Asked()


class Asked:
    """`ab-sim node`, as it is typed."""

    def __call__(self, *words: str, code: int = 0) -> str:
        done = ab_sim("node", *words)
        assert done.returncode == code, (words, done.stdout, done.stderr)
        assert "Traceback" not in done.stderr
        return done.stdout if code == 0 else done.stderr


def speed_of(fleet: Fleet) -> float:
    joints = fleet.heard["joint_states"]
    return JointSample.of(joints[-1]).spindle_speed if joints else math.nan


def status_of(fleet: Fleet) -> str:
    heard = fleet.heard["profile_controller/status"]
    return text_of(heard[-1]) if heard else ""


def test_asking_the_drive(session: Fleet, asked: Asked, tmp_path: Path) -> None:
    assert "not paused: pause first" in asked("step", code=1)
    assert asked("pause") == "paused\n"
    assert json.loads(asked("step", "3"))["wakes"] == 3
    saved = tmp_path / "kept.json"
    assert "t = " in asked("save", str(saved)) and saved.exists()
    assert "rad further" in asked("load-disc", "2e-4", "-0.5")
    assert "snapshot" in asked("restore", str(saved), code=1), "of another disc"
    asked("load-scene", "thesis-hold", "balls.mass=0.001")
    assert "did you mean 'speed_factor'?" in asked("set", "sped_factor=1", code=2)
    assert "speed_factor" in asked("set", "steps=7", "speed_factor=1000", code=1)
    assert asked("set", "speed_limit=150", "speed_factor=4") == "set\n"
    told = asked("get", "steps", "speed_limit", "changes")
    assert told == 'steps: 1\nspeed_limit: 150\nchanges: ["balls.mass=0.001"]\n', "put back"
    assert "commands are ignored" in asked("emergency-stop")
    assert asked("reset-emergency-stop") == "the next command is followed\n"
    assert asked("resume") == "running\n"


def test_whom_one_asks(session: Fleet, asked: Asked) -> None:
    listed = asked("list", "--wait", "1e6")  # which ends when all have spoken
    assert "/drive_sim" in listed and "/profile_controller" in listed and "start, abort" in listed
    said = asked("pause", "--namespace", "left", "--wait", "5", code=2)
    assert "no node offers /left/drive_sim/pause (waited 5 s); /drive_sim offers it" in said
    said = asked("pause", "--node", "profile_controller", "--wait", "5", code=2)
    assert "/profile_controller is running, and offers abort, restore_snapshot" in said


def test_a_profile_until_the_drive_shakes(session: Fleet, asked: Asked) -> None:
    assert session.set("drive_sim", speed_factor=4.0)[0]
    assert "not running" in asked("abort", code=1)
    assert "started at t = " in asked("start")
    session.until(lambda: status_of(session) == "done", "it is done")
    session.until(lambda: speed_of(session) == 0.0, "it stands still again")
    statuses = [text_of(m) for m in session.heard["profile_controller/status"]]
    assert statuses[-3] == (
        "running: segment 1 of 2, accelerate at 10 rad/s^2 until vibration above 0.3 m/s^2, at "
        "most 20 s"
    )
    # A tenth of a second at 65 rad/s shakes that much, by the closed form; not to be had at 50.
    left = re.fullmatch(
        r"running: segment 2 of 2, from (\S+) to 0 rad/s at -45 rad/s\^2", statuses[-2]
    )
    assert left is not None and 50.0 < float(left[1]) < 200.0
    session.until(
        lambda: (h := session.health("profile_controller")) and h.values["state"] == "done",
        "its health says so",
    )
    assert session.health("profile_controller").level is Level.OK, "and not that time was up"


def test_an_abort_is_a_ramp(session: Fleet) -> None:
    session.until(lambda: session.call("profile_controller/start")[0], "it starts")
    session.until(lambda: speed_of(session) > 10.0, "10 rad/s")
    before = len(session.heard["joint_states"])
    assert session.call("profile_controller/abort") == (True, "ramping down to standstill")
    session.until(lambda: status_of(session) == "aborted", "it is aborted")
    session.until(lambda: speed_of(session) == 0.0, "it stands still")
    joints = [JointSample.of(m) for m in session.heard["joint_states"][before:]]
    fastest = max(joints, key=lambda joint: joint.spindle_speed)
    down = next(j for j in joints if j.time > fastest.time and j.spindle_speed == 0.0)
    took = (down.time - fastest.time) * 1e-9
    assert took >= fastest.spindle_speed / 20.0 - 0.05, "in the time that 20 rad/s^2 take, or more"
    session.until(
        lambda: (h := session.health("profile_controller")) and "by ~/abort" in h.message,
        "its health says why",
    )
    assert session.health("profile_controller").level is Level.WARN


def test_another_profile_is_for_the_next_start(session: Fleet) -> None:
    """The run under way goes on; what cannot be run is refused, and changes nothing."""
    node, calm = CONTROLLER, "{kind: segments, segments: [{to: 8, acceleration: 40}]}"
    # Slowly: requests are many, and the first segment is to last for all of them.
    assert session.set("drive_sim", speed_factor=0.1)[0]
    session.until(lambda: session.call(f"{node}/start")[0], "it starts")
    session.until(lambda: status_of(session).startswith("running: segment 1 of 2"), "it runs")
    for values, words in (
        ({"profile": "no-such-scene"}, "no-such-scene"),
        ({"profile": "{kind: segments}"}, "segments: is missing"),
        ({"profile": 5}, "parameter profile = 5: must be a text"),
        ({"profile": calm, "changes": ["balls.mass=1"]}, "is a profile by itself"),
        ({"profile": calm, "command_rate": 100.0}, "read-only"),
    ):
        done, why = session.set(node, **values)
        assert not done and words in why, why
    assert session.set(node, profile=calm) == (True, "")
    assert status_of(session).startswith("running: segment 1 of 2"), "the present one goes on"
    assert session.call(f"{node}/abort")[0]
    session.until(lambda: status_of(session) == "aborted", "it is aborted")
    session.healths.clear()
    session.until(
        lambda: session.value("profile_controller", "listeners to trajectories") == "1",
        "the controller knows that the drive takes trajectories",
    )
    assert session.call(f"{node}/start")[0]
    # Once the profile is done, speeds are sent again.
    session.until(
        lambda: "a trajectory" in [each.values["sends"] for each in session.healths_of(node)],
        "it says so",
    )
    session.until(lambda: status_of(session) == "done", "the other one is done")
    session.until(lambda: speed_of(session) == 8.0, "and its speed is held")
    statuses = [text_of(m) for m in session.heard["profile_controller/status"]]
    assert statuses[-2].startswith("running: segment 1 of 1, from 0 to 8 rad/s")


def test_a_profile_that_the_drive_cannot_follow_is_aborted(session: Fleet) -> None:
    """50 rad/s^2 is what the scene's spindle can do; the reason is the drive's."""
    node, steep = CONTROLLER, "{kind: segments, segments: [{to: 20, acceleration: 80}]}"
    assert session.set(node, profile=steep) == (True, "")
    session.heard["profile_controller/status"].clear()
    session.until(lambda: session.call(f"{node}/start")[0], "it starts")
    refusal = "aborted: the drive does not follow the profile: "
    session.until(lambda: status_of(session).startswith(refusal), "it is judged")
    assert speed_of(session) == 0.0
    session.reads(node, "80 rad/s^2, and at most 50 rad/s^2 are allowed")
    session.reads("drive_sim", "spindle/trajectory, refused: points[0]: ")


def test_commanding_a_speed(session: Fleet, asked: Asked) -> None:
    assert session.stop(CONTROLLER) == 0, "it would go on commanding"
    assert session.set("drive_sim", speed_limit=100.0)[0]
    asked("reset-state")
    assert asked("command", "20") == (
        "accepted: from 0 to 20 rad/s, at 50 rad/s^2, 0.4 s; limit 100 rad/s\n"
    )
    session.until(lambda: speed_of(session) == 20.0, "it has followed")
    assert "command = 101 rad/s: must be within +-100 rad/s" in asked("command", "101", code=2)
    assert "there is no drive /left/drive_sim" in asked(
        "command", "9", "--namespace", "left", "--wait", "5", code=2
    )
    asked("emergency-stop")
    assert "ignored after an emergency stop" in asked("command", "9", code=1)
    asked("reset-emergency-stop")
    assert "to -1.0472 rad/s" in asked("command", "-10 rpm")
    session.until(lambda: speed_of(session) == pytest.approx(-math.pi / 3), "and backwards")
    asked("deactivate")
    assert "inactive: time is stopped" in asked("command", "9", code=1)
    asked("activate")


def test_a_drive_that_is_not_ab_sim(fleet: Fleet, tmp_path: Path) -> None:
    """A board that knows its own clock and standard topics, and is best effort in both."""
    profile = tmp_path / "calm.yaml"
    profile.write_text(CALM)
    status = fleet.listen(topics.PROFILE_STATUS)
    fleet.start("profile_controller", profile=profile, auto_start=True, abort_deceleration=25.0)
    fleet.until(lambda: status and "waiting: no drive" in text_of(status[-1]), "it waits")
    fleet.start_process("board", sys.executable, Path(__file__).with_name("stand_in_drive.py"))
    fleet.until(lambda: text_of(status[-1]) == "done", "the profile is done")
    said = [text_of(message) for message in status]
    assert any("segment 2 of 3, hold 50 rad/s until vibration below" in text for text in said)
    fleet.until(lambda: "stands still again, 1" in fleet.log("board"), "it stands still")
    assert fleet.call("profile_controller/start")[0]
    fleet.until(lambda: text_of(status[-1]) == "aborted", "it is aborted")
    said = [text_of(message) for message in status]
    assert "aborting: segment 2 waits for the vibration, and no valid sample of it" in said[-2]
    fleet.until(lambda: "stands still again, 2" in fleet.log("board"), "it stands still")
    steps = [int(word) for word in re.findall(r"by (\d+) steps", fleet.log("board"))]
    assert len(steps) == 2 and min(steps) > 5, "both times by a ramp, however busy the machine"
    assert fleet.stop("profile_controller") == 0
