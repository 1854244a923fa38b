"""Which laws' branches hold, and what the margins say, beside the reference.

It tries all branches until the forces of one agree with it, with dense matrices.
"""

from typing import Any

import numpy as np
import pytest

from ab_sim.dynamics.energy import mechanical_energy
from ab_sim.dynamics.race import pools, table
from ab_sim.dynamics.race.ball import path_change, place_from_shaft, rate_change
from ab_sim.dynamics.race.margins import HOLD, LOAD, MOTOR, NEVER, SLIDE, TOUCH, slots
from ab_sim.dynamics.race.settle import settle
from ab_sim.dynamics.system import DIRECTION, JOINED, LOADED, ORDER
from tests.reference.contact import touching
from tests.reference.dynamics import FREE, STUCK
from tests.reference.dynamics import solve as solve_reference
from tests.reference.friction import choose_mode
from tests.uncompiled.plants import COMPANIES, PHASE, Instant, N, instant


def settled(random: np.random.Generator, effects: dict[str, Any]) -> tuple[Instant, Any, Any]:
    """An instant whose branches have been found, with the reference's mode and forces."""
    here = instant(random, effects)
    here.evaluate()
    before = here.state.copy()
    settle(here.calls, here.race, here.work, 0.0, here.state, -1, False)
    np.testing.assert_array_equal(here.state, before, "a look changes nothing")
    assert here.work.counts[1] == 0, "branches were found"
    q, rates = here.coordinates()
    mode = choose_mode(here.model, here.chain, here.asked, q, rates, here.z)
    return here, mode, solve_reference(here.model, here.chain, mode, here.asked, q, rates, here.z)


@pytest.mark.parametrize("name", COMPANIES)
def test_accelerations_are_the_references(name: str) -> None:
    random, seen, beyond = np.random.default_rng(3), set[Any](), []
    for _ in range(20):
        here, mode, want = settled(random, COMPANIES[name])
        np.testing.assert_allclose(here.accelerations(), want.accelerations, rtol=1e-8, atol=1e-6)
        slope = here.work.slopes[0]
        np.testing.assert_array_equal(slope[here.layout.angles], here.state[here.layout.rates])
        assert slope[here.layout.ledger][1] == pytest.approx(want.losses.sum(), rel=1e-9)
        q, rates = here.coordinates()
        w = rates[2]
        energy = mechanical_energy(here.plant.system, here.state, PHASE, w)
        beyond.append(energy - here.model.energy(q, rates))
        assert slope[here.layout.ledger][0] == pytest.approx(want.torque * w, rel=1e-8)
        if "motor" in name or name == "all":
            assert slope[here.layout.spindle][2] == pytest.approx(want.integrator, rel=1e-10)
        seen |= {("ball", state) for state in mode.balls} | {("contact", c) for c in mode.closed}
        seen.add(("motor", mode.regime.side))
    assert np.ptp(beyond) < 1e-14, "energies differ by where they count from"
    if "friction" in name or name == "all":
        assert {("ball", s) for s in (FREE, STUCK, 1, -1)} <= seen
    if "contact" in name or name == "all":
        assert ("contact", True) in seen
    if "motor" in name or name == "all":
        assert {("motor", side) for side in (-1, 0, 1)} <= seen


def test_no_two_things_share_a_column() -> None:
    columns = [
        *(pools.PULL, pools.HOLD, pools.COARSE, pools.LEVEL, pools.CLOSED, pools.SHIFT, pools.HOP),
        *(pools.FIRST, pools.POOL_INERTIA, pools.POOL_PULL, pools.POOL_HOLD),
        *(pools.POOL_COARSE, pools.POOL_LEVEL),
    ]
    assert sorted(columns) == list(range(pools.POOL_WIDTH))
    names = [name for name in vars(table) if name.isupper()]
    assert sorted(getattr(table, name) for name in names) == list(range(table.REACH + 1))
    assert table.table_width(7) == table.REACH + 3 * 7
    assert sorted([SLIDE, HOLD, LOAD, TOUCH, MOTOR]) == list(range(5)) and slots(3) == 4 * 3 + 2


@pytest.mark.parametrize("name", ["thesis", "oval"])
def test_places_and_changes_along_the_race(name: str) -> None:
    """On axes that turn, from the shaft; theta'' and path acceleration say the same."""
    random = np.random.default_rng(12)
    for _ in range(5):
        here = instant(random, COMPANIES[name])
        here.evaluate()
        q, rates = here.coordinates()
        arms = here.model.kinematics(q, rates).arms
        for i, angle in enumerate(q[3:]):
            h, x = place_from_shaft(here.plant, i)
            place = (h + 1j * x) * np.exp(1j * angle)
            assert place == pytest.approx(complex(*arms[:, i]), rel=1e-12)
            path, rate = random.normal(0.0, 10.0, 2)
            back = path_change(here.plant, i, rate, rate_change(here.plant, i, rate, path))
            assert back == pytest.approx(path, rel=1e-12)


FRICTION = [name for name, effects in COMPANIES.items() if "race_friction" in effects]
CONTACT = [name for name, effects in COMPANIES.items() if "ball_contact" in effects]
MOTORS = [name for name, effects in COMPANIES.items() if "motor" in effects]


@pytest.mark.parametrize("name", FRICTION)
def test_margins_of_friction_are_what_the_reference_has_left(name: str) -> None:
    random, leaning = np.random.default_rng(4), 0
    for _ in range(150):
        here, mode, want = settled(random, COMPANIES[name])
        margin, rate, modes = here.work.margin, here.work.rate, here.plant.modes
        q, rates = here.coordinates()
        loaded = modes[:N, LOADED] == 1
        assert np.array_equal(loaded, want.normal > 0.0)
        np.testing.assert_allclose(margin[LOAD * N :][:N], np.abs(want.normal), atol=1e-9)
        most = here.model.coefficients * np.maximum(want.normal, 0.0)
        held = want.friction.copy()
        for c, (i, j) in enumerate(zip(here.chain.behind, here.chain.ahead, strict=True)):
            held[i] -= want.contact[c]
            held[j] += want.contact[c]
        slide, change = here.model.theta(rates), here.model.theta(want.accelerations)
        stuck = (slide == 0.0) & (np.abs(change) < 1e-7)
        back, forward = most - held, most + held
        # Who is pushed leans on the stuck ball behind, or ahead.
        rows = touching(here.chain, q, rates)
        leans = [
            (i, j)
            for i, j, touch in zip(here.chain.behind, here.chain.ahead, rows, strict=True)
            if touch and stuck[i] and stuck[j]
        ]
        rounding, moved = here.work.rounding, np.abs(here.work.room.acceleration[:2]).max()
        own = 1e-12 * np.max([want.normal, np.abs(held), here.model.masses * moved], axis=0)
        assert (rounding[LOAD * N :][:N] >= np.where(stuck, own, 0.0)).all()
        assert (rounding[LOAD * N :][:N] >= 1e-12 * np.abs(want.normal)).all()
        least = own.copy(), own.copy()
        for _ in range(N):
            for i, j in leans:
                least[0][j], least[1][i] = own[j] + least[0][i], own[i] + least[1][j]
                back[j], forward[i] = (most - held)[j] + back[i], (most + held)[i] + forward[j]
        leaning += len(leans)
        for i in range(N):
            if stuck[i]:
                assert modes[i, DIRECTION] == 0
                assert margin[SLIDE * N + i] == pytest.approx(back[i], abs=1e-9)
                assert margin[HOLD * N + i] == pytest.approx(forward[i], abs=1e-9)
                # Of the forces on it, and on those that it leans on.
                assert least[0][i] <= rounding[SLIDE * N + i] <= 5 * least[0][i]
                assert least[1][i] <= rounding[HOLD * N + i] <= 5 * least[1][i]
            elif loaded[i]:
                assert margin[SLIDE * N + i] == abs(here.state[here.layout.rates][i])
                turned = modes[i, DIRECTION] * change[i]
                assert rate[SLIDE * N + i] == pytest.approx(turned, rel=1e-8, abs=1e-6)
                assert 0.0 < rounding[SLIDE * N + i] < 1e-12, "rad/s"
                assert margin[HOLD * N + i] == NEVER
            else:
                assert margin[SLIDE * N + i] == margin[HOLD * N + i] == NEVER
    assert leaning > 3 or name not in CONTACT, leaning


@pytest.mark.parametrize("name", CONTACT)
def test_margins_of_contact_are_gaps_or_pushes(name: str) -> None:
    random, joined = np.random.default_rng(5), 0
    for _ in range(25):
        here, mode, want = settled(random, COMPANIES[name])
        margin, rate, modes = here.work.margin, here.work.rate, here.plant.modes
        order = here.plant.system.contacts[:, ORDER].astype(int)
        q, rates = here.coordinates()
        gaps = here.chain.radius * here.chain.gaps(here.model.theta(q))
        opens = here.chain.radius * here.chain.rates(q, rates)
        for c, (i, j) in enumerate(zip(here.chain.behind, here.chain.ahead, strict=True)):
            k = int(np.flatnonzero(order == i)[0])
            assert order[(k + 1) % N] == j
            slot = TOUCH * N + k
            if modes[k, JOINED] == 0:
                assert margin[slot] == pytest.approx(gaps[c], abs=1e-14)
                assert rate[slot] == pytest.approx(opens[c], abs=1e-12)
                closest = here.chain.radius[c] * here.chain.closest[c]
                assert 1e-13 < here.work.rounding[slot] / closest < 1e-11
            elif name not in FRICTION or 0 not in modes[[i, j], DIRECTION]:
                assert margin[slot] == pytest.approx(want.contact[c], abs=1e-9)
                assert rate[slot] == NEVER
                moved = np.abs(here.work.room.acceleration[:2]).max()
                both = here.model.masses[i] + here.model.masses[j]
                assert 1e-12 * both * moved < here.work.rounding[slot] < 1e-10
                joined += 1
            else:
                assert margin[slot] == rate[slot] == NEVER
    assert joined > 3


@pytest.mark.parametrize("name", MOTORS)
def test_margins_of_the_motor_are_torques(name: str) -> None:
    random = np.random.default_rng(6)
    for _ in range(15):
        here, mode, _ = settled(random, COMPANIES[name])
        motor, speed = here.model.p.motor, here.coordinates()[1][2]
        raw, side = motor.kp * (here.asked.speed - speed) + motor.ki * here.z, mode.regime.side
        assert here.plant.modes[N, DIRECTION] == side
        limit = motor.limit
        left = [side * raw - limit, NEVER] if side else [limit + raw, limit - raw]
        np.testing.assert_allclose(here.work.margin[MOTOR * N :], left, atol=1e-15)
        assert 0.0 < here.work.rounding[MOTOR * N] == here.work.rounding[MOTOR * N + 1] < 1e-12
