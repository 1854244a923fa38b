"""Generalized-alpha: its order, its damping of what is fast, and what it shares with the others."""

import itertools

import numpy as np
import pytest

from ab_sim.base.errors import DivergedError, SceneError
from ab_sim.drive import Drive
from ab_sim.engine.integrate.choose import stability_limit
from ab_sim.engine.integrate.registry import stepper_named
from ab_sim.scene import load_scene

NAME = "generalized-alpha"
RADII = (0.0, 0.3, 0.8, 1.0)
RUN_UP = [
    "start.speed=100",
    "start.ball_angles=[2.0,-1.0]",
    f"solver.stepper={NAME}",
]


def drive_with(rho: float, step: float, *changes: str) -> Drive:
    own = [f"solver.parameters.rho_inf={rho}", f"solver.step={step}"]
    return Drive(load_scene("nsc-case-1", [*RUN_UP, *own, *changes]))


def reference(time: float) -> np.ndarray:
    changes = [*RUN_UP[:2], "solver.stepper=rk8", "solver.step=1e-4"]
    return Drive(load_scene("nsc-case-1", changes)).advance(round(time / 1e-4)).ball_angles[-1]


@pytest.mark.parametrize("rho", RADII)
def test_its_order_is_two_whatever_it_damps(rho: float) -> None:
    true, steps = reference(0.1), (1e-4, 5e-5, 2.5e-5)
    found = [drive_with(rho, h).advance(round(0.1 / h)).ball_angles[-1] for h in steps]
    errors = [np.abs(angles - true).max() for angles in found]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert orders == pytest.approx(2.0, abs=0.05), errors


@pytest.mark.parametrize("rho", RADII)
def test_any_step_is_stable_and_what_is_infinitely_fast_is_left_by_rho(rho: float) -> None:
    made = stepper_named(NAME, {"rho_inf": rho})
    for direction in (-1.0, 1j, np.exp(2.0j)):
        assert stability_limit(made, direction) == np.inf
        # The roots are double there: they come near with the root of what is left.
        assert abs(made.growth(1e14 * direction)) == pytest.approx(rho, abs=1e-5)


@pytest.mark.parametrize("rho", RADII)
def test_a_deck_that_vibrates_much_faster_than_the_steps_is_damped_by_rho(rho: float) -> None:
    """x, x' of each step solve x_k+2 + 2 rho x_k+1 + rho^2 x_k = 0, a double root at -rho.

    Periods of the deck take a ten-thousandth of a step; the spindle and the balls stand.
    """
    step = 0.1
    drive = drive_with(
        rho,
        step,
        "start.speed=0",
        "profile=",
        "effects.suspension.stiffness=1e12",
        "effects.suspension.damping=0",
        "start.deck.position=[1e-6,0]",
        "balls.mass=1e-9",
    )
    run = drive.advance(12)
    x = np.concatenate([[1e-6], run["x"]])
    left = x[2:] + 2.0 * rho * x[1:-1] + rho**2 * x[:-2]
    assert np.abs(left).max() < 1e-8 * np.abs(x).max()
    assert abs(x[1]) > 0.4 * abs(x[0]), "and not at once"


def test_grouping_steps_changes_no_bit() -> None:
    one, other = drive_with(0.8, 1e-4), drive_with(0.8, 1e-4)
    whole = one.advance(60)
    parts = [other.advance(n) for n in (1, 7, 0, 30, 22)]
    snapshot = other.snapshot()
    np.testing.assert_array_equal(whole.samples, np.concatenate([p.samples for p in parts]))
    ahead = other.advance(20).samples
    other.restore(snapshot)
    np.testing.assert_array_equal(other.advance(20).samples, ahead)
    np.testing.assert_array_equal(one.advance(20).samples, ahead)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("solver.parameters.rho_inf=1.5", "solver.parameters.rho_inf = 1.5: .* 0 to 1"),
        ("solver.parameters.rho=0.5", "no such parameter.*rho_inf"),
        ("effects.race_friction.coefficient=1e-5", "cut at events"),
    ],
)
def test_what_it_cannot_is_refused(change: str, words: str) -> None:
    with pytest.raises(SceneError, match=words):
        drive_with(0.8, 1e-4, change)


def test_a_step_without_a_solution_is_told() -> None:
    """The balls cannot be followed: no iteration ends."""
    drive = drive_with(0.8, 0.05, "start.ball_rates=[30.0,-30.0]", "start.deck.velocity=[50,0]")
    with pytest.raises(DivergedError, match="beyond all bounds"):
        drive.advance(200)


def test_the_deck_in_space_goes_as_with_runge_and_kutta() -> None:
    """deck-3d's time responses: what it was computed with there, beside ours."""
    common = ["start.deck.position=[1e-4,0,0]"]
    time = 0.2
    true = Drive(load_scene("feeding-deck", [*common, "solver.stepper=rk8", "solver.step=2.5e-4"]))
    exact = true.advance(round(time / 2.5e-4)).ball_angles[-1]
    errors = []
    for step in (4e-4, 2e-4):
        changes = [*common, f"solver.stepper={NAME}", f"solver.step={step}"]
        found = Drive(load_scene("feeding-deck", changes)).advance(round(time / step))
        errors.append(np.abs(found.ball_angles[-1] - exact).max())
    for coarse, fine in itertools.pairwise(errors):
        assert np.log2(coarse / fine) == pytest.approx(2.0, abs=0.2), errors
    assert errors[-1] < 0.05
