"""Impacts beside the reference, which tries all sets of contacts with the full mass matrix.

And what else an event does to a state: balls come to rest, rows lose what rounding has done.
"""

from typing import Any

import numpy as np
import pytest

from ab_sim.engine.events.complementarity import solve_complementarity
from ab_sim.engine.events.event_functions import SLIDE, TOUCH
from ab_sim.engine.events.impact import SLOW_IMPACT, collide
from ab_sim.model.dynamics.system import DIRECTION, JOINED
from tests.events.instants import COMPANIES, OVAL, RUBBING, TOUCHING, Instant, N, instant
from tests.reference.contact import impact

HARD = [name for name, effects in COMPANIES.items() if "ball_contact" in effects]


def struck(random: np.random.Generator, effects: dict[str, Any]) -> tuple[Instant, int, int]:
    """An instant at which two balls meet: with the contact, by the reference and by the row."""
    while True:
        here = instant(random, effects)
        order = here.order
        joined = np.flatnonzero(here.discrete[:N, JOINED])
        if joined.size:
            break
    k = int(random.choice(joined))
    i, j = order[k], order[(k + 1) % N]
    here.discrete[k, JOINED] = 0
    # The row behind the contact is faster than the row ahead.
    rates = here.state[here.layout.rates]
    path = here.model.curve.at(here.model.theta(here.coordinates()[0]))[2]
    speeds = rates * path
    behind = i
    while True:
        speeds[behind] = speeds[j] + 0.05
        before = (int(np.flatnonzero(order == behind)[0]) - 1) % N
        if before == k or not here.discrete[before, JOINED]:
            break
        behind = order[before]
    rates[:] = speeds / path
    here.discrete[:N, DIRECTION] = np.sign(rates)
    c = int(np.flatnonzero((here.chain.behind == i) & (here.chain.ahead == j))[0])
    return here, c, k


@pytest.mark.parametrize("name", HARD)
def test_speeds_after_an_impact_are_the_references(name: str) -> None:
    random, parted = np.random.default_rng(7), 0
    for _ in range(80):
        here, c, k = struck(random, COMPANIES[name])
        here.evaluate()
        q, rates = here.coordinates()
        want = impact(here.model, here.chain, c, q, rates)
        before = here.state.copy()
        assert collide(here.run, 0.0, k, False)
        after = here.coordinates()[1]
        np.testing.assert_allclose(after, want, rtol=1e-10, atol=1e-10)
        np.testing.assert_array_equal(here.state[here.layout.angles], before[here.layout.angles])
        work, lost = (here.state - before)[here.layout.energy_balance]
        gained = here.model.energy(q, after) - here.model.energy(q, rates)
        assert lost > 0.0 and (work == 0.0) == ("motor" in COMPANIES[name])
        assert gained == pytest.approx(work - lost, rel=1e-9, abs=1e-15)
        opens = here.chain.radius * here.chain.rates(q, after)
        order = here.order
        for place in range(N):
            contact = int(np.flatnonzero(here.chain.behind == order[place])[0])
            if here.discrete[place, JOINED]:
                assert opens[contact] == pytest.approx(0.0, abs=1e-14)
            else:
                parted += 1
                gap = here.chain.gaps(here.model.theta(q))[contact]
                assert gap > 1e-6 or opens[contact] > 0.0
        if "race_friction" in COMPANIES[name]:
            signs = np.sign(here.state[here.layout.rates])
            np.testing.assert_array_equal(here.discrete[:N, DIRECTION], signs)
    assert parted > 10


@pytest.mark.parametrize("plastic", [False, True])
def test_what_is_plastic_or_slow_does_not_bounce(plastic: bool) -> None:
    random = np.random.default_rng(8)
    for _ in range(40):
        here, c, k = struck(random, {**OVAL, **TOUCHING})
        if not plastic:
            # Just below what counts as an impact.
            rates, layout = here.state[here.layout.rates], here.layout
            path = here.model.curve.at(here.model.theta(here.coordinates()[0]))[2]
            i, j = here.chain.behind[c], here.chain.ahead[c]
            row = np.abs(rates * path - (rates * path)[i]) < 1e-12
            row[j] = False
            rates[row] -= (0.05 - 0.9 * SLOW_IMPACT) / path[row]
            here.state[layout.rates] = rates
        joined = here.discrete[:N, JOINED].copy()
        here.evaluate()
        q = here.coordinates()[0]
        assert collide(here.run, 0.0, k, plastic)
        assert here.discrete[k, JOINED] == 1
        assert plastic or (here.discrete[:N, JOINED] >= joined).all(), "it parts none"
        opens = here.chain.radius * here.chain.rates(q, here.coordinates()[1])
        assert opens[c] == pytest.approx(0.0, abs=1e-15)


def test_an_event_at_a_contact_is_an_impact_and_what_follows_of_it() -> None:
    """``collide``, then branches that agree."""
    random = np.random.default_rng(9)
    for _ in range(10):
        here, c, k = struck(random, {**RUBBING, **TOUCHING})
        q, rates = here.coordinates()
        want = impact(here.model, here.chain, c, q, rates)
        here.evaluate()
        solve_complementarity(here.run, 0.0, TOUCH * N + k, False)
        assert here.run.work.counts[1] == 0
        np.testing.assert_allclose(here.coordinates()[1], want, rtol=1e-9, atol=1e-9)


def test_a_ball_that_stops_takes_its_row_with_it() -> None:
    """Those that touch it and move with it; and whatever turns no faster than rounding says."""
    random, taken, alone = np.random.default_rng(10), 0, 0
    for _ in range(40):
        here = instant(random, {**RUBBING, **TOUCHING}, together=0.5)
        order = here.order
        rates = here.state[here.layout.rates]
        i = int(random.integers(N))
        if rates[i] == 0.0:
            continue
        place, row = int(np.flatnonzero(order == i)[0]), {i}
        for step in (1, -1):
            k = place if step == 1 else (place - 1) % N
            while here.discrete[k, JOINED] and len(row) < N:
                row.add(order[(k + 1) % N] if step == 1 else order[k])
                k = (k + step) % N
        small = 1e-12 * np.sign(rates[i])
        for j in row:
            rates[j] = small
        others = rates.copy()
        here.evaluate()
        solve_complementarity(here.run, 0.0, SLIDE * N + i, False)
        for j in range(N):
            assert here.state[here.layout.rates][j] == (0.0 if j in row else others[j])
        taken += len(row) > 1
        alone += len(row) == 1
    assert taken > 3 and alone > 3


def test_rows_lose_the_gaps_that_rounding_has_made() -> None:
    random, closed = np.random.default_rng(11), 0
    for _ in range(15):
        here = instant(random, {**OVAL, **TOUCHING})
        order = here.order
        here.state[here.layout.angles] += random.normal(0.0, 1e-9, N)
        before = here.state[here.layout.angles].copy()
        joined = here.discrete[:N, JOINED].copy()
        here.evaluate()
        solve_complementarity(here.run, 0.0, 0, False)
        gaps = here.chain.gaps(here.model.theta(here.coordinates()[0]))
        for k in np.flatnonzero(joined):
            contact = int(np.flatnonzero(here.chain.behind == order[k])[0])
            assert gaps[contact] == pytest.approx(0.0, abs=1e-14)
            closed += 1
        assert np.abs(here.state[here.layout.angles] - before).max() < 1e-8
        alone = [j for j in range(N) if not joined[[np.flatnonzero(order == j)[0] - 1]]]
        np.testing.assert_array_equal(here.state[here.layout.angles][alone], before[alone])
    assert closed > 5
