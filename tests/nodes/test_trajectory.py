"""Speeds that carry their time, from a real publisher to a real drive."""

from collections.abc import Iterator
from pathlib import Path

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


def send(session: Fleet, start: int, *points: tuple[float, float]) -> None:
    made = tuple(SetPoint(round(time * SECOND), value) for time, value in points)
    session.publish(topics.TRAJECTORY, topics.TRAJECTORY.message(SetPoints(start, made)))


def answered(session: Fleet, start: int) -> str:
    """Wait for the answer to a trajectory; return it."""
    session.until(
        lambda: session.value(DRIVE, topics.TRAJECTORY_START) == str(start), "it is answered"
    )
    return session.value(DRIVE, topics.TRAJECTORY_ANSWER)


def samples_until(session: Fleet, speed_held: float) -> dict[str, np.ndarray]:
    """Let time go on until a speed is held; return the columns of all samples from t = 0 on."""
    session.heard["vibration/block"].clear()
    assert session.call(f"{DRIVE}/pause", False)[0]
    session.until(lambda: speed(session) == speed_held, f"{speed_held} rad/s")
    assert session.call(f"{DRIVE}/pause", True)[0]
    session.until(lambda: session.value(DRIVE, "time") and _last(session), "the last block")
    blocks = [topics.BLOCK.sample(message) for message in session.heard["vibration/block"]]
    rows = np.concatenate([block.samples for block in blocks])
    assert (np.diff(rows[:, 0]) == 1.0).all(), "every step"
    return dict(zip(blocks[0].channels, rows.T, strict=True))


def _last(session: Fleet) -> bool:
    """Whether the blocks have come as far as the joint states."""
    if not session.heard["vibration/block"]:
        return False
    block = topics.BLOCK.sample(session.heard["vibration/block"][-1])
    return bool(block.samples[-1, 3] == speed(session))


def test_speeds_are_reached_at_their_times(session: Fleet) -> None:
    """However late the machine is: 0 to 20 rad/s from 0.25 s to 0.75 s, and down to 5 by 1.25 s."""
    send(session, SECOND // 4, (0.0, 0.0), (0.5, 20.0), (1.0, 5.0))
    assert answered(session, SECOND // 4) == topics.FOLLOWED
    run = samples_until(session, 5.0)
    wanted = np.interp(run["time"], [0.25, 0.75, 1.25], [0.0, 20.0, 5.0])
    np.testing.assert_allclose(run["speed"], wanted, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(run["command"], run["speed"])


def test_what_is_refused_changes_nothing(session: Fleet) -> None:
    send(session, 0, (0.0, 0.0), (0.5, 10.0))
    assert answered(session, 0) == topics.FOLLOWED
    run = samples_until(session, 10.0)
    assert run["speed"].max() == 10.0
    other = topics.TRAJECTORY.message(SetPoints(5 * SECOND, (SetPoint(0, 1.0),)))
    other.joint_names = ["arm"]
    session.publish(topics.TRAJECTORY, other)
    assert "joint_names = ['arm']: must be ['spindle']" in answered(session, 5 * SECOND)
    for number, (points, reason) in enumerate(
        (
            (((0.0, np.nan),), "points[0].velocities[0] = nan"),
            (((0.0, 1e4),), "points[0].velocities[0] = 10000"),
            (((1.0, 10.0), (0.5, 20.0)), "points[1].time_from_start = 0.5 s"),
            (((0.0, 10.0), (0.1, 20.0)), "takes 100 rad/s^2"),
        )
    ):
        send(session, 100 * SECOND + number, *points)
        assert reason in answered(session, 100 * SECOND + number)
    send(session, 1, (0.0, 10.0))
    assert answered(session, 1).startswith(topics.PAST)
    assert session.value(DRIVE, "led by") == "trajectory"
    log = session.log(DRIVE)
    for words in ("joint_names = ['arm']", "velocities[0] = nan", "takes 100 rad/s^2"):
        assert log.count(words) == 1, "one warning"
    assert session.call(f"{DRIVE}/pause", False)[0]
    before = len(session.heard["joint_states"])
    session.until(lambda: len(session.heard["joint_states"]) > before + 50, "time goes on")
    assert speed(session) == 10.0


def test_the_message_that_came_last_leads(session: Fleet) -> None:
    send(session, 0, (0.0, 0.0), (2.0, 80.0))
    assert answered(session, 0) == topics.FOLLOWED
    assert session.call(f"{DRIVE}/pause", False)[0]
    session.until(lambda: speed(session) > 5.0, "it follows")
    session.command(3.0)
    session.until(lambda: speed(session) == 3.0, "the speed leads")
    session.until(lambda: session.value(DRIVE, "led by") == "commands", "and it says so")
    send(session, 0, (0.5, 6.0))
    session.until(lambda: speed(session) == 6.0, "the trajectory leads again")
    assert "1" == session.value(DRIVE, "sources of commands"), "one node, two topics"


def test_in_lock_step_it_stands_for_the_commands(session: Fleet) -> None:
    """Until its last point no step waits for a command; then one has to come again."""
    assert session.set(DRIVE, time_mode="lock_step", await_commands=1, steps=10)[0]
    try:
        send(session, 0, (0.0, 0.0), (0.1, 4.0))
        assert answered(session, 0) == topics.FOLLOWED
        for wakes in range(10, 31, 10):
            done, text = session.call(f"{DRIVE}/step")
            assert done and f'"sim_time_ns": {wakes * 4_000_000}' in text
        done, text = session.call(f"{DRIVE}/step")
        assert not done and "0 of 1 commands came" in text
    finally:
        assert session.set(DRIVE, time_mode="paced", await_commands=0)[0]


def test_a_profile_that_comes_too_late_begins_later(session: Fleet, tmp_path: Path) -> None:
    """Without time to travel, it is past when it arrives: the controller sends it again."""
    profile = tmp_path / "ten.yaml"
    profile.write_text("{kind: segments, segments: [{to: 10, acceleration: 50}]}")
    assert session.call(f"{DRIVE}/pause", False)[0]
    statuses = session.listen(topics.PROFILE_STATUS)
    session.start(CONTROLLER, profile=profile, use_sim_time=True, lead_time=0.0)
    session.until(lambda: session.call(f"{CONTROLLER}/start")[0], "it starts")
    session.until(lambda: statuses and text_of(statuses[-1]) == "done", "it is done")
    session.until(lambda: speed(session) == 10.0, "and the drive is there")
    session.reads(CONTROLLER, "the drive had the trajectory too late")
    assert session.stop(CONTROLLER) == 0
