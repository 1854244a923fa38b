"""Elimination of balls and rows, and the reactions it leaves out, beside one dense matrix.

Any carrier: its equations, and what it does to the balls, are random numbers.
"""

from typing import Any, NamedTuple

import numpy as np
import pytest

from ab_sim.dynamics.race.elimination import accelerate, eliminate, solve, solve_with_balls
from ab_sim.dynamics.race.race import Race
from ab_sim.dynamics.race.reactions import reactions
from ab_sim.dynamics.race.table import (
    FORCE,
    FRICTION,
    INERTIA,
    LOAD,
    PATH_ACCELERATION,
    PULL,
    PUSH,
    REACH,
)
from ab_sim.dynamics.system import (
    BALL_CONSTANTS,
    DIRECTION,
    JOINED,
    MOBILITY,
    MODES,
    ORDER,
)
from ab_sim.integrate.workspace import room

N = 5


class Solution(NamedTuple):
    """Accelerations of carrier and balls; the race's normal forces; pushes of ball on next ball."""

    carrier: np.ndarray
    balls: np.ndarray
    normal: np.ndarray
    pushes: np.ndarray


def random_race(
    random: np.random.Generator, size: int, *, rubs: bool, meets: bool, driven: bool
) -> Race:
    """Balls on a carrier with so many accelerations, the spindle's last."""
    made, modes = room(size, N), np.zeros((N + 1, MODES), np.int64)
    table, balls = made.table, np.zeros((N, BALL_CONSTANTS))
    table[:] = random.normal(size=table.shape)
    table[:, INERTIA] = random.uniform(0.5, 2.0, N)
    balls[:, MOBILITY] = 1.0 / table[:, INERTIA]
    if rubs:
        modes[:N, DIRECTION] = random.integers(-1, 2, N)
        table[:, FRICTION] = 0.3 * modes[:N, DIRECTION]
    if meets:
        modes[:N, JOINED] = random.integers(0, 2, N)
        modes[random.integers(N), JOINED] = 0
    half = random.normal(size=(size, size))
    made.block[:, :size] = half @ half.T + 3.0 * N * np.eye(size)
    made.block[:, size] = random.normal(size=size)
    # Only its upper triangle is promised.
    made.block[:, :size][np.tril_indices(size, -1)] = np.nan
    made.acceleration[:] = random.normal(size=size)
    contacts = np.zeros((N, 2))
    contacts[:, ORDER] = random.permutation(N)
    free = size if driven else size - 1
    flags = tuple((None,) if flag else () for flag in (rubs, meets, driven, True))
    return Race((None,) * N, balls, contacts, modes, made, size, free, 0, N, 2 * N, *flags)


def densely(race: Race) -> Solution:
    """The docstring of ``race.table`` in one matrix."""
    size, free, table, made = race.all, race.free, race.room.table, race.room
    reach, press = table[:, REACH : REACH + size], table[:, REACH + size : REACH + 2 * size]
    order, rubs, meets = race.contacts[:, ORDER].astype(int), bool(race.rubs), bool(race.meets)
    stuck = rubs & (race.modes[:N, DIRECTION] == 0)
    friction = np.where(stuck | (not rubs), 0.0, table[:, FRICTION])
    block = np.triu(made.block[:, :size])
    block += np.triu(block, 1).T
    carrier, ball, hold, push = np.split(np.arange(size + 3 * N), [size, size + N, size + 2 * N])
    matrix, right = np.zeros((2, size + 3 * N, size + 3 * N))
    right = right[0]
    matrix[np.ix_(carrier, carrier)], right[carrier] = block, made.block[:, size]
    matrix[np.ix_(carrier, ball)] = -reach.T
    matrix[ball, ball] = table[:, INERTIA]
    matrix[np.ix_(ball, carrier)] = -(reach - friction[:, None] * press)
    right[ball] = table[:, PULL] - friction * table[:, LOAD]
    matrix[ball, hold] = -1.0
    for r in range(free, size):
        matrix[r], right[r] = 0.0, made.acceleration[r]
        matrix[r, r] = 1.0
    for i in range(N):
        matrix[hold[i], ball[i] if stuck[i] else hold[i]] = 1.0
    for k in range(N):
        i, j = order[k], order[(k + 1) % N]
        matrix[ball[i], push[k]], matrix[ball[j], push[k]] = 1.0, -1.0
        if meets and race.modes[k, JOINED] and not stuck[i] and not stuck[j]:
            matrix[push[k], ball[i]], matrix[push[k], ball[j]] = 1.0, -1.0
        else:
            matrix[push[k], push[k]] = 1.0
    found = np.linalg.solve(matrix, right)
    x, g = found[carrier], found[ball]
    return Solution(x, g, table[:, LOAD] + press @ x, found[push])


def same(got: Any, want: Any) -> None:
    np.testing.assert_allclose(got, want, rtol=0.0, atol=1e-11)


@pytest.mark.parametrize("size", [3, 7])
@pytest.mark.parametrize("driven", [False, True])
@pytest.mark.parametrize("meets", [False, True])
@pytest.mark.parametrize("rubs", [False, True])
def test_elimination_is_the_dense_solution(
    rubs: bool, meets: bool, driven: bool, size: int
) -> None:
    random = np.random.default_rng(size)
    for _ in range(12):
        race = random_race(random, size, rubs=rubs, meets=meets, driven=driven)
        want, made = densely(race), race.room
        given = made.block.copy()
        eliminate(race)
        solve(race)
        same(made.acceleration, want.carrier)
        same(made.table[:, PATH_ACCELERATION], want.balls)
        np.testing.assert_array_equal(made.block, given)
        reactions(race)
        if rubs:
            same(made.table[:, FORCE], want.normal)
        if meets:
            same(made.table[:, PUSH], want.pushes)
        made.table[:, PATH_ACCELERATION] = np.nan
        accelerate(race)
        same(made.table[:, PATH_ACCELERATION], want.balls)
        made.acceleration[: race.free] = np.nan
        solve_with_balls(race)
        same(made.acceleration, want.carrier)
