"""`drive_sim` as a process over real DDS: time, commands, services, trouble."""

import math
import re
import signal
import time
from typing import Any

import numpy as np
import pytest

from ab_msgs_py import ENDED, Block, JointSample, Level, VibrationSample, topics
from ab_msgs_py.samples import description_of, nanoseconds_of
from ab_msgs_py.services import Stepped
from tests.nodes.fleet import Fleet

pytestmark = pytest.mark.ros

DROPPED = re.compile(r"(\d+) steps were dropped.*")
STEP_NS = 1_000_000
WAKE_NS = 4 * STEP_NS


def rows(blocks: list[Any]) -> np.ndarray:
    return np.concatenate([Block.of(message).samples for message in blocks])


def test_time_is_the_simulators(fleet: Fleet) -> None:
    """Clock and stamps count steps, never go back, and stand still while paused."""
    clock, joints = fleet.listen(topics.CLOCK), fleet.listen(topics.JOINT_STATES)
    blocks = fleet.listen(topics.BLOCK)
    fleet.start("drive_sim", scene="thesis-hold")
    fleet.until(lambda: len(joints) > 100, "100 joint states")
    assert fleet.call("drive_sim/step") == (False, "not paused: pause first")
    assert fleet.call("drive_sim/pause", True)[0]
    reached = []
    for _ in range(3):
        done, text = fleet.call("drive_sim/step")
        assert done, text
        reached.append(Stepped.of(text).sim_time_ns)
        fleet.until(
            lambda: clock and nanoseconds_of(clock[-1].clock) == reached[-1],
            "the clock goes on as told",
        )
    assert np.all(np.diff(reached) == WAKE_NS), "one wake-up's steps each"
    assert fleet.call("drive_sim/pause", False)[0]
    goal = reached[-1] + 500 * STEP_NS
    fleet.until(lambda: clock and nanoseconds_of(clock[-1].clock) > goal, "it runs again")
    assert fleet.stop("drive_sim") == 0

    times = np.array([nanoseconds_of(message.clock) for message in clock])
    assert np.all(np.diff(times) >= 0), "never back; what stands is repeated for late listeners"
    assert np.all(np.diff([JointSample.of(message).time for message in joints]) > 0)
    assert np.all(times % STEP_NS == 0), "whole steps"
    assert all(JointSample.of(message).time % STEP_NS == 0 for message in joints)
    steps = rows(blocks)[:, 0]
    assert np.all(np.diff(steps) == 1), "every integration sample is in a block"


def test_runs_in_real_time(fleet: Fleet) -> None:
    """Simulated time goes as far as the wall clock, but for what was dropped and reported."""
    joints: list[tuple[float, int]] = []
    topics.JOINT_STATES.subscription(
        fleet.node, lambda m: joints.append((time.monotonic(), JointSample.of(m).time))
    )
    fleet.start("drive_sim", scene="thesis-hold", wake_rate=250)
    # The start is published before services are offered, and time goes on after that.
    fleet.until(lambda: joints and joints[-1][1] > 0, "time goes on")
    first = len(joints) - 1
    fleet.until(lambda: joints[-1][0] > joints[first][0] + 3.0, "three seconds")
    # The least over half a second: of how late a busy machine has this listener hear.
    early, late = (
        min(at - 1e-9 * simulated for at, simulated in heard)
        for heard in (joints[first : first + 125], joints[-125:])
    )
    assert fleet.stop("drive_sim") == 0
    health = fleet.health("drive_sim")
    assert health is not None and health.message == ENDED
    slack = 0.1 + float(health.values["worst lateness [s]"])
    assert late - early == pytest.approx(1e-3 * int(health.values["steps dropped"]), abs=slack)
    assert health.values["effects"].split(", ") == [
        "ball_spin", "rolling_friction", "spindle_acceleration", "suspension", "viscous_drag",
    ]  # fmt: skip
    assert health.values["step [s]"] == "0.001"


def test_it_publishes_less_for_a_slow_link(fleet: Fleet) -> None:
    """The state is published at every fifth wake-up of 5 ms; time and blocks are as before."""
    heard = [fleet.listen(topic) for topic in (topics.JOINT_STATES, topics.VIBRATION)]
    clock = fleet.listen(topics.CLOCK)
    fleet.start(
        "drive_sim", scene="thesis-hold", time_mode="lock_step", wake_rate=200.0, publish_rate=40.0,
        steps=50,
    )  # fmt: skip
    assert fleet.call("drive_sim/step")[0]
    fleet.until(lambda: all(len(each) >= 10 for each in heard), "ten of each")
    for each in heard:
        assert [message.header.stamp.nanosec for message in each[-10:]] == [
            25_000_000 * k for k in range(1, 11)
        ]
    ticks = {topics.CLOCK.sample(message) for message in clock}
    assert any(tick % 25_000_000 for tick in ticks), "time comes at each wake-up"


def test_commands_are_judged_while_paused(fleet: Fleet) -> None:
    """Each is counted; of those between two wake-ups the last good one acts."""
    joints = fleet.listen(topics.JOINT_STATES)
    fleet.start("drive_sim", scene="thesis-hold", start_paused=True)
    fleet.command(*[math.nan] * 100, *range(50), 10.0, math.inf)
    fleet.until(lambda: fleet.value("drive_sim", "commands rejected") == "101", "101 rejections")
    assert fleet.value("drive_sim", "commands accepted") == "51"
    assert fleet.call("drive_sim/pause", False)[0]
    fleet.until(lambda: joints and JointSample.of(joints[-1]).time > 10**9, "a second goes by")
    assert JointSample.of(joints[-1]).spindle_speed == 10.0


def test_bad_commands_are_rejected_counted_logged_and_change_nothing(fleet: Fleet) -> None:
    joints, blocks = fleet.listen(topics.JOINT_STATES), fleet.listen(topics.BLOCK)
    fleet.start("drive_sim", scene="thesis-hold")
    fleet.command(20.0)
    fleet.until(
        lambda: joints and JointSample.of(joints[-1]).spindle_speed == 20.0, "20 rad/s are reached"
    )
    fleet.command(math.nan, math.inf, -math.inf, 420.5, -1e300)
    fleet.until(lambda: fleet.value("drive_sim", "commands rejected") == "5", "five rejections")
    assert fleet.value("drive_sim", "commands accepted") == "1"
    fleet.command(math.nan)
    fleet.until(
        lambda: "command = nan rad/s: must be a finite number" in fleet.log("drive_sim"), "the log"
    )
    fleet.command(420.0)
    fleet.until(
        lambda: joints and JointSample.of(joints[-1]).spindle_speed > 20.0,
        "a good command is followed",
    )
    at = Block.of(blocks[0]).channels.index("command")
    fleet.until(lambda: 420.0 in rows(blocks)[:, at], "a block with the good command")
    assert fleet.stop("drive_sim") == 0
    commands = rows(blocks)[:, at]
    assert set(commands.tolist()) == {0.0, 20.0, 420.0}, "no trace of the bad ones"


def test_reset_begins_again(fleet: Fleet) -> None:
    joints, blocks = fleet.listen(topics.JOINT_STATES), fleet.listen(topics.BLOCK)
    fleet.start("drive_sim", scene="thesis-hold", start_paused=True)
    fleet.command(50.0)
    assert fleet.call("drive_sim/pause", False)[0]
    fleet.until(lambda: joints and JointSample.of(joints[-1]).spindle_speed == 50.0, "50 rad/s")
    assert fleet.call("drive_sim/pause", True)[0]
    assert fleet.call("drive_sim/reset")[0]
    assert fleet.call("drive_sim/step")[0]
    fleet.until(lambda: joints and JointSample.of(joints[-1]).time == WAKE_NS, "time begins again")
    assert JointSample.of(joints[-1]).spindle_speed == 0.0, "the command is forgotten"
    fleet.until(lambda: np.any(np.diff(rows(blocks)[:, 0]) < 0), "a block begins again")
    assert fleet.stop("drive_sim") == 0
    steps = rows(blocks)[:, 0]
    (again,) = np.flatnonzero(np.diff(steps) < 0)
    assert steps[again + 1] == 0, "samples begin again at step 0"
    assert np.all(np.diff(steps[: again + 1]) == 1) and np.all(np.diff(steps[again + 1 :]) == 1)


def lose_a_second(fleet: Fleet, clock: list[Any]) -> None:
    """Start a drive that soon gives up what it is late with, and stop its process for a second."""
    process = fleet.start("drive_sim", scene="thesis-hold", patience=0.1)
    fleet.until(lambda: len(clock) > 50, "it runs")
    process.send_signal(signal.SIGSTOP)
    try:
        resume = time.monotonic() + 1.0
        fleet.until(lambda: time.monotonic() > resume, "a second goes by")
    finally:
        process.send_signal(signal.SIGCONT)


def test_far_behind_drops_steps_and_says_so(fleet: Fleet) -> None:
    clock, blocks = fleet.listen(topics.CLOCK), fleet.listen(topics.BLOCK)
    lose_a_second(fleet, clock)
    # A busy machine may have cost some steps before.
    health, *_ = fleet.until(
        lambda: [
            health
            for health in fleet.healths_of("drive_sim")
            if "steps were dropped" in health.message
            and float(health.values["worst lateness [s]"]) > 0.5
        ],
        "a warning",
    )
    assert health.level is Level.WARN
    assert int(health.values["steps dropped"]) > 100
    assert fleet.stop("drive_sim") == 0
    assert np.all(np.diff(rows(blocks)[:, 0]) == 1), "steps are given up, samples are not lost"


def test_a_pause_erases_no_lost_time(fleet: Fleet) -> None:
    clock = fleet.listen(topics.CLOCK)
    lose_a_second(fleet, clock)
    assert fleet.call("drive_sim/pause", True)[0]
    fleet.until(
        lambda: (h := fleet.health("drive_sim")) and h.message.startswith("paused"), "it says so"
    )
    assert int(fleet.value("drive_sim", "steps dropped")) > 500
    assert float(fleet.value("drive_sim", "worst lateness [s]")) > 0.5
    # A pause of its own may cost some steps more, of which nobody is late.
    said = {int(found[1]): found[0] for found in map(DROPPED.search, messages(fleet)) if found}
    assert max(said) > 500 and "late" in said[max(said)]
    assert fleet.call("drive_sim/pause", False)[0]
    fleet.until(lambda: fleet.value("drive_sim", "real-time factor"), "it runs again")
    assert int(fleet.value("drive_sim", "steps dropped")) > 500, "over the node's life"
    assert fleet.stop("drive_sim") == 0


def messages(fleet: Fleet) -> list[str]:
    return [health.message for health in fleet.healths]


def test_divergence_pauses_and_is_reported(fleet: Fleet) -> None:
    clock, blocks = fleet.listen(topics.CLOCK), fleet.listen(topics.BLOCK)
    fleet.start(
        "drive_sim",
        scene="thesis-baseline",
        changes="['rotor.eccentricity=1', 'race.radius=0.002', 'effects.rolling_friction=', "
        "'spindle.max_acceleration=1000', 'effects.suspension.stiffness=100']",
    )
    fleet.command(400.0)
    fleet.until(
        lambda: (h := fleet.health("drive_sim")) is not None and h.level is Level.ERROR,
        "an error in the diagnostics",
    )
    health = fleet.health("drive_sim")
    assert health is not None and "went beyond all bounds at t = " in health.message
    assert np.all(np.diff([nanoseconds_of(message.clock) for message in clock]) >= 0)
    assert np.all(np.diff(rows(blocks)[:, 0]) == 1)
    done, text = fleet.call("drive_sim/pause", False)
    assert not done and "reset first" in text
    assert fleet.call("drive_sim/reset")[0]
    assert fleet.stop("drive_sim") == 0


def test_description_is_latched(fleet: Fleet) -> None:
    fleet.start("drive_sim", scene="nsc-case-1")
    fleet.until(lambda: fleet.health("drive_sim"), "it is up")
    described = fleet.listen(topics.DESCRIPTION)
    fleet.until(lambda: described, "a late listener hears it")
    description = description_of(described[0])
    assert description["scene"]["name"] == "nsc-case-1"
    assert description["race_radius"] == 0.0165


def test_motor_and_sensors_are_published(fleet: Fleet) -> None:
    joints, blocks = fleet.listen(topics.JOINT_STATES), fleet.listen(topics.BLOCK)
    vibration = fleet.listen(topics.VIBRATION)
    changes = "['sensors.front={}', 'sensors.side.axis_angle=1.5']"
    fleet.start("drive_sim", scene="weak-motor", changes=changes)
    fleet.command(100.0)
    fleet.until(lambda: joints and JointSample.of(joints[-1]).spindle_speed > 62.0, "62 rad/s")
    assert fleet.call("drive_sim/reset")[0]
    fleet.until(lambda: np.any(np.diff(rows(blocks)[:, 0]) < 0), "it begins again")
    assert fleet.stop("drive_sim") == 0
    torques = [JointSample.of(message).spindle_torque for message in joints]
    assert all(torque is not None for torque in torques)
    assert max(filter(None, torques)) == pytest.approx(4.4e-4, rel=0.01), "all that it can give"
    channels, samples = Block.of(blocks[0]).channels, rows(blocks)
    (again,) = 1 + np.flatnonzero(np.diff(samples[:, 0]) < 0)
    assert (samples[again, 0], samples[again, channels.index("speed")]) == (0.0, 60.0)
    assert channels[-5:] == ("motor_torque", "front_1", "front_2", "side_1", "side_2")
    shown = [VibrationSample.of(message) for message in vibration]
    assert {sample.frame for sample in shown} == {"front", "side"}
    for name, first in (("front", -4), ("side", -2)):
        readings = {tuple(reading) for reading in samples[:, [first, first + 1]].tolist()}
        assert {sample.linear[:2] for sample in shown if sample.frame == name} <= readings
    assert all(sample.linear[2] == 0.0 for sample in shown), "in the plane"
    health = fleet.health("drive_sim")
    assert health is not None
    assert health.values["sensors"] == "front, side"
    assert health.values["stepper chosen"] == "auto: stable at this step"
    assert health.values["steps with unresolved events"] == "0" and "events" in health.values
    fleet.reads("drive_sim", "rk8 at 0.001 s (auto: stable at this step)")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ends_cleanly_while_busy(fleet: Fleet, number: signal.Signals) -> None:
    clock = fleet.listen(topics.CLOCK)
    fleet.start("drive_sim", scene="thesis-hold", wake_rate=1000.0)
    fleet.until(lambda: len(clock) > 200, "it runs")
    assert fleet.stop("drive_sim", number) == 0
    assert "Traceback" not in fleet.log("drive_sim")


def test_parameters_are_described(fleet: Fleet) -> None:
    from rcl_interfaces.srv import DescribeParameters

    fleet.start("drive_sim", scene="thesis-hold")
    asked = DescribeParameters.Request(names=["wake_rate", "scene"])
    answer = fleet.ask(DescribeParameters, "drive_sim/describe_parameters", asked)
    rate, scene = answer.descriptors
    assert "[1/s]" in rate.description and rate.read_only
    assert (rate.floating_point_range[0].from_value, rate.floating_point_range[0].to_value) == (
        1.0,
        2000.0,
    )
    assert "scene" in scene.description
