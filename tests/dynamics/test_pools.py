"""Rows of balls that touch, at one instant, against trying all ways in which they could move."""

from itertools import product

import numpy as np
import pytest

from ab_sim.dynamics.assemble import system_of
from ab_sim.dynamics.race.pools import CLOSED, COARSE, HOLD, LEVEL, POOL_WIDTH, PULL
from ab_sim.dynamics.race.table import INERTIA
from ab_sim.dynamics.system import JOINED, MODES, ORDER, Place
from ab_sim.spindle import Ramp
from tests.dynamics.calls import compiled_pool, plant_of
from tests.hard_cases.extremes import RUBBING, scene_of

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
    system = system_of(scene_of(balls={"count": N}, effects=RUBBING))
    assert system.contacts[:, ORDER].tolist() == list(range(N))
    rng = np.random.default_rng(1)
    apart = still = 0
    for _ in range(300):
        mass, pull = rng.uniform(0.2, 3.0, N), rng.normal(size=N)
        hold = rng.uniform(0.0, 1.5, N) * rng.integers(0, 2, N) if rests else np.zeros(N)
        closed = np.append(rng.random(N - 1) < 0.8, False)
        pools, modes = np.zeros((N, POOL_WIDTH)), np.zeros((N + 1, MODES), np.int64)
        plant = plant_of(system, Place(Ramp(0.0, 0.0), 0.0), modes)
        plant.room.table[:, INERTIA] = mass
        pools[:, PULL], pools[:, HOLD] = pull, hold if rests else -1.0
        pools[:, COARSE], pools[:, CLOSED] = 1e-14, closed
        compiled_pool(plant, pools)
        want = best(mass, pull, hold, closed)
        np.testing.assert_allclose(pools[:, LEVEL], want, atol=1e-12)
        joined = modes[:N, JOINED] == 1
        assert not (joined & ~closed).any()
        assert np.all(np.diff(want)[joined[:-1]] == pytest.approx(0.0, abs=1e-12))
        apart += int((closed & ~joined).sum())
        still += int((want == 0.0).sum())
    assert apart > 50 and (still > 100) == rests, "all that can happen did"
