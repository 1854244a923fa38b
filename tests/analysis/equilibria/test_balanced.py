"""The balanced set and its positions."""

import numpy as np
import pytest
from gallery.three_ball.drive import drive as three_balls
from scipy.optimize import minimize_scalar

from ab_sim.analysis.equilibria import equilibria_of
from ab_sim.analysis.equilibria.at_speed import balanced_state
from ab_sim.analysis.equilibria.balanced import (
    can_balance,
    completed,
    doubling,
    ends,
    growths,
    positions,
    positions_at,
    symmetric,
)
from ab_sim.analysis.equilibria.resting import ClosedFormRotor, resting_system, rotor_of
from ab_sim.base.presentation import in_one_turn
from tests.analysis.equilibria.drives import altered, base, drive


def rotor(*moments: float, unbalance: float = 1.0) -> ClosedFormRotor:
    kinds = tuple(sorted({*moments}).index(x) for x in moments)
    return ClosedFormRotor(1.0, unbalance, 1.0, 0.0, 0.0, moments, kinds)


@pytest.mark.parametrize(
    "moments",
    [(1.0,), (0.7, 0.7), (0.9, 0.5), (0.4,) * 3, (0.9, 0.5, 0.3), (0.3,) * 6, (0.04,) * 64],
)
def test_positions_balance(moments: tuple[float, ...]) -> None:
    found = positions(rotor(*moments))
    assert len(found) == 1 if len(moments) < 3 else len(found) > 15
    np.testing.assert_allclose(np.exp(1j * found) @ np.array(moments), -1.0, atol=1e-13)


def test_which_balls_can_balance() -> None:
    assert can_balance(rotor(0.5, 0.5))
    assert not can_balance(rotor(0.49, 0.49))
    assert not can_balance(rotor(2.6, 0.8, 0.7)), "one outdoes all the others and the rotor"
    assert not can_balance(rotor(0.5))


def test_given_balls_are_completed() -> None:
    """As the three-ball paper's (34), where the third is given."""
    eta, third = 0.4, 2.6
    found = completed(rotor(eta, eta, eta), np.array([third]))
    assert found is not None
    far = np.sqrt(eta**2 + 2.0 * eta * np.cos(third) + 1.0)
    turned = np.arctan2(eta * np.sin(third), eta * np.cos(third) + 1.0)
    aside = np.arccos(far / (2.0 * eta))
    expected = np.exp(1j * np.array([np.pi - aside + turned, np.pi + aside + turned, third]))
    np.testing.assert_allclose(np.exp(1j * found), expected, atol=1e-14)
    assert completed(rotor(eta, eta, eta), np.array([0.3])) is None, "(32)"


def test_of_equal_balls_one_number_of_a_position_counts() -> None:
    """Positions with the same rho have the same eigenvalues, wherever the balls are."""
    scene = drive(m=(3e-4,) * 4)
    system = resting_system(scene)
    own = rotor_of(system)
    assert own is not None
    draw = np.random.default_rng(3)
    by_rho = [(doubling(own, x), balanced_state(system, own, 120.0, x)) for x in positions(own)]
    rhos = np.array(sorted(rho for rho, _ in by_rho))
    growth = np.array([s.lambda_max for _, s in sorted(by_rho, key=lambda each: each[0])])
    assert np.ptp(growth) > 1e-3, "it does count"
    compared = 0
    for _ in range(600):
        place = completed(own, draw.uniform(-np.pi, np.pi, 2))
        if place is None:
            continue
        rho = doubling(own, place)
        assert rhos[0] - 1e-9 <= rho <= rhos[-1] + 1e-9, "the ends are the ends"
        state = balanced_state(system, own, 120.0, place)
        k = min(max(int(np.searchsorted(rhos, rho)), 1), len(rhos) - 1)
        low, high = sorted((growth[k - 1], growth[k]))
        assert low - 1e-3 * np.ptp(growth) <= state.lambda_max <= high + 1e-3 * np.ptp(growth)
        compared += 1
    assert compared > 10


def test_structural_zeros_are_only_on_the_balanced_set() -> None:
    for n in (1, 2, 3, 5):
        found = equilibria_of(drive(m=(1.5e-3 / n,) * n), 150.0)
        for state in found.branches:
            balanced = state.label.startswith("balanced")
            assert state.structural_zeros == (max(0, n - 2) if balanced else 0)
            sizes = np.sort(np.abs(state.eigenvalues))
            assert (sizes[: state.structural_zeros] < 1e-9).all()
            assert (sizes[state.structural_zeros :] > 1e-6).all()


def test_worst_and_best_frame_the_symmetric_position() -> None:
    states = {s.label: s for s in equilibria_of(drive(m=(4e-4,) * 4), 120.0).branches}
    middle = states["balanced"].lambda_max
    assert states["balanced, best"].lambda_max <= middle <= states["balanced, worst"].lambda_max
    own = rotor_of(resting_system(drive(m=(4e-4,) * 4)))
    assert own is not None
    np.testing.assert_allclose(states["balanced"].theta, in_one_turn(symmetric(own)))


def test_worst_and_best_are_of_all_positions() -> None:
    """Of three balls all positions are those of the third, which is turned finely here."""
    scene, speed = three_balls(0.8, 3, 0.051, 0.0332), 0.5
    system = resting_system(scene)
    own = rotor_of(system)
    assert own is not None

    def growth(third: float) -> float:
        place = completed(own, np.array([third]))
        return np.inf if place is None else balanced_state(system, own, speed, place).lambda_max

    grid = np.linspace(-np.pi, np.pi, 2001)
    seen = np.array([growth(third) for third in grid.tolist()])
    k = int(seen.argmin())
    least = minimize_scalar(growth, bounds=(grid[k - 1], grid[k + 1]), method="bounded",
                            options={"xatol": 1e-9}).fun  # fmt: skip
    found = equilibria_of(scene, speed)
    states = {state.label: state.lambda_max for state in found.branches}
    assert states["balanced, best"] == pytest.approx(least, abs=1e-9)
    assert states["balanced, worst"] >= seen[np.isfinite(seen)].max() - 1e-12
    sampled = min(balanced_state(system, own, speed, x).lambda_max for x in positions(own))
    assert sampled > 1.001 * least, "samples miss it"
    assert found.balanced_positions == found.report()["balanced_positions"] == "all"


@pytest.mark.parametrize("n", [3, 4, 6])
def test_growth_by_rho_is_that_of_positions(n: int) -> None:
    """On systems at random, worst and best frame all samples, and the ends are met."""
    draw, given = np.random.default_rng(n), base()
    compared = 0
    while compared < 8:
        system = altered(given, draw)
        own = rotor_of(system)
        assert own is not None
        if len(system.balls) != n or len({*own.kinds}) > 1 or not can_balance(own):
            continue
        low, high = ends(own)
        if doubling(own, high) - doubling(own, low) < 1e-3:
            continue
        speed = (own.stiffness / own.mass) ** 0.5 * float(draw.uniform(0.3, 4.0))
        places = positions(own)
        states = [balanced_state(system, own, speed, place) for place in places]
        reduced = growths(system, speed, low)(np.array([doubling(own, x) for x in places]))
        full = np.array([state.lambda_max for state in states])
        alone = min(state.lambda_max - r for state, r in zip(states, reduced, strict=True))
        scale = np.abs(states[0].eigenvalues).max()
        assert alone > -1e-9 * scale
        # Where the others decay faster, motions that do not reach the deck are the slowest.
        same = np.abs(full - reduced) <= 1e-9 * scale
        assert same.all() or np.ptp(full[~same]) <= 1e-9 * scale
        two = [balanced_state(system, own, speed, x).lambda_max
               for x in positions_at(system, own, speed)[1:]]  # fmt: skip
        assert two[1] - 1e-9 * scale <= full.min() and full.max() <= two[0] + 1e-9 * scale
        compared += 1


def test_of_balls_that_differ_positions_are_sampled() -> None:
    found = equilibria_of(drive(m=(3e-4, 4e-4, 5e-4)), 120.0)
    assert found.balanced_positions == found.report()["balanced_positions"] == "sampled"
    assert equilibria_of(drive(), 120.0).balanced_positions is None


def test_no_unbalance_leaves_a_turn_free() -> None:
    """Two balls opposite each other, at any angle."""
    (state,) = (s for s in equilibria_of(drive(me=0.0), 150.0).branches if s.label == "balanced")
    assert state.structural_zeros == 1
    assert state.stable
    assert abs(np.diff(state.theta))[0] == pytest.approx(np.pi)
