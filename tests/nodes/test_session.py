"""`drive_sim` as a test bench: lock-step, settings, watchdog, emergency stop, snapshots, discs."""

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from std_srvs.srv import Trigger

from ab_msgs_py import Block, JointSample, Level, topics
from ab_msgs_py.samples import description_of, nanoseconds_of
from ab_msgs_py.services import Stepped, answer_of, trigger_request
from tests.nodes.fleet import Fleet

pytestmark = [pytest.mark.ros, pytest.mark.long]

WAKE_NS = 4_000_000


def step(fleet: Fleet) -> Stepped:
    done, text = fleet.call("drive_sim/step")
    assert done, text
    return Stepped.of(text)


def refused(answer: tuple[bool, str], words: str) -> None:
    done, text = answer
    assert not done and words in text, text


def warned(fleet: Fleet, words: str) -> None:
    fleet.until(
        lambda: (h := fleet.health("drive_sim")) and h.level is Level.WARN and words in h.message,
        f"a warning: {words}",
    )


def test_lock_step(fleet: Fleet, tmp_path: Path) -> None:
    """Time goes on by requests only, each answered when all of it has been published."""
    joints, clock = fleet.listen(topics.JOINT_STATES), fleet.listen(topics.CLOCK)
    described = fleet.listen(topics.DESCRIPTION)
    fleet.start(
        "drive_sim", scene="thesis-hold", time_mode="lock_step", garbage_by_hand=True,
        realtime_priority=3, command_delay=0.002, snapshot=tmp_path / "kept.json",
    )  # fmt: skip
    assert step(fleet) == (WAKE_NS, 1, 0)
    refused(fleet.call("drive_sim/pause", False), "time advances by ~/step only")
    fleet.until(
        lambda: "garbage by hand" in fleet.value("drive_sim", "scheduling"), "it says what it has"
    )
    logged = "real-time priority 3: the system refuses" in fleet.log("drive_sim")
    assert logged != ("SCHED_FIFO 3" in fleet.value("drive_sim", "scheduling").split("; "))

    # Settings: judged together, and all or none holds.
    refused(fleet.set("drive_sim", steps=0), "Parameter steps out of range. Min: 1")
    refused(fleet.set("drive_sim", steps=7, speed_factor=1000.0), "speed_factor out of range")
    refused(fleet.set("drive_sim", steps=7, wake_rate=500.0), "read-only")
    refused(fleet.set("drive_sim", time_mode="fast"), "must be one of paced, free, lock_step")
    refused(fleet.set("drive_sim", scene="thesis-hlod"), "did you mean 'thesis-hold'")
    refused(fleet.set("drive_sim", scene="/" + 300 * "x" + "/y.yaml"), "cannot be read")
    refused(fleet.set("drive_sim", faults=5), "parameter faults = 5: must be a list of texts")
    refused(fleet.set("drive_sim", changes=None), "parameter changes: cannot be deleted; set it")
    assert step(fleet) == (2 * WAKE_NS, 1, 0), "nothing of it holds"
    assert fleet.set("drive_sim", steps=5, acceleration_limit=40)[0]
    before = len(joints)
    assert step(fleet) == (7 * WAKE_NS, 5, 0)
    fleet.until(
        lambda: (
            [JointSample.of(m).time for m in joints[before:]] == [k * WAKE_NS for k in range(3, 8)]
        ),
        "each wake-up's outputs",
    )
    fleet.until(lambda: nanoseconds_of(clock[-1].clock) == 7 * WAKE_NS, "and the clock")
    repeated = len(clock) + 1
    fleet.until(lambda: len(clock) > repeated, "standing time is repeated")
    assert nanoseconds_of(clock[-1].clock) == 7 * WAKE_NS

    # Commands that a step waits for.
    assert fleet.set("drive_sim", await_commands=1)[0]
    refused(fleet.call("drive_sim/step"), "0 of 1 commands arrived in 1 s; no step was taken")
    fleet.command(50.0)
    assert step(fleet) == (12 * WAKE_NS, 5, 1)
    fleet.until(lambda: JointSample.of(joints[-1]).time == 12 * WAKE_NS, "the last")
    # 20 ms, of which the bus takes 2.
    assert JointSample.of(joints[-1]).spindle_speed == pytest.approx(40.0 * 0.018, rel=1e-9)
    assert fleet.set("drive_sim", await_commands=0)[0]

    # A snapshot, and the same again.
    done, text = fleet.call("drive_sim/save_snapshot")
    assert done, text
    futures = []
    for _ in range(2):
        assert step(fleet) == (17 * WAKE_NS, 5, 0), "the command was counted before"
        fleet.until(lambda: JointSample.of(joints[-1]).time == 17 * WAKE_NS, "the last")
        futures.append(JointSample.of(joints[-1]))
        assert fleet.call("drive_sim/restore_snapshot")[0]
    assert futures[0] == futures[1]
    other = tmp_path / "other.json"
    other.write_text("{}")
    assert fleet.set("drive_sim", snapshot=str(other))[0]
    refused(fleet.call("drive_sim/restore_snapshot"), f"snapshot {other}: is a JSON file, but no")

    # The watchdog: 20 ms of silence in 20 ms of simulated time.
    assert fleet.set("drive_sim", command_age_limit=0.01, command_silence="stop")[0]
    step(fleet)
    warned(fleet, "no command for 0.01 s: the spindle stops")
    assert fleet.value("drive_sim", "speed set by") == "watchdog"
    assert fleet.set("drive_sim", command_age_limit=0.0)[0]

    # Emergency stop, and two who command.
    assert fleet.call("drive_sim/emergency_stop")[0]
    warned(fleet, "emergency stop: commands are ignored")
    second = topics.COMMAND.publisher(fleet.node)
    fleet.until(second.get_subscription_count, "a second one may command")
    publishers = "2 publishers on /spindle/command: the drive follows the newest command"
    warned(fleet, publishers)
    fleet.reads("drive_sim", publishers)  # while the other warning continues
    fleet.node.destroy_publisher(second)
    unheard = "/mistaken publishes std_msgs/msg/Float32 on /spindle/command and is ignored"
    fleet.start_process("mistaken", sys.executable, Path(__file__).with_name("other_type.py"))
    warned(fleet, f"{unheard}: commands are std_msgs/msg/Float64")
    count = len(fleet.healths)
    fleet.until(lambda: len(fleet.healths) > count + 1, "it is looked at again")
    assert fleet.log("drive_sim").count(unheard) == 1, "said once"
    assert fleet.stop("mistaken") == 0
    fleet.until(
        lambda: (h := fleet.health("drive_sim")) and unheard not in h.message, "no warning any more"
    )
    fleet.command(50.0)
    fleet.until(lambda: fleet.value("drive_sim", "commands ignored") == "1", "it is ignored")
    assert fleet.call("drive_sim/reset_emergency_stop")[0]
    refused(fleet.call("drive_sim/reset_emergency_stop"), "there is no emergency stop")
    reached = step(fleet).sim_time_ns
    fleet.until(lambda: JointSample.of(joints[-1]).time == reached, "the last")
    assert JointSample.of(joints[-1]).spindle_speed == 0.0

    # Another disc, another scene.
    # As `ros2 param load` of the node's own dump does.
    assert fleet.set("drive_sim", disc_eccentricity=-1.0, disc_angle=0.0)[0]
    refused(fleet.call("drive_sim/load_disc"), "disc_eccentricity was never set: set it first")
    assert fleet.set("drive_sim", disc_eccentricity=2e-4, disc_angle=1.0)[0]
    assert fleet.call("drive_sim/load_disc")[0]
    fleet.until(lambda: description_of(described[-1])["eccentricity"] == 2e-4, "described")
    reached += 5 * WAKE_NS
    assert step(fleet).sim_time_ns == reached, "time has gone on"
    assert fleet.call("drive_sim/reset_time")[0]
    assert step(fleet).sim_time_ns == 5 * WAKE_NS
    assert fleet.call("drive_sim/reset_state")[0]
    assert step(fleet).sim_time_ns == 10 * WAKE_NS
    assert fleet.set("drive_sim", scene="nsc-case-1")[0]
    assert fleet.call("drive_sim/load_scene")[0]
    fleet.until(lambda: description_of(described[-1])["scene"]["name"] == "nsc-case-1", "described")
    assert step(fleet).sim_time_ns == 5 * WAKE_NS

    # No step is granted for a command that a reset has forgotten.
    accepted = int(fleet.value("drive_sim", "commands accepted"))
    fleet.command(20.0)
    fleet.until(
        lambda: int(fleet.value("drive_sim", "commands accepted")) > accepted, "it is heard"
    )
    assert fleet.set("drive_sim", await_commands=1)[0]
    assert fleet.call("drive_sim/reset")[0]
    refused(fleet.call("drive_sim/step"), "0 of 1 commands arrived in 1 s; no step was taken")
    assert not fleet.value("drive_sim", "command to output, worst [s]"), "how long they waited"
    assert fleet.stop("drive_sim") == 0
    assert "Traceback" not in fleet.log("drive_sim")


def driven(fleet: Fleet, node: str) -> list[bytes]:
    """What a drive in lock-step makes of a few commands."""
    blocks: list[Any] = []
    listening = topics.BLOCK.subscription(fleet.node, blocks.append)
    fleet.start("drive_sim", scene="thesis-hold", time_mode="lock_step", command_jitter=0.01)
    fleet.until(lambda: fleet.health("drive_sim"), "it is up")
    assert fleet.set("drive_sim", steps=9, await_commands=1)[0]
    for speed in (10.0, 200.0, -30.0, 40.0):
        fleet.command(speed)
        assert step(fleet).commands == 1, "those of this step"
    fleet.until(lambda: sum(len(Block.of(m).samples) for m in blocks) == 145, "all samples")
    assert fleet.stop("drive_sim") == 0
    fleet.node.destroy_subscription(listening)
    return [Block.of(message).samples.tobytes() for message in blocks]


def test_lock_step_runs_are_the_same_to_the_bit(fleet: Fleet) -> None:
    assert driven(fleet, "first") == driven(fleet, "second")


def test_pace_changes_while_it_runs(fleet: Fleet) -> None:
    clock, blocks = fleet.listen(topics.CLOCK), fleet.listen(topics.BLOCK)
    fleet.start("drive_sim", scene="thesis-hold", lateness_tolerance=60.0, factor_tolerance=1.0)
    fleet.until(lambda: fleet.value("drive_sim", "lateness, p99.9 [s]"), "it runs")
    for settings, said in (
        ({"speed_factor": 3.0}, "running at 3 times real time"),
        ({"speed_factor": 0.05}, "running at 0.05 times real time"),
        ({"time_mode": "free"}, "running as fast as possible"),
    ):
        assert fleet.set("drive_sim", **settings)[0]
        fleet.until(
            lambda said=said: (h := fleet.health("drive_sim")) and h.message.startswith(said), said
        )
    assert fleet.call("drive_sim/pause", True)[0], "it is heard among so much work"
    assert fleet.set("drive_sim", time_mode="paced", speed_factor=1.0, error_checks=0.0)[0]
    assert fleet.call("drive_sim/pause", False)[0]
    fleet.healths.clear()
    health, *_ = fleet.until(
        lambda: [
            health
            for health in fleet.healths_of("drive_sim")
            if health.message.startswith("running in real time")
        ],
        "real time again",
    )
    assert "steps checked" not in health.values
    for stage in ("inputs", "integration", "observing", "publishing"):
        mean, longest = (float(health.values[f"{stage}, {w} [s]"]) for w in ("mean", "longest"))
        assert 0 < mean <= longest
    assert fleet.stop("drive_sim") == 0
    times = np.array([nanoseconds_of(message.clock) for message in clock])
    assert np.all(np.diff(times) >= 0)
    steps = np.concatenate([Block.of(message).samples[:, 0] for message in blocks])
    assert np.all(np.diff(steps) == 1), "no sample is missing"


def test_requests_lose_no_time(fleet: Fleet, tmp_path: Path) -> None:
    """By the clock of who listens: what is neither simulated nor counted as dropped."""
    came: list[tuple[float, int]] = []
    topics.JOINT_STATES.subscription(
        fleet.node, lambda m: came.append((time.monotonic(), JointSample.of(m).time))
    )
    fleet.start("drive_sim", scene="thesis-hold", snapshot=tmp_path / "kept.json")
    save = fleet.node.create_client(Trigger, "drive_sim/save_snapshot")
    fleet.until(save.service_is_ready, "the service")

    def lag() -> float:
        came.clear()
        reports = len(fleet.healths)
        fleet.until(lambda: len(fleet.healths) > reports + 1, "reports")
        dropped = int(fleet.value("drive_sim", "steps dropped")) * 1e-3
        return min(at - 1e-9 * simulated for at, simulated in came) - dropped

    before = min(lag() for _ in range(3))
    for _ in range(200):
        saved = save.call_async(trigger_request())
        fleet.until(saved.done, "it is saved")
        assert answer_of(saved.result())[0]
    # A busy machine may be late for a while; what is lost stays lost.
    fleet.until(lambda: lag() < before + 0.03, "nothing is lost; 0.7 ms each were once")
    assert fleet.stop("drive_sim") == 0


def test_an_emergency_stop_waits_for_no_other_request(fleet: Fleet) -> None:
    """Asked while 10,000 wake-ups are being taken for another request."""
    joints = fleet.listen(topics.JOINT_STATES)
    fleet.start("drive_sim", scene="thesis-hold", time_mode="lock_step", steps=10_000)
    stop = fleet.node.create_client(Trigger, "drive_sim/emergency_stop")
    fleet.until(stop.service_is_ready, "the service")
    steps = fleet.node.create_client(Trigger, "drive_sim/step")
    fleet.until(steps.service_is_ready, "the other service")
    fleet.command(400.0)
    fleet.until(lambda: fleet.value("drive_sim", "commands accepted") == "1", "a command")
    stepping = steps.call_async(trigger_request())
    fleet.until(lambda: joints and JointSample.of(joints[-1]).spindle_speed > 0.0, "it runs up")
    stopping = stop.call_async(trigger_request())
    fleet.until(stopping.done, "it is answered")
    assert not stepping.done(), "before the other"
    fleet.until(lambda: JointSample.of(joints[-1]).spindle_speed == 0.0, "it stands")
    assert fleet.stop("drive_sim") == 0


def test_without_a_clock(fleet: Fleet) -> None:
    clock, joints = fleet.listen(topics.CLOCK), fleet.listen(topics.JOINT_STATES)
    fleet.start("drive_sim", scene="thesis-hold", publish_clock=False)
    fleet.until(lambda: len(joints) > 20, "it runs")
    fleet.command(20.0)
    fleet.until(lambda: fleet.value("drive_sim", "command to output, p99 [s]"), "delays")
    assert float(fleet.value("drive_sim", "command to output, worst [s]")) > 0
    assert not clock and not fleet.node.count_publishers("/clock")
    assert fleet.stop("drive_sim") == 0
