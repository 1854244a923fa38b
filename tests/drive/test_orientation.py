"""How a deck is turned: angles, axes, and what samples say of them."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ab_sim.drive import Drive
from ab_sim.drive.closed_forms import driving_forces
from ab_sim.drive.trajectory import Trajectory, matrix_of, tilt_of
from ab_sim.scene import load_scene
from tests.drive.tilted import TILTED


@pytest.fixture(scope="module")
def run() -> Trajectory:
    return Drive(load_scene("feeding-deck", TILTED)).advance(2000)


def turned(run: Trajectory) -> Rotation:
    return Rotation.from_quat(np.roll(run.turn, -1, axis=1))


def test_angles_are_kim_and_chungs() -> None:
    """Against SciPy: gamma about Z, alpha about the new x, beta about the last y."""
    angles = np.random.default_rng(0).uniform(-1.5, 1.5, (100, 3))
    turns = Rotation.from_euler("ZXY", angles[:, [2, 0, 1]])
    found = np.roll(turns.as_quat(), 1, axis=1)
    for scale in (1.0, -1.0, 3.0):
        np.testing.assert_allclose(tilt_of(scale * found), angles, atol=1e-14)
        np.testing.assert_allclose(matrix_of(scale * found), turns.as_matrix(), atol=1e-15)


def test_a_run_starts_as_the_scene_says() -> None:
    tilt = Drive(load_scene("feeding-deck", TILTED)).observe().tilt
    assert tilt == pytest.approx([0.1, -0.2, 0.3], abs=1e-15)


def test_angular_acceleration_is_on_inertial_axes(run: Trajectory) -> None:
    """It is the derivative of the angular velocity there, which is the turn's own."""
    time, rates = run["time"], run.angular_velocity
    change = (rates[2:] - rates[:-2]) / (time[2:] - time[:-2])[:, None]
    # Off by (w h)^2 / 6 of it, 8e-4 for motion at twice the spindle speed, 670 rad/s.
    size = np.abs(run.angular_acceleration).max()
    np.testing.assert_allclose(change, run.angular_acceleration[1:-1], atol=2e-3 * size)
    turn = turned(run)
    passed = (turn[2:] * turn[:-2].inv()).as_rotvec() / (time[2:] - time[:-2])[:, None]
    np.testing.assert_allclose(passed, rates[1:-1], atol=2e-3 * np.abs(rates).max())


def test_the_driving_force_is_that_of_the_race(run: Trajectory) -> None:
    """m psi'^2 W sin gamma, W being how far the centre of the ball's own race has moved."""
    scene = load_scene("feeding-deck", TILTED)
    forces, turn = driving_forces(run, scene), turned(run)
    for ball, height in enumerate((0.006, -0.003)):
        lifted = np.array([0.0, 0.0, height])
        moved = turn.inv().apply(run.position + turn.apply(lifted) - lifted)
        angle = run["angle"] + run.ball_angles[:, ball]
        across = moved[:, 0] * np.sin(angle) - moved[:, 1] * np.cos(angle)
        speed = run["speed"] + run.ball_rates[:, ball]
        np.testing.assert_allclose(forces[:, ball], 2e-4 * speed**2 * across, atol=1e-12)


def test_in_the_plane_nothing_turns() -> None:
    run = Drive(load_scene("thesis-hold")).advance(10)
    assert not run.tilts and not run.tilt.any() and not run.angular_acceleration.any()
    np.testing.assert_array_equal(run.turn, np.tile([1.0, 0.0, 0.0, 0.0], (10, 1)))
