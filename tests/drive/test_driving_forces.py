"""The driving force on a ball, against vectors: what carries it along its race, less friction."""

import numpy as np
import pytest

from ab_sim.drive.closed_forms import DrivenBalls


def test_friction_is_of_the_force_that_presses_the_ball_on_the_race() -> None:
    """A ball that turns about the shaft's place at rest, at r = W + R n, needs m psi'^2 r inwards.

    Its part along n is the normal force, whose friction hinders; that across n is what drives,
    forward where theta falls (thesis (2-15)).
    """
    radius, mu, mass = 0.01, 0.3, 1.5e-3
    balls = DrivenBalls((mass,), (mu,), (0.0,), radius)
    random = np.random.default_rng(5)
    whirl, angle = random.uniform(-5e-3, 5e-3, (50, 2)), random.uniform(-9.0, 9.0, (50, 1))
    speed = random.uniform(-300.0, 300.0, (50, 1))
    found = balls.force(whirl[:, :1], whirl[:, 1:], angle, speed)
    normal = np.hstack([np.cos(angle), np.sin(angle)])
    along = np.hstack([-np.sin(angle), np.cos(angle)])
    needed = mass * speed**2 * (whirl + radius * normal)
    drives = -np.sum(needed * along, axis=1)
    presses = np.sum(needed * normal, axis=1)
    np.testing.assert_allclose(found[:, 0], drives - mu * presses, rtol=1e-12, atol=1e-12)
    assert np.ptp(presses / (mass * speed[:, 0] ** 2)) == pytest.approx(radius, rel=0.5)
