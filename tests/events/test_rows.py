"""Rows of balls that touch, at one instant, against trying all ways in which they could move."""

from itertools import product

import numpy as np
import pytest

from ab_sim.engine.events.rows import CLOSED, COARSE, HOLD, LEVEL, PATH_FORCE, WIDTH, solve_rows
from ab_sim.model.dynamics.system import JOINED, ROLLING_MASS
from tests.events.arrays import loose_balls

N = 5
"""Balls in a row; the last contact, around the race, is open."""


def best(mass: np.ndarray, pull: np.ndarray, hold: np.ndarray, closed: np.ndarray) -> np.ndarray:
    """The accelerations that minimise the energy of the acceleration, over all groupings."""
    found, least = np.zeros(N), np.inf
    for cuts in product((False, True), repeat=N - 1):
        ends = [k + 1 for k in range(N - 1) if cuts[k] or not closed[k]] + [N]
        groups = [np.arange(a, b) for a, b in zip([0, *ends[:-1]], ends, strict=True)]
        level = np.empty(N)
        for group in groups:
            p, f = pull[group].sum(), hold[group].sum()
            level[group] = np.sign(p) * max(abs(p) - f, 0.0) / mass[group].sum()
        if (np.diff(level)[closed[:-1]] < 0.0).any():
            continue
        cost = np.sum(0.5 * mass * level**2 - pull * level + hold * np.abs(level))
        if cost < least - 1e-15:
            found, least = level, cost
    return found


@pytest.mark.parametrize("rests", [True, False])
def test_rows_move_as_the_least_acceleration_says(rests: bool) -> None:
    rng = np.random.default_rng(1)
    apart = still = 0
    for _ in range(300):
        mass, pull = rng.uniform(0.2, 3.0, N), rng.normal(size=N)
        hold = rng.uniform(0.0, 1.5, N) * rng.integers(0, 2, N) if rests else np.zeros(N)
        closed = np.append(rng.random(N - 1) < 0.8, False)
        # The row may begin anywhere in the order of the balls.
        turn = int(rng.integers(N))
        balls, rows = loose_balls(N, has_contact=True), np.zeros((N, WIDTH))
        balls.contacts[:, 0] = np.roll(np.arange(N), turn)
        balls.constants[:, ROLLING_MASS] = mass
        rows[:, PATH_FORCE], rows[:, HOLD] = pull, hold if rests else -1.0
        rows[:, COARSE], rows[:, CLOSED] = 1e-14, np.roll(closed, turn)
        changed = solve_rows(balls, rows)
        want = best(mass, pull, hold, closed)
        np.testing.assert_allclose(rows[:, LEVEL], want, atol=1e-12)
        joined = np.roll(balls.discrete[:N, JOINED] == 1, -turn)
        assert changed == joined.any() and not solve_rows(balls, rows)
        assert not (joined & ~closed).any()
        assert np.all(np.diff(want)[joined[:-1]] == pytest.approx(0.0, abs=1e-12))
        apart += int((closed & ~joined).sum())
        still += int((want == 0.0).sum())
    assert apart > 50 and (still > 100) == rests, "all that can happen did"


def test_balls_that_may_pass_each_other_move_alone() -> None:
    rng = np.random.default_rng(2)
    mass, pull, hold = rng.uniform(0.2, 3.0, N), rng.normal(size=N), rng.uniform(-0.5, 1.0, N)
    balls = loose_balls(N, contacts=np.zeros((0, 2)))
    balls.constants[:, ROLLING_MASS] = mass
    rows = np.zeros((N, WIDTH))
    rows[:, PATH_FORCE], rows[:, HOLD] = pull, hold
    assert not solve_rows(balls, rows)
    left = np.where(hold < 0.0, pull, np.sign(pull) * np.maximum(np.abs(pull) - hold, 0.0))
    np.testing.assert_allclose(rows[:, LEVEL], left / mass, rtol=1e-14)
