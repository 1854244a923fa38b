"""What outlives what: watchdog, killed nodes, a subscriber that never reads; time meanwhile."""

import signal
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ab_msgs_py import Block, JointSample, topics
from ab_msgs_py.samples import nanoseconds_of, text_of
from ab_msgs_py.services import Stepped
from tests.nodes.fleet import Fleet
from tests.recorded import read_recording

pytestmark = [pytest.mark.ros, pytest.mark.long]

STEP, WAKE = 1e-3, 4e-3
LIMIT, SLOPE, COAST = 0.02, 50.0, 10.0
"""s; rad/s^2 of the scene's spindle, and of one that coasts."""
NEVER_READS = """
import time, rclpy
from ab_msgs_py import topics
rclpy.init()
node = rclpy.create_node("never_reads")
kept = [topic.subscription(node, print) for topic in topics.ALL if topic.type is not None]
print("listening", flush=True)
time.sleep(3600.0)
"""


def speeds(joints: Sequence[Any]) -> np.ndarray:
    return np.array([message.velocity[0] for message in joints])


def stamp(message: Any) -> int:
    """Simulated time [ns]."""
    return nanoseconds_of(message.header.stamp)


def test_the_watchdog_in_each_mode(fleet: Fleet) -> None:
    """In lock-step: what it does is known to the step."""
    joints = fleet.listen(topics.JOINT_STATES)
    fleet.start("drive_sim", scene="thesis-hold", time_mode="lock_step", coast_deceleration=COAST)
    fleet.until(lambda: fleet.value("drive_sim", "speed set by"), "it is up")
    # No more at once than the topic's queue holds.
    assert fleet.set("drive_sim", steps=10, command_age_limit=LIMIT)[0]
    before, begun, silences = 0.0, 0, 0
    for mode, after in (("hold", 0.0), ("coast", -COAST), ("stop", -SLOPE)):
        assert fleet.set("drive_sim", command_silence=mode)[0]
        fleet.command(100.0)
        for commands in (1, 0):
            assert fleet.set("drive_sim", await_commands=commands)[0]
            done, text = fleet.call("drive_sim/step")
            assert done and Stepped.of(text).wakes == 10
            ended = Stepped.of(text).sim_time_ns
            fleet.until(
                lambda end=ended: joints and stamp(joints[-1]) == end, "all that came of it"
            )
        # Not by their number: the start, too, is published, whenever it is heard.
        new = [message for message in joints if stamp(message) > begun]
        silences += 1
        fleet.until(
            lambda count=silences: fleet.value("drive_sim", "watchdog has acted") == str(count),
            f"{mode} is reported",
        )
        assert fleet.value("drive_sim", "speed set by") == "watchdog"
        passed = WAKE * np.arange(1, 21)
        reached = before + SLOPE * np.minimum(passed, LIMIT)
        expected = np.maximum(reached + after * np.maximum(passed - LIMIT, 0.0), 0.0)
        np.testing.assert_allclose(speeds(new), expected, rtol=0, atol=1e-12)
        before, begun = float(expected[-1]), ended
    assert before == joints[-1].velocity[0] == 0.0, "stop is stop"
    fleet.reads("drive_sim", "no command for 0.02 s")
    # A wake-up is shorter than the watchdog's limit, and time stands afterwards.
    assert fleet.set("drive_sim", steps=1, await_commands=1)[0]
    fleet.command(100.0)
    assert fleet.call("drive_sim/step")[0]
    fleet.reads("drive_sim", "no more warnings")
    assert fleet.stop("drive_sim") == 0


def offset(heard: Sequence[tuple[float, float]], factor: float) -> float:
    """How late simulated time is by the wall clock [s], but for the messages' way: the least."""
    return min(wall - simulated / factor for wall, simulated in heard)


def test_time_with_a_subscriber_that_never_reads(fleet: Fleet) -> None:
    """Its process does not even acknowledge; the clock keeps its pace, and stands when told."""
    joints, blocks = fleet.listen(topics.JOINT_STATES), fleet.listen(topics.BLOCK)
    clock: list[tuple[float, float]] = []
    topics.CLOCK.subscription(
        fleet.node, lambda m: clock.append((time.monotonic(), 1e-9 * nanoseconds_of(m.clock)))
    )
    stuck = fleet.start_process("never_reads", sys.executable, "-c", NEVER_READS)
    fleet.start("drive_sim", scene="thesis-hold", speed_factor=0.5)
    fleet.until(lambda: "listening" in fleet.log("never_reads"), "it listens")
    fleet.until(lambda: fleet.node.count_subscribers("vibration") == 1, "and is known")
    # More than any queue holds.
    more = len(joints) + 500
    fleet.until(lambda: len(joints) > more, "the drive goes on")
    stuck.send_signal(signal.SIGSTOP)
    for factor in (0.5, 2.0):
        assert fleet.set("drive_sim", speed_factor=factor)[0]
        begin, dropped = len(clock), int(fleet.value("drive_sim", "steps dropped"))
        fleet.until(lambda begin=begin: len(clock) > begin + 900, "900 wake-ups")
        early, late = clock[begin : begin + 300], clock[-300:]
        lost = STEP * (int(fleet.value("drive_sim", "steps dropped")) - dropped) / factor
        passed = late[-1][0] - early[0][0]
        # Steps that were dropped are counted up to a second late.
        assert (
            -0.02 * passed <= offset(late, factor) - offset(early, factor) <= lost + 0.02 * passed
        )
    assert fleet.call("drive_sim/pause", True)[0]
    paused, repeated = clock[-1][1], len(clock) + 2
    # What it said before it was asked may have come behind its answer.
    fleet.until(
        lambda: len(clock) >= repeated and clock[-2][1] == clock[-1][1], "standing time is repeated"
    )
    standing, shown, repeated = clock[-1][1], len(joints), len(clock) + 2
    fleet.until(lambda: len(clock) >= repeated, "and again")
    assert {simulated for _, simulated in clock[-2:]} == {standing} and len(joints) - shown <= 1
    assert standing >= paused
    assert fleet.call("drive_sim/pause", False)[0]
    goal = clock[-1][1] + 0.5
    fleet.until(lambda: clock[-1][1] > goal, "it goes on")
    assert fleet.stop("drive_sim") == 0
    assert np.all(np.diff([simulated for _, simulated in clock]) >= 0.0), "never back"
    steps = np.concatenate([Block.of(message).samples[:, 0] for message in blocks])
    assert np.all(np.diff(steps) == 1), "nobody else has missed anything"


def test_killed_nodes_are_started_again(fleet: Fleet, tmp_path: Path) -> None:
    """The controller, then the simulator; whoever else runs goes on."""
    joints, status = fleet.listen(topics.JOINT_STATES), fleet.listen(topics.PROFILE_STATUS)
    blocks = fleet.listen(topics.BLOCK)

    def drive(file: str) -> None:
        fleet.healths.clear()
        fleet.start("drive_sim", scene="thesis-hold", start_paused=True)
        # Services of one that was killed seem to be there for a while: a request has to find this
        # one's, which are there when it has come up.
        fleet.until(
            lambda: (h := fleet.health("drive_sim")) and h.message.startswith("paused"),
            "it says how it is",
        )
        fleet.until(lambda: fleet.value("recorder", "file").endswith(file), f"{file} is begun")
        joints.clear()
        # The client was ready at once, because of the killed one's service, and a request that goes
        # only there is never answered.
        fleet.acquainted()
        assert fleet.call("drive_sim/pause", False, again=5.0)[0]

    def state() -> str:
        return text_of(status[-1]).partition(":")[0] if status else ""

    def running() -> None:
        fleet.until(lambda: state() in ("running", "done"), "the profile runs")
        fleet.until(lambda: joints and joints[-1].velocity[0] > 5.5, "the drive follows")

    fleet.start("recorder", path=tmp_path / "run.rrd")
    drive("run.rrd")
    fleet.start("profile_controller", profile="thesis-hold", use_sim_time=True, auto_start=True)
    running()
    assert fleet.stop("profile_controller", signal.SIGKILL) == -signal.SIGKILL
    fleet.until(lambda: np.ptp(speeds(joints[-100:])) == 0.0, "what was commanded goes on")
    assert 5.0 < joints[-1].velocity[0] <= 200.0
    assert fleet.set("drive_sim", command_age_limit=0.5, command_silence="stop")[0]
    fleet.until(lambda: joints[-1].velocity[0] == 0.0, "the watchdog knows that it is gone")
    status.clear()
    fleet.start("profile_controller", profile="thesis-hold", use_sim_time=True, auto_start=True)
    running()

    assert fleet.stop("drive_sim", signal.SIGKILL) == -signal.SIGKILL
    heard, found = len(blocks), fleet.value("recorder", "samples missing")
    drive("run-2.rrd")
    fleet.until(lambda: state() == "aborted", "time is another one")
    fleet.reads("profile_controller", "time jumped from")
    fleet.until(lambda: joints and JointSample.of(joints[-1]).time > 10**9, "a second goes by")
    assert np.all(speeds(joints) == 0.0), "no speed of the drive before is wanted"
    fleet.until(lambda: fleet.call("profile_controller/start")[0], "it starts again")
    running()
    for node in ("drive_sim", "profile_controller", "recorder"):
        assert fleet.stop(node) == 0, node
        assert "Traceback" not in fleet.log(node)
    assert found == fleet.value("recorder", "samples missing") == "0"
    for name, mine in (("run.rrd", blocks[:heard]), ("run-2.rrd", blocks[heard:])):
        recorded = read_recording(tmp_path / name)
        assert recorded.complete and recorded.missing == recorded.gaps == 0
        # A last block may have been on its way to one of us when its sender was killed.
        samples = np.concatenate([Block.of(message).samples for message in mine])
        both = min(len(samples), len(recorded.samples))
        assert both >= max(len(samples), len(recorded.samples)) - 20
        assert recorded.samples[:both].tobytes() == samples[:both].tobytes()
