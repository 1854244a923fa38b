"""Branches over speed: closed forms against continuation, and what is said of ranges."""

import numpy as np
import pytest

from ab_sim.analysis.equilibria import branches_over_speed, equilibria_of, kept_branches
from ab_sim.analysis.equilibria.resting import resting_system
from ab_sim.analysis.equilibria.traced import traced_branches
from ab_sim.base.errors import InputError, SceneError
from ab_sim.scene import load_scene
from tests.analysis.equilibria.drives import drive


def test_continuation_meets_the_closed_forms() -> None:
    """Folds and the Hopf point to 1e-8, and the same ranges."""
    scene, speeds = drive(), np.linspace(94.0, 108.0, 3)
    closed = branches_over_speed(scene, speeds)
    traced = traced_branches(resting_system(scene), speeds)
    assert [label for label, _ in traced.folds] == [label for label, _ in closed.folds]
    for (_, one), (_, two) in zip(closed.folds, traced.folds, strict=True):
        assert two.speed == pytest.approx(one.speed, rel=1e-10)
        assert two.W == pytest.approx(one.W, rel=1e-6)
        assert two.kind == one.kind
    (one,), (two,) = closed.crossings, traced.crossings
    assert two.label == one.label == "balanced"
    assert two.speed == pytest.approx(one.speed, rel=1e-8)
    np.testing.assert_allclose(traced.without_stable_state, closed.without_stable_state, rtol=1e-8)


def test_a_ball_that_is_too_heavy_has_speeds_without_any_state() -> None:
    over_speed = branches_over_speed(drive(m=(1.6e-3,)), np.linspace(50.0, 200.0, 16))
    ((low, high),) = over_speed.without_state
    folds = dict(over_speed.folds)
    assert low == pytest.approx(folds["1+0"].speed, rel=1e-9)
    assert high == pytest.approx(folds["0+1"].speed, rel=1e-9)
    assert equilibria_of(drive(m=(1.6e-3,)), 0.5 * (low + high)).branches == ()
    assert len(equilibria_of(drive(m=(1.6e-3,)), low * 0.999).branches) == 2


def test_a_hardening_spring_keeps_the_balanced_set_and_adds_a_resonant_state() -> None:
    linear, hard = drive(), drive(k3=2e8)
    speeds = np.linspace(60.0, 200.0, 12)
    one, two = (
        [each for each in branches_over_speed(s, speeds).crossings if each.label == "balanced"]
        for s in (linear, hard)
    )
    assert [each.speed for each in one] == pytest.approx([each.speed for each in two], rel=1e-12)
    stable = [state.label for state in equilibria_of(hard, 120.0).stable]
    assert "balanced" in stable
    assert len(stable) == 2, "and one that whirls"


def test_a_race_off_the_shaft() -> None:
    """Found by numbers; two balls can bring the race's centre, not the deck's, to rest."""
    scene = load_scene(
        "nsc-case-3", ["effects.race_runout={offset_1: 2e-6}", "effects.spindle_acceleration="]
    )
    found = equilibria_of(scene, 900.0)
    assert found.by_numbers
    (state,) = found.stable
    np.testing.assert_allclose(state.u, [-2e-6, 0.0], atol=1e-15)
    assert found.report()["by_numbers"]


def test_at_rest_and_without_balls() -> None:
    (state,) = equilibria_of(drive(), 0.0).branches
    assert (state.label, state.W, state.structural_zeros, state.stable) == ("standing", 0, 2, True)
    (alone,) = equilibria_of(drive(m=()), 150.0).branches
    assert (alone.label, alone.assignments, alone.stable) == ("no balls", 1, True)
    pull = 150.0**2 * 9.8e-6 / complex(1000.0 - 0.1 * 150.0**2, 0.2 * 150.0)
    np.testing.assert_allclose(alone.u, [pull.real, pull.imag], rtol=1e-12)


def test_sixty_four_balls() -> None:
    """Too light to balance: each of the 65 patterns has one state, and the last one is stable."""
    found = equilibria_of(drive(m=(1e-6,) * 64), 150.0)
    assert [state.label for state in found.branches] == [f"{64 - q}+{q}" for q in range(65)]
    assert all(len(state.eigenvalues) == 132 for state in found.branches)
    assert [state.label for state in found.stable] == ["64+0"]


def test_the_other_way_round_is_the_mirror_image() -> None:
    ahead, back = (equilibria_of(drive(), speed).branches for speed in (130.0, -130.0))
    for one, two in zip(ahead, back, strict=True):
        assert one.label == two.label
        np.testing.assert_allclose(two.u, one.u * [1.0, -1.0], rtol=1e-12, atol=1e-20)
        assert two.lambda_max == pytest.approx(one.lambda_max, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize(
    ("scene", "words"),
    [
        ("weak-motor", "effects.motor"),
        ("on-edge", "effects.gravity, effects.unequal_suspension: .*ab-sim floquet"),
        ("feeding-deck", "deck: the spindle's angle"),
    ],
)
def test_what_does_not_rest_is_refused_by_name(scene: str, words: str) -> None:
    with pytest.raises(SceneError, match=words):
        equilibria_of(load_scene(scene), 100.0)


def test_too_many_patterns_and_wrong_speeds() -> None:
    with pytest.raises(SceneError, match="8192 patterns; at most 4096"):
        equilibria_of(drive(m=tuple(1e-4 * (1.0 + 0.1 * k) for k in range(13))), 100.0)
    for speeds in ([], [1.0], [0.0, 1.0], [2.0, 1.0], [1.0, float("nan")]):
        with pytest.raises(InputError, match="rising"):
            branches_over_speed(drive(), np.array(speeds))


def test_balls_that_weigh_just_what_balances_end_in_the_balanced_set() -> None:
    """No fold: 2+0 reaches W = 0 at the critical speed; above it nothing is decided."""
    scene = load_scene("nsc-case-2", [])
    over_speed = branches_over_speed(scene, np.linspace(50.0, 400.0, 15))
    assert over_speed.folds == ()
    ((low, high),) = over_speed.without_stable_state
    assert low == pytest.approx(scene.critical_speed, rel=1e-9) and high == 400.0
    assert over_speed.undecided == [(low, high)]
    below = [s for s in over_speed.intervals if s.label == "2+0"]
    assert [s.speeds[-1] < scene.critical_speed * (1 + 1e-9) for s in below] == [True]


def test_a_continuum_found_by_numbers_has_a_worst_and_a_best_position() -> None:
    """Five balls that balance what a race off the shaft leaves: its positions differ in growth."""
    scene = load_scene(
        "five-balls-8000-rpm",
        ["effects.race_runout={offset_1: 2e-6}", "effects.rolling_friction="],
    )
    found = {state.label: state for state in equilibria_of(scene, 400.0).branches}
    one, worst, best = (found["continuum" + end] for end in ("", ", worst", ", best"))
    assert one.structural_zeros == worst.structural_zeros == best.structural_zeros == 3
    assert best.lambda_max <= one.lambda_max <= worst.lambda_max
    assert worst.lambda_max - best.lambda_max > 0.05 * abs(best.lambda_max)
    # The race's centre stays where the shaft would be without unbalance, whichever it is.
    for state in (one, worst, best):
        assert worst.W == pytest.approx(state.W, rel=1e-9)


def test_what_is_kept_is_what_was_found() -> None:
    scene, speeds = drive(m=(1.6e-3,)), np.linspace(50.0, 200.0, 9)
    found = branches_over_speed(scene, speeds)
    for _ in range(2):
        kept = kept_branches(scene, speeds)
        assert kept.report() == found.report()
        assert kept.without_state == found.without_state != []
