"""Where balls balance a rotor: closed forms against what they have to do."""

import math

import numpy as np
import pytest
from scipy.optimize import minimize

from ab_sim.drive.closed_forms import balance_of, can_balance, resultant


def left(unbalance: float, moments: list[float], angles: np.ndarray) -> float:
    """Residual unbalance, summed as vectors."""
    x = unbalance + sum(m * math.cos(a) for m, a in zip(moments, angles, strict=True))
    y = sum(m * math.sin(a) for m, a in zip(moments, angles, strict=True))
    return math.hypot(x, y)


@pytest.mark.parametrize("balls", [1, 2, 3, 5, 8, 64])
def test_the_position_leaves_the_least_unbalance(balls: int) -> None:
    """None at all where the sides close to a polygon, else what any other position leaves more."""
    draw = np.random.default_rng(balls)
    balanced = 0
    for _ in range(40):
        moments = draw.uniform(0.05, 1.0, balls) ** 3
        unbalance = float(draw.uniform(0.0, 1.2) * moments.sum())
        found = balance_of(unbalance, moments.tolist())
        assert found is not None
        angles = np.array(found.angles)
        residual = left(unbalance, moments.tolist(), angles)
        assert residual == pytest.approx(found.residual, abs=1e-12 * moments.sum())
        assert ((angles >= 0.0) & (angles <= 2.0 * math.pi)).all()
        sides = sorted([unbalance, *moments])
        least = max(0.0, 2.0 * sides[-1] - sum(sides))  # the longest side less all the others
        assert residual == pytest.approx(least, abs=1e-12 * moments.sum())
        assert can_balance(unbalance, moments.tolist()) == (found.residual == 0.0)
        balanced += found.residual == 0.0
    assert balls == 1 or 0 < balanced < 40, "both cases were met"


def test_no_position_is_better_than_the_best() -> None:
    moments = [0.2, 1.5, 0.1]
    found = balance_of(0.4, moments)
    assert found is not None and found.residual == pytest.approx(0.8)
    for start in np.random.default_rng(1).uniform(-3, 3, (10, 3)):
        best = minimize(lambda angles: left(0.4, moments, angles), start, method="Nelder-Mead")
        assert best.fun >= found.residual - 1e-6


def test_two_equal_balls_mirror_each_other_around_the_opposite_side() -> None:
    """relative-stability (23): cos theta = -M0 e / (2 m R)."""
    found = balance_of(0.98, [1.0, 1.0])
    assert found is not None and not found.many
    one, two = found.angles
    assert one == pytest.approx(math.acos(-0.49)) and two == pytest.approx(2 * math.pi - one)


def test_special_cases() -> None:
    assert balance_of(1.0, []) is None
    exact = balance_of(1.0, [1.0])
    assert exact == ((math.pi,), 0.0, False)
    none = balance_of(0.0, [1.0])  # nothing to balance: one ball is the unbalance
    assert none is not None and none.residual == 1.0 and none.many
    opposite = balance_of(0.0, [1.0, 1.0])
    assert opposite is not None and opposite.residual == 0.0
    assert abs(resultant(np.ones(2), np.array(opposite.angles))) < 1e-15
    touching = balance_of(2.0, [1.0, 1.0])
    assert touching is not None and touching.angles == pytest.approx([math.pi, math.pi])


@pytest.mark.parametrize("balls", [1, 2, 3, 64])
@pytest.mark.parametrize("miss", [-1e-12, -4e-13, 0.0, 4e-13, 1e-12, 1e-11])
def test_balls_that_just_balance_but_for_rounding(balls: int, miss: float) -> None:
    found = balance_of(balls * 0.1 * (1.0 + miss), [0.1] * balls)
    assert found is not None and found.residual <= 1e-11 * balls
    np.testing.assert_allclose(found.angles, math.pi, atol=1e-4)
