"""Poses and velocities of a drive's bodies, and drives that were put elsewhere."""

import math

import numpy as np
import pytest

from ab_sim import Drive, load_scene
from ab_sim.base.errors import InputError, SceneError
from ab_sim.drive.bodies import BodyPose, BodyRates, body_names, motion_of, moved

PLANAR, IN_SPACE = "thesis-hold", "couple-unbalance"
STILL = BodyRates((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def running(scene: str) -> Drive:
    drive = Drive(load_scene(scene))
    drive.advance(300)
    return drive


@pytest.mark.parametrize("scene", [PLANAR, IN_SPACE])
def test_velocities_are_the_rates_of_poses(scene: str) -> None:
    drive = running(scene)
    step = drive.step
    before = {
        name: motion_of(name, drive.scene, drive.observe()) for name in body_names(drive.scene)
    }
    drive.advance(2)
    after = {name: motion_of(name, drive.scene, drive.observe()) for name in before}
    drive = running(scene)
    drive.advance(1)
    for name in before:
        between = motion_of(name, drive.scene, drive.observe())
        moved_by = np.subtract(after[name].pose.position, before[name].pose.position)
        speed = np.abs(between.velocity.linear).max()
        assert moved_by / (2 * step) == pytest.approx(between.velocity.linear, abs=2e-3 * speed)
        # The vector part of q' q* is half the angle, for small rotations.
        w, v = after[name].pose.turn[0], np.array(after[name].pose.turn[1:])
        w0, v0 = before[name].pose.turn[0], -np.array(before[name].pose.turn[1:])
        half = w * v0 + w0 * v + np.cross(v, v0)
        if w * w0 - v @ v0 < 0.0:
            half = -half
        angular = np.array(between.velocity.angular)
        assert half / step == pytest.approx(angular, abs=2e-3 * max(np.abs(angular).max(), 1e-3))


@pytest.mark.parametrize("scene", [PLANAR, IN_SPACE])
def test_a_body_put_where_it_is_changes_nothing(scene: str) -> None:
    drive = running(scene)
    for name in body_names(drive.scene):
        if name == "spindle":
            continue
        pose, velocity, _ = motion_of(name, drive.scene, drive.observe())
        kept, other = drive.snapshot(), moved(drive, name, pose, velocity)
        assert other.state == pytest.approx(kept.state, rel=1e-9, abs=1e-9)
        assert np.array_equal(other.discrete_state[:, 3], kept.discrete_state[:, 3]), "turns"


@pytest.mark.parametrize("scene", [PLANAR, IN_SPACE])
def test_a_deck_is_where_it_was_put(scene: str) -> None:
    drive = running(scene)
    tilted = scene == IN_SPACE
    z, turn = (1e-4, (math.cos(0.01), math.sin(0.01), 0.0, 0.0)) if tilted else (0.0, (1, 0, 0, 0))
    pose = BodyPose((2e-4, -1e-4, z), turn)
    velocity = BodyRates((0.01, -0.02, z), (0.0, 100 * z, 0.0))
    drive.restore(moved(drive, "deck", pose, velocity))
    found = motion_of("deck", drive.scene, drive.observe())
    assert found.pose.position == pytest.approx(pose.position, abs=1e-15)
    assert found.pose.turn == pytest.approx(pose.turn)
    assert found.velocity.linear == pytest.approx(velocity.linear)
    assert found.velocity.angular == pytest.approx(velocity.angular, abs=1e-15)
    drive.advance(100)
    assert drive.observe().whirl < 1e-2


@pytest.mark.parametrize("scene", [PLANAR, IN_SPACE])
def test_a_ball_is_put_elsewhere_on_its_race(scene: str) -> None:
    drive = running(scene)
    before = drive.observe()
    x, y, z = motion_of("ball_0", drive.scene, before).pose.position
    dx, dy, _ = motion_of("deck", drive.scene, before).pose.position
    a_quarter = BodyPose((dx - (y - dy), dy + (x - dx), z), (1.0, 0.0, 0.0, 0.0))
    drive.restore(moved(drive, "ball_0", a_quarter, None))
    after = drive.observe()
    # In space the deck is tilted by 1e-4 rad or so.
    assert after.theta[0] - before.theta[0] == pytest.approx(0.5 * math.pi, abs=1e-3)
    assert after.theta[1:] == pytest.approx(before.theta[1:])
    assert after.theta_rate == pytest.approx(before.theta_rate), "speeds stay"
    drive.restore(moved(drive, "ball_0", None, STILL))
    stopped = motion_of("ball_0", drive.scene, drive.observe()).velocity.linear
    assert math.hypot(*stopped) < 0.01 * drive.scene.race.radius * drive.observe().omega
    drive.advance(10)


@pytest.mark.parametrize(
    ("scene", "name", "pose", "velocity", "words"),
    [
        (PLANAR, "spindle", None, STILL, "spindle/command"),
        (PLANAR, "ball_0", BodyPose((0.02, 0.0, 0.0), (1, 0, 0, 0)), None, "off its race"),
        (PLANAR, "deck", BodyPose((0.0, 0.0, 0.1), (1, 0, 0, 0)), None, "z = 0.1"),
        (PLANAR, "deck", BodyPose((0.0, 0.0, 0.0), (0.6, 0.8, 0, 0)), None, "orientation"),
        (PLANAR, "deck", BodyPose((0.0, 0.0, 0.0), (0, 0, 0, 0)), None, "norm is 0"),
        (PLANAR, "deck", None, BodyRates((0, 0, 0), (0, 0, 1.0)), "angular velocity"),
        (PLANAR, "deck", BodyPose((math.nan, 0.0, 0.0), (1, 0, 0, 0)), None, "finite"),
        (PLANAR, "deck", BodyPose((1e7, 0.0, 0.0), (1, 0, 0, 0)), None, "u1"),
        ("packed-balls", "ball_0", None, STILL, "ball_contact"),
    ],
)  # fmt: skip
def test_an_impossible_state_is_refused(
    scene: str,
    name: str,
    pose: BodyPose | None,
    velocity: BodyRates | None,
    words: str,
) -> None:
    drive = Drive(load_scene(scene))
    kept = drive.snapshot()
    with pytest.raises((InputError, SceneError), match=words):
        moved(drive, name, pose, velocity)
    assert np.array_equal(drive.snapshot().state, kept.state), "nothing has changed"
