"""Balls of 1e-9 kg up to all of the rotor's mass, and mass coupling that is nearly singular.

Light balls break simulators that divide by coupled masses or that scale tolerances by them; heavy
ones side by side leave the deck hardly any inertia of its own in the direction of motion, so that
the reduced mass matrix is a small difference of large numbers. Asserted: the independent simulator
agrees, energy balances; where the bare deck whirls too fast for rk8, the refusal names a step that
works.
"""

import re
from typing import Any

import pytest

from ab_sim.base.errors import SceneError
from ab_sim.drive import Drive
from tests.hard_cases.extremes import APART, errors, fast, imbalance, run


def of_mass(mass: float, angles: tuple[float, float], **changes: Any) -> Any:
    start = {"ball_angles": list(angles)}
    drag = {"viscous_drag": {"coefficient": mass / 1e-3}}
    return fast(balls={"mass": mass}, effects=drag, start=start, **changes)


@pytest.mark.parametrize("angles", [APART, (0.3, 0.3)])
@pytest.mark.parametrize("mass", [1e-9, 0.01, 0.049])
def test_balls_of_any_mass(mass: float, angles: tuple[float, float]) -> None:
    drive = run(of_mass(mass, angles), 0.1)
    assert imbalance(drive) < 1e-9
    balls, deck = errors(drive)
    assert balls < 1e-8 and deck < 1e-8


RK8 = {"stepper": "rk8"}


def test_balls_that_outweigh_the_deck_a_thousand_times() -> None:
    """The bare deck whirls faster than rk8 can follow, so auto divides the steps."""
    drive = run(of_mass(0.04999, APART), 0.1)
    assert drive.stepper.name == "rk8" and drive.stepper.parts > 1
    assert imbalance(drive) < 1e-9
    balls, deck = errors(drive)
    assert balls < 1e-8 and deck < 1e-8


def test_rk8_is_refused_there_and_sound_at_the_step_that_is_named() -> None:
    with pytest.raises(SceneError, match="deck's whirl") as told:
        Drive(of_mass(0.04999, APART, solver=RK8))
    found = re.search(r"use at most (\S+) s", str(told.value))
    assert found is not None
    step = float(found.group(1))
    drive = run(of_mass(0.04999, APART, solver={**RK8, "step": step}), 100 * step)
    assert imbalance(drive) < 1e-6


@pytest.mark.parametrize("stepper", ["rk8", "auto"])
def test_a_deck_of_next_to_no_mass_is_refused(stepper: str) -> None:
    with pytest.raises(SceneError, match="no rk8 step of useful"):
        Drive(of_mass(0.0499999999999, APART, solver={"stepper": stepper}))


def test_balls_as_heavy_as_everything_are_refused() -> None:
    with pytest.raises(SceneError, match="than the 2 balls' 0.1 kg"):
        of_mass(0.05, APART)
