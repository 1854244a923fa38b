"""Speeds that carry their time, from a real publisher to a real drive."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ab_msgs_py import JointSample, topics
from ab_msgs_py.samples import text_of
from ab_msgs_py.set_points import SetPoint, SetPoints
from tests.domains import own_domain
from tests.nodes.fleet import Fleet

pytestmark = pytest.mark.ros

SECOND = 10**9
DRIVE, CONTROLLER = "drive_sim", "profile_controller"


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Fleet]:
    """A drive that stands still until it is resumed."""
    with own_domain() as domain:
        fleet = Fleet(domain, tmp_path_factory.mktemp("trajectory"))
        fleet.start(DRIVE, scene="thesis-hold", start_paused=True)
        fleet.listen(topics.JOINT_STATES)
        fleet.listen(topics.BLOCK)
        yield fleet
        fleet.close()


@pytest.fixture(autouse=True)
def at_start(session: Fleet) -> None:
    """Each test begins at t = 0, paused."""
    session.until(lambda: session.health(DRIVE), "the drive is there")
    assert session.call(f"{DRIVE}/pause", True)[0]
    assert session.call(f"{DRIVE}/reset")[0]
    session.until(lambda: speed(session) == 0.0, "it stands")


def speed(session: Fleet) -> float:
    heard = session.heard["joint_states"]
    return JointSample.of(heard[-1]).spindle_speed if heard else np.nan


def trajectory(start: int, *points: tuple[float, float]) -> Any:
    """Return a message of speeds [rad/s] at times [s] after a start [ns]."""
    made = tuple(SetPoint(round(time * SECOND), value) for time, value in points)
    return topics.TRAJECTORY.message(SetPoints(start, made))


def answer_to(session: Fleet, start: int, *points: tuple[float, float], joint: str = "") -> str:
    """Send a trajectory; return the drive's answer."""
    message, before = trajectory(start, *points), judged(session)
    message.joint_names = [joint] if joint else message.joint_names
    session.publish(topics.TRAJECTORY, message)
    # An earlier one may have had the same start.
    session.until(
        lambda: (
            judged(session) > before and session.value(DRIVE, topics.TRAJECTORY_START) == str(start)
        ),
        "it is answered",
    )
    return session.value(DRIVE, topics.TRAJECTORY_ANSWER)


def judged(session: Fleet) -> int:
    """Return the number of commands and trajectories that the drive has accepted or rejected."""
    return sum(int(session.value(DRIVE, f"commands {what}")) for what in ("accepted", "rejected"))


def samples_until(session: Fleet, speed_held: float) -> dict[str, np.ndarray]:
    """Let time go on until a speed is held; return the columns of all samples from t = 0 on."""
    session.heard["vibration/block"].clear()
    assert session.call(f"{DRIVE}/pause", False)[0]
    session.until(lambda: speed(session) == speed_held, f"{speed_held} rad/s")
    # Before the pause, which may come between two blocks.
    blocks = session.heard["vibration/block"]
    session.until(
        lambda: blocks and samples_in(blocks[-1])["speed"][-1] == speed_held,
        "a block with that speed",
    )
    assert session.call(f"{DRIVE}/pause", True)[0]
    run = [samples_in(block) for block in blocks]
    columns = {name: np.concatenate([part[name] for part in run]) for name in run[0]}
    assert (np.diff(columns["step"]) == 1.0).all(), "every step"
    return columns


def samples_in(message: Any) -> dict[str, np.ndarray]:
    """Return the samples of a block by channel."""
    block = topics.BLOCK.sample(message)
    return dict(zip(block.channels, block.samples.T, strict=True))


def test_speeds_are_reached_at_their_times(session: Fleet) -> None:
    """However late the machine is: 0 to 20 rad/s from 0.25 s to 0.75 s, and down to 5 by 1.25 s."""
    points = (0.0, 0.0), (0.5, 20.0), (1.0, 5.0)
    assert answer_to(session, SECOND // 4, *points) == topics.FOLLOWED
    run = samples_until(session, 5.0)
    wanted = np.interp(run["time"], [0.25, 0.75, 1.25], [0.0, 20.0, 5.0])
    np.testing.assert_allclose(run["speed"], wanted, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(run["command"], run["speed"])


def test_what_is_refused_changes_nothing(session: Fleet) -> None:
    assert answer_to(session, 0, (0.0, 0.0), (0.5, 10.0)) == topics.FOLLOWED
    run = samples_until(session, 10.0)
    assert run["speed"].max() == 10.0
    refusal = answer_to(session, 5 * SECOND, (0.0, 1.0), joint="arm")
    assert "joint_names = ['arm']: must be ['spindle']" in refusal
    for number, (points, reason) in enumerate(
        (
            (((0.0, np.nan),), "points[0].velocities[0] = nan"),
            (((0.0, 1e4),), "points[0].velocities[0] = 10000"),
            (((1.0, 10.0), (0.5, 20.0)), "points[1].time_from_start = 0.5 s"),
            (((0.0, 10.0), (0.1, 20.0)), "takes 100 rad/s^2"),
        )
    ):
        assert reason in answer_to(session, 100 * SECOND + number, *points)
    assert answer_to(session, 1, (0.0, 10.0)).startswith(topics.PAST)
    assert session.value(DRIVE, "speed set by") == "trajectory"
    log = session.log(DRIVE)
    for words in ("joint_names = ['arm']", "velocities[0] = nan", "takes 100 rad/s^2"):
        assert log.count(words) == 1, "one warning"
    assert session.call(f"{DRIVE}/pause", False)[0]
    before = len(session.heard["joint_states"])
    session.until(lambda: len(session.heard["joint_states"]) > before + 50, "time goes on")
    assert speed(session) == 10.0


def test_the_message_that_came_last_leads(session: Fleet) -> None:
    assert answer_to(session, 0, (0.0, 0.0), (2.0, 80.0)) == topics.FOLLOWED
    assert session.call(f"{DRIVE}/pause", False)[0]
    session.until(lambda: speed(session) > 5.0, "it follows")
    session.command(3.0)
    session.until(lambda: speed(session) == 3.0, "the speed leads")
    session.until(lambda: session.value(DRIVE, "speed set by") == "commands", "and it says so")
    session.publish(topics.TRAJECTORY, trajectory(0, (0.5, 6.0)))
    session.until(lambda: speed(session) == 6.0, "the trajectory leads again")
    assert "1" == session.value(DRIVE, "sources of commands"), "one node, two topics"


def test_in_lock_step_it_stands_for_the_commands(session: Fleet) -> None:
    """Until its last point no step waits for a command; then one has to come again."""
    assert session.set(DRIVE, time_mode="lock_step", await_commands=1, steps=10)[0]
    try:
        assert answer_to(session, 0, (0.0, 0.0), (0.1, 4.0)) == topics.FOLLOWED
        for wakes in range(10, 31, 10):
            done, text = session.call(f"{DRIVE}/step")
            assert done and f'"sim_time_ns": {wakes * 4_000_000}' in text
        done, text = session.call(f"{DRIVE}/step")
        assert not done and "0 of 1 commands arrived" in text
    finally:
        assert session.set(DRIVE, time_mode="paced", await_commands=0)[0]


def test_a_profile_that_comes_too_late_begins_later(session: Fleet, tmp_path: Path) -> None:
    """With less time to travel than the bus takes, it is past: the controller sends it again."""
    profile = tmp_path / "ten.yaml"
    profile.write_text("{kind: segments, segments: [{to: 10, acceleration: 50}]}")
    assert session.set(DRIVE, command_delay=0.05)[0]
    assert session.call(f"{DRIVE}/pause", False)[0]
    statuses = session.listen(topics.PROFILE_STATUS)
    session.start(CONTROLLER, profile=profile, use_sim_time=True, lead_time=0.0)
    session.until(lambda: session.call(f"{CONTROLLER}/start")[0], "it starts")
    session.until(lambda: statuses and text_of(statuses[-1]) == "done", "it is done")
    session.until(lambda: speed(session) == 10.0, "and the drive is there")
    session.reads(CONTROLLER, "the trajectory reached the drive too late")
    assert session.stop(CONTROLLER) == 0
    assert session.set(DRIVE, command_delay=0.0)[0]
