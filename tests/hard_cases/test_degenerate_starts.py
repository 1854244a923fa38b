"""Starts and balances without a preferred outcome, and numbers at the edge of the format.

2 m R exactly M0 e puts the balanced position where the balls meet, a bifurcation; balls on top of
each other make the equations of the pair equal; denormal angles and an eccentricity of 1e-12 m
drown in tolerances; angles of 1e9 rad lose seven digits if they are kept in one number. Asserted:
the independent simulator agrees, equal balls stay equal bit for bit, energy balances, and an angle
with many turns moves as its remainder does.
"""

import math
from typing import Any

import numpy as np
import pytest

from tests.hard_cases.extremes import errors, fast, imbalance, run


@pytest.mark.parametrize(
    "changes",
    [
        {"rotor": {"eccentricity": 2e-5 / 0.098}},
        {"rotor": {"eccentricity": 1e-12}},
        {"rotor": {"eccentricity": 0.0}},
        {"start": {"ball_angles": [0.3, 0.3]}},
        {"start": {"ball_angles": [5e-324, -5e-324]}},
        {"start": {"ball_angles": [1e-310, 5e-324]}, "rotor": {"eccentricity": 0.0}},
        {"start": {"angle": 5e-324}},
    ],
    ids=["exact balance", "1e-12 m", "no unbalance", "on top", "denormal", "denormal 2", "psi"],
)
def test_agrees_with_the_reference(changes: dict[str, Any]) -> None:
    drive = run(fast(**changes), 0.15)
    assert imbalance(drive) < 1e-9
    balls, deck = errors(drive)
    assert balls < 1e-9 and deck < 1e-7


def test_balls_on_top_of_each_other_stay_there() -> None:
    theta = run(fast(start={"ball_angles": [0.3, 0.3]}), 3.0).observe().theta
    assert theta[0] == theta[1]


def test_relabelled_balls_move_alike() -> None:
    one, other = (
        run(fast(start={"ball_angles": a}), 1.0).observe() for a in ([0.3, -0.9], [-0.9, 0.3])
    )
    np.testing.assert_allclose(one.theta, other.theta[::-1], atol=1e-9)


@pytest.mark.parametrize("turns", [160_000_000, -160_000_000, 1_500_000_000])
def test_angles_keep_their_digits_after_1e9_rad(turns: int) -> None:
    """A start angle of many turns is a double near them: the remainder of that double counts."""
    many = [2 * math.pi * turns + 0.3, 2 * math.pi * turns - 0.9]
    far = run(fast(start={"ball_angles": many}), 0.1)
    within = [math.atan2(math.sin(a), math.cos(a)) for a in many]
    near = run(fast(start={"ball_angles": within}), 0.1)
    np.testing.assert_array_equal(far.snapshot().state, near.snapshot().state)
    np.testing.assert_allclose(far.observe().theta - many, near.observe().theta - within, atol=4e-6)
