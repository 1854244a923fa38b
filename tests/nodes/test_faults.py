"""`drive_sim` with faults: injected by services, marked everywhere, and gone when cleared."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ab_msgs_py import Block, ImuSample, JointSample, Level, VibrationSample, topics
from ab_msgs_py.samples import faults_of
from ab_msgs_py.services import Answer, Stepped
from ab_sim.record.bags.importing import import_bag
from tests.nodes.fleet import Fleet
from tests.recorded import read_recording

pytestmark = pytest.mark.ros


class Bench:
    """A drive in lock-step, and what is heard of it."""

    def __init__(self, fleet: Fleet) -> None:
        self.fleet = fleet
        self.joints = fleet.listen(topics.JOINT_STATES)
        self.vibration = fleet.listen(topics.VIBRATION)
        self.faults = fleet.listen(topics.FAULTS)
        self.blocks = fleet.listen(topics.BLOCK)
        self.samples = fleet.listen(topics.IMU)

    def step(self, silent: bool = False) -> int:
        """All of it heard, but for sensors that are silent; simulated time [ns]."""
        done, text = self.fleet.call("drive_sim/step")
        assert done, text
        time = Stepped.of(text).sim_time_ns
        self.fleet.until(lambda: abs(self.truth("time") - 1e-9 * time) < 1e-6, "its samples")
        if not silent:
            for heard, kind in (
                (self.joints, topics.JOINT_STATES),
                (self.vibration, topics.VIBRATION),
                (self.samples, topics.IMU),
            ):
                self.fleet.until(
                    lambda heard=heard, kind=kind: heard and kind.sample(heard[-1]).time == time,
                    f"its last on {kind.name}",
                )
        return time

    def truth(self, channel: str) -> float:
        """The last sample's."""
        if not self.blocks:
            return -1.0
        block = Block.of(self.blocks[-1])
        return float(block.samples[-1, block.channels.index(channel)])

    def now(self) -> JointSample:
        return JointSample.of(self.joints[-1])

    def felt(self) -> VibrationSample:
        return VibrationSample.of(self.vibration[-1])

    def inject(self, *texts: str) -> Answer:
        done, text = self.fleet.set("drive_sim", faults=list(texts))
        return self.fleet.call("drive_sim/inject_faults") if done else (done, text)

    def marked(self, *texts: str) -> None:
        """On the topic and in the diagnostics."""
        words = ", ".join(texts) or "none"
        self.fleet.until(lambda: faults_of(self.faults[-1]) == list(texts), "the topic says so")
        self.fleet.until(lambda: self.fleet.value("drive_sim", "faults") == words, "so do values")
        health = self.fleet.health("drive_sim")
        assert health is not None
        assert all(f"fault: {text}" in health.message for text in texts), health.message
        assert ("fault" in health.message) == bool(texts)
        assert not texts or health.level is Level.WARN


def refused(answer: Answer, words: str) -> None:
    done, text = answer
    assert not done and words in text, text


def test_faults(fleet: Fleet, tmp_path: Path) -> None:
    session = Bench(fleet)
    fleet.start("recorder", path=tmp_path / "run.rrd", bag=tmp_path / "bag")
    fleet.start(
        "drive_sim", scene="thesis-hold", time_mode="lock_step", steps=50,
        changes="['sensors.pickup.noise_density=0.0']",
    )  # fmt: skip
    fleet.until(lambda: fleet.value("recorder", "file"), "the recorder has a drive")
    fleet.command(120.0)
    fleet.until(lambda: fleet.value("drive_sim", "commands accepted") == "1", "it has come")
    while session.step() < 2_600_000_000:
        pass
    session.marked()

    # What makes no sense changes nothing.
    refused(session.inject("ball_0 stick"), "did you mean 'sticks'?")
    refused(fleet.call("drive_sim/inject_faults"), "the parameter faults is empty")
    refused(session.inject("pickup drops", "ball_9 sticks"), "'sticks' goes with ball_0, ball_1 in")
    refused(session.inject("mount_0 softens 0.5"), "'softens' goes with suspension in this scene")
    assert [faults_of(message) for message in session.faults] == [[]]

    # A stuck ball, and sensors that lie.
    texts = ["ball_0 sticks", "pickup saturates 0.01", "spindle drifts 10"]
    assert session.inject(*texts) == (True, f"faults in force: {', '.join(texts)}")
    session.marked(*texts)
    assert fleet.call("drive_sim/inject_faults")[1].startswith("faults in force already: ball_0")
    before = session.truth("ball_0_angle"), session.truth("ball_1_angle")
    session.step()
    session.step()
    assert session.truth("ball_0_angle") == before[0] == session.now().ball_angles[0]
    assert session.truth("ball_1_angle") != before[1]
    assert session.truth("speed") == 120.0
    assert session.now().spindle_speed == pytest.approx(120.0 + 10.0 * 0.4)
    assert max(np.abs(session.felt().linear)) == 0.01
    last = [ImuSample.of(message).force for message in session.samples[-100:]]
    assert max(np.abs(last).ravel()) == 0.01
    assert np.hypot(session.truth("pickup_1"), session.truth("pickup_2")) > 0.1
    refused(fleet.call("drive_sim/save_snapshot"), "faults are in force (ball_0 sticks, pickup sa")
    refused(fleet.call("drive_sim/restore_snapshot"), "~/clear_faults first")
    refused(fleet.call("drive_sim/load_disc"), "~/clear_faults first")

    # Others instead; what falls silent does.
    texts = [
        "ball_1 lost",
        "suspension softens 0.5",
        "disc slips 2",
        "pickup drops 1",
        "spindle drops 1",
    ]
    assert session.inject(*texts)[0]
    session.marked(*texts)
    free, begin = session.truth("ball_0_angle"), session.truth("angle")
    session.step(silent=True)
    heard = len(session.vibration), len(session.joints), len(session.samples)
    session.step(silent=True)
    assert (len(session.vibration), len(session.joints), len(session.samples)) == heard
    assert session.truth("ball_0_angle") != free, "the stuck one was let go"
    turned = session.truth("angle") - begin
    assert turned == pytest.approx((120.0 - 2.0) * 0.4, abs=0.03), "the unbalance falls behind"
    assert fleet.call("drive_sim/clear_faults") == (True, "faults in force: none")
    session.marked()
    session.step()
    assert len(session.vibration) > heard[0]
    assert session.truth("angle") - begin == pytest.approx(120.0 * 0.6), "and is back"
    assert session.now().spindle_angle == pytest.approx(session.truth("angle"))

    # They stay through a reset, and end with the scene.
    assert session.inject("ball_1 sticks")[0]
    assert fleet.call("drive_sim/reset")[0]
    fleet.command(50.0)
    fleet.until(lambda: fleet.value("drive_sim", "commands accepted") == "2", "it has come")
    assert session.step() == 200_000_000
    assert session.truth("ball_1_angle") == 0.0 != session.truth("ball_0_angle")
    late: list[Any] = []
    topics.FAULTS.subscription(fleet.node, late.append)
    fleet.until(lambda: late, "who comes late hears of them")
    assert faults_of(late[0]) == ["ball_1 sticks"]
    assert fleet.call("drive_sim/load_scene")[0]
    session.marked()
    fleet.until(lambda: fleet.value("recorder", "messages waiting") == "0", "all is written")
    for node in ("drive_sim", "recorder"):
        assert fleet.stop(node) == 0, fleet.log(node)
        assert "Traceback" not in fleet.log(node)

    # Recorded: true samples without a gap, and what was in force.
    noted = []
    for path in sorted(tmp_path.glob("run*.rrd")):
        recorded = read_recording(path)
        assert recorded.missing == 0
        noted += [(e.text, e.level) for e in recorded.events if e.source == "faults"]
    told = ", ".join(texts)
    assert ("faults: none", "INFO") in noted and (f"faults: {told}", "WARN") in noted
    assert ("faults: ball_1 sticks", "WARN") in noted
    imported = import_bag(tmp_path / "bag", tmp_path / "bag.rrd")
    events = [e for path in imported.files for e in read_recording(path).events]
    assert {e.text for e in events if e.source == "faults"} == {text for text, _ in noted}
