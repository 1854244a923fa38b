"""Which laws' branches hold, and what the event functions say, beside the reference.

It tries all branches until the forces of one agree with it, with dense matrices.
"""

from typing import Any

import numpy as np
import pytest

from ab_sim.engine.events.complementarity import solve_complementarity
from ab_sim.engine.events.event_functions import HOLD, LOAD, MOTOR, NEVER, SLIDE, TOUCH
from ab_sim.model.dynamics.system import DIRECTION, JOINED, LOADED
from tests.events.instants import COMPANIES, PHASE, Instant, N, instant
from tests.reference.contact import touching
from tests.reference.dynamics import FREE, STUCK
from tests.reference.dynamics import solve as solve_reference
from tests.reference.friction import choose_mode

FRICTION = [name for name, effects in COMPANIES.items() if "race_friction" in effects]
CONTACT = [name for name, effects in COMPANIES.items() if "ball_contact" in effects]
MOTORS = [name for name, effects in COMPANIES.items() if "motor" in effects]
WITH_LAWS = [name for name in COMPANIES if name in {*FRICTION, *CONTACT, *MOTORS}]


def solved(random: np.random.Generator, effects: dict[str, Any]) -> tuple[Instant, Any, Any]:
    """An instant whose branches have been found, with the reference's mode and forces."""
    here = instant(random, effects)
    here.evaluate()
    before = here.state.copy()
    solve_complementarity(here.run, 0.0, -1, False)
    np.testing.assert_array_equal(here.state, before, "a look changes nothing")
    assert here.run.work.counts[1] == 0, "branches were found"
    q, rates = here.coordinates()
    mode = choose_mode(here.model, here.chain, here.asked, q, rates, here.z)
    return here, mode, solve_reference(here.model, here.chain, mode, here.asked, q, rates, here.z)


@pytest.mark.parametrize("name", WITH_LAWS)
def test_accelerations_are_the_references(name: str) -> None:
    random, seen, beyond = np.random.default_rng(3), set[Any](), []
    for _ in range(20):
        here, mode, want = solved(random, COMPANIES[name])
        np.testing.assert_allclose(here.accelerations(), want.accelerations, rtol=1e-8, atol=1e-6)
        slope = here.run.work.slope
        np.testing.assert_array_equal(slope[here.layout.angles], here.state[here.layout.rates])
        assert slope[here.layout.energy_balance][1] == pytest.approx(want.losses.sum(), rel=1e-9)
        q, rates = here.coordinates()
        w = rates[2]
        energy = here.system.mechanical_energy(here.state, PHASE, w)
        beyond.append(energy - here.model.energy(q, rates))
        assert slope[here.layout.energy_balance][0] == pytest.approx(want.torque * w, rel=1e-8)
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


@pytest.mark.parametrize("name", FRICTION)
def test_functions_of_friction_are_what_the_reference_has_left(name: str) -> None:
    random, leaning = np.random.default_rng(4), 0
    for _ in range(60):
        here, mode, want = solved(random, COMPANIES[name])
        value, rate, discrete = here.run.work.value, here.run.work.rate, here.discrete
        q, rates = here.coordinates()
        loaded = discrete[:N, LOADED] == 1
        assert np.array_equal(loaded, want.normal > 0.0)
        np.testing.assert_allclose(value[LOAD * N :][:N], np.abs(want.normal), atol=1e-9)
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
        rounding, moved = here.run.work.rounding, np.abs(here.run.balls.x[:2]).max()
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
                assert discrete[i, DIRECTION] == 0
                assert value[SLIDE * N + i] == pytest.approx(back[i], abs=1e-9)
                assert value[HOLD * N + i] == pytest.approx(forward[i], abs=1e-9)
                # Of the forces on it, and on those that it leans on.
                assert least[0][i] <= rounding[SLIDE * N + i] <= 5 * least[0][i]
                assert least[1][i] <= rounding[HOLD * N + i] <= 5 * least[1][i]
            elif loaded[i]:
                assert value[SLIDE * N + i] == abs(here.state[here.layout.rates][i])
                turned = discrete[i, DIRECTION] * change[i]
                assert rate[SLIDE * N + i] == pytest.approx(turned, rel=1e-8, abs=1e-6)
                assert 0.0 < rounding[SLIDE * N + i] < 1e-12, "rad/s"
                assert value[HOLD * N + i] == NEVER
            else:
                assert value[SLIDE * N + i] == value[HOLD * N + i] == NEVER
    assert leaning > 3 or name not in CONTACT, leaning


@pytest.mark.parametrize("name", CONTACT)
def test_functions_of_contact_are_gaps_or_pushes(name: str) -> None:
    random, joined = np.random.default_rng(5), 0
    for _ in range(25):
        here, mode, want = solved(random, COMPANIES[name])
        value, rate, discrete = here.run.work.value, here.run.work.rate, here.discrete
        order = here.order
        q, rates = here.coordinates()
        gaps = here.chain.radius * here.chain.gaps(here.model.theta(q))
        opens = here.chain.radius * here.chain.rates(q, rates)
        for c, (i, j) in enumerate(zip(here.chain.behind, here.chain.ahead, strict=True)):
            k = int(np.flatnonzero(order == i)[0])
            assert order[(k + 1) % N] == j
            slot = TOUCH * N + k
            if discrete[k, JOINED] == 0:
                assert value[slot] == pytest.approx(gaps[c], abs=1e-14)
                assert rate[slot] == pytest.approx(opens[c], abs=1e-12)
                closest = here.chain.radius[c] * here.chain.closest[c]
                assert 1e-13 < here.run.work.rounding[slot] / closest < 1e-11
            elif name not in FRICTION or 0 not in discrete[[i, j], DIRECTION]:
                assert value[slot] == pytest.approx(want.contact[c], abs=1e-9)
                assert rate[slot] == NEVER
                moved = np.abs(here.run.balls.x[:2]).max()
                both = here.model.masses[i] + here.model.masses[j]
                assert 1e-12 * both * moved < here.run.work.rounding[slot] < 1e-10
                joined += 1
            else:
                assert value[slot] == rate[slot] == NEVER
    assert joined > 3


@pytest.mark.parametrize("name", MOTORS)
def test_functions_of_the_motor_are_torques(name: str) -> None:
    random = np.random.default_rng(6)
    for _ in range(15):
        here, mode, _ = solved(random, COMPANIES[name])
        motor, speed = here.model.p.motor, here.coordinates()[1][2]
        raw, side = motor.kp * (here.asked.speed - speed) + motor.ki * here.z, mode.regime.side
        assert here.discrete[N, DIRECTION] == side
        limit = motor.limit
        left = [side * raw - limit, NEVER] if side else [limit + raw, limit - raw]
        np.testing.assert_allclose(here.run.work.value[MOTOR * N :], left, atol=1e-15)
        assert (
            0.0 < here.run.work.rounding[MOTOR * N] == here.run.work.rounding[MOTOR * N + 1] < 1e-12
        )
