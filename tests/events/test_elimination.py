"""Mobility of balls and rows, jumps and reactions beside one dense matrix, on any deck."""

from typing import NamedTuple

import numpy as np
import pytest

from ab_sim.engine.events.balls import (
    path_force_less_friction,
    put_branches,
    put_normal_forces,
    put_pushes,
)
from ab_sim.engine.events.impact import solve_jumps
from ab_sim.engine.events.run import (
    COUPLING,
    FRICTION,
    INERTIA,
    LOAD,
    PATH_ACCELERATION,
    PATH_FORCE,
    PULL,
    BallEvents,
)
from ab_sim.model.dynamics.system import DIRECTION, JOINED, LOADED, MOBILITY, ORDER, ROLLING_MASS
from tests.events.arrays import loose_balls

N = 5


class Solution(NamedTuple):
    """Accelerations of deck and balls; the race's normal forces; pushes of ball on next ball."""

    deck: np.ndarray
    balls: np.ndarray
    normal: np.ndarray
    pushes: np.ndarray


def random_balls(
    random: np.random.Generator, size: int, *, friction: bool, contact: bool, motor: bool
) -> BallEvents:
    """Balls on a deck with so many accelerations, the spindle's last."""
    balls = loose_balls(
        N,
        size,
        has_friction=friction,
        has_contact=contact,
        has_motor=motor,
        free=size if motor else size - 1,
    )
    table = balls.table
    table[:] = random.normal(size=table.shape)
    table[INERTIA] = balls.constants[:, ROLLING_MASS] = random.uniform(0.5, 2.0, N)
    balls.constants[:, MOBILITY] = 1.0 / table[INERTIA]
    balls.discrete[:N, LOADED] = 1
    if friction:
        balls.discrete[:N, DIRECTION] = random.integers(-1, 2, N)
        table[FRICTION] = 0.3 * balls.discrete[:N, DIRECTION]
    if contact:
        balls.discrete[:N, JOINED] = random.integers(0, 2, N)
        balls.discrete[random.integers(N), JOINED] = 0
    half = random.normal(size=(size, size))
    balls.block[:, :size] = half @ half.T + 3.0 * N * np.eye(size)
    balls.block[:, size] = random.normal(size=size)
    # Only its upper triangle is promised.
    balls.block[:, :size][np.tril_indices(size, -1)] = np.nan
    balls.x[:] = random.normal(size=size) if motor else 0.0
    balls.contacts[:, ORDER] = random.permutation(N)
    return balls


def densely(balls: BallEvents) -> Solution:
    """What the table's lines mean, in one matrix."""
    size, free, table = balls.accelerations, balls.free, balls.table
    reach, press = (
        table[COUPLING : COUPLING + size].T,
        table[COUPLING + size : COUPLING + 2 * size].T,
    )
    order, discrete = balls.contacts[:, ORDER].astype(int), balls.discrete
    stuck = balls.has_friction & (discrete[:N, DIRECTION] == 0)
    friction = np.where(stuck | (not balls.has_friction), 0.0, table[FRICTION])
    block = np.triu(balls.block[:, :size])
    block += np.triu(block, 1).T
    deck, ball, hold, push = np.split(np.arange(size + 3 * N), [size, size + N, size + 2 * N])
    matrix, right = np.zeros((size + 3 * N, size + 3 * N)), np.zeros(size + 3 * N)
    matrix[np.ix_(deck, deck)], right[deck] = block, balls.block[:, size]
    matrix[np.ix_(deck, ball)] = -reach.T
    matrix[ball, ball] = table[INERTIA]
    matrix[np.ix_(ball, deck)] = -(reach - friction[:, None] * press)
    right[ball] = table[PATH_FORCE] - friction * table[LOAD]
    matrix[ball, hold] = -1.0
    for r in range(free, size):
        matrix[r], right[r] = 0.0, 0.0
        matrix[r, r] = 1.0
    for i in range(N):
        matrix[hold[i], ball[i] if stuck[i] else hold[i]] = 1.0
    for k in range(N):
        i, j = order[k], order[(k + 1) % N]
        matrix[ball[i], push[k]], matrix[ball[j], push[k]] = 1.0, -1.0
        if balls.has_contact and discrete[k, JOINED] and not stuck[i] and not stuck[j]:
            matrix[push[k], ball[i]], matrix[push[k], ball[j]] = 1.0, -1.0
        else:
            matrix[push[k], push[k]] = 1.0
    found = np.linalg.solve(matrix, right)
    x = found[deck]
    return Solution(x, found[ball], table[LOAD] + press @ x, found[push])


def mobility_of(balls: BallEvents) -> np.ndarray:
    """What ``put_branches`` says, as a matrix."""
    put_branches(balls)
    if balls.has_contact:
        return balls.branches[N : N + N * N].reshape(N, N)
    return np.diag(balls.branches[N : 2 * N])


@pytest.mark.parametrize("contact", [False, True])
@pytest.mark.parametrize("friction", [False, True])
def test_mobility_makes_path_accelerations_of_forces(friction: bool, contact: bool) -> None:
    random = np.random.default_rng(3)
    for _ in range(20):
        balls = random_balls(random, 3, friction=friction, contact=contact, motor=False)
        x = random.normal(size=3)
        balls.block[:, :3], balls.block[:, 3] = np.diag([1e30] * 3), 1e30 * x
        want = densely(balls._replace(free=3))
        rows = (
            balls.table[COUPLING : COUPLING + 3]
            - balls.table[FRICTION] * balls.table[COUPLING + 3 :]
            if friction
            else balls.table[COUPLING : COUPLING + 3]
        )
        drag = balls.table[FRICTION] * balls.table[LOAD] if friction else 0.0
        forces = balls.table[PATH_FORCE] - drag + want.deck @ rows
        np.testing.assert_allclose(mobility_of(balls) @ forces, want.balls, rtol=0.0, atol=1e-11)
        signs = balls.discrete[:N, DIRECTION] * balls.discrete[:N, LOADED]
        np.testing.assert_array_equal(balls.branches[:N], signs)


@pytest.mark.parametrize("size", [3, 7])
@pytest.mark.parametrize("motor", [False, True])
def test_jumps_are_the_dense_solution(motor: bool, size: int) -> None:
    random = np.random.default_rng(size)
    for _ in range(12):
        balls = random_balls(random, size, friction=False, contact=True, motor=motor)
        want, given = densely(balls), balls.block.copy()
        put_branches(balls)
        solve_jumps(balls)
        np.testing.assert_allclose(balls.x, want.deck, rtol=0.0, atol=1e-11)
        np.testing.assert_allclose(balls.table[PATH_ACCELERATION], want.balls, atol=1e-11)
        np.testing.assert_array_equal(balls.block, given)


@pytest.mark.parametrize("contact", [False, True])
@pytest.mark.parametrize("friction", [False, True])
def test_reactions_are_those_of_the_dense_solution(friction: bool, contact: bool) -> None:
    random = np.random.default_rng(5)
    for _ in range(20):
        balls = random_balls(random, 3, friction=friction, contact=contact, motor=True)
        want = densely(balls)
        balls.x[:], balls.table[PATH_ACCELERATION] = want.deck, want.balls
        put_normal_forces(balls, balls.x)
        for i in range(N):
            balls.table[PULL, i] = path_force_less_friction(balls, i, balls.x)
        if friction:
            np.testing.assert_allclose(balls.force, want.normal, atol=1e-11)
        if contact:
            put_pushes(balls)
            np.testing.assert_allclose(balls.push, want.pushes, atol=1e-11)


def test_a_ball_that_is_held_does_not_move() -> None:
    """A fault's: no mobility, and more inertia than anything."""
    balls = loose_balls(3)
    balls.constants[1, [ROLLING_MASS, MOBILITY]] = 1e100, 0.0
    put_branches(balls)
    np.testing.assert_array_equal(balls.branches[3:6], [1.0, 0.0, 1.0])
    balls = loose_balls(3, has_contact=True)
    balls.constants[1, [ROLLING_MASS, MOBILITY]] = 1e100, 0.0
    balls.discrete[0, JOINED] = 1
    put_branches(balls)
    held = balls.branches[3:12].reshape(3, 3)
    np.testing.assert_allclose(held, np.diag([0.0, 0.0, 1.0]), rtol=0.0, atol=1e-99)
