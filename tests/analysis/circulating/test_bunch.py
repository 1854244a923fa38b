"""Circulating bunches in closed form: as the equations have them, and as long runs do."""

import cmath
from typing import Any

import numpy as np
import pytest

from ab_sim.analysis.circulating import (
    bunches,
    drive_of,
    reason_not_covered,
    stalled,
    state_of_bunch,
)
from ab_sim.analysis.circulating.bunch import MOST_SWING
from ab_sim.analysis.equilibria.resting import field_at, resting_system
from ab_sim.scene import Scene, load_scene
from tests.analysis.circulating.runs import AT, mean_speeds, stalling
from tests.analysis.equilibria.drives import drive


def known(scene: Scene, speed: float, count: int) -> Any:
    numbers = drive_of(scene)
    assert numbers is not None
    return stalled(numbers, speed, count)


def test_six_balls_of_four_grams_turn_at_307() -> None:
    found = known(stalling(), AT, 6)
    assert found.speed == pytest.approx(307.3001179, rel=1e-9)
    assert found.stable and found.lambda_max == pytest.approx(-6.25)
    assert mean_speeds(stalling(), AT, found) == pytest.approx(found.speed, rel=1e-4)


@pytest.mark.parametrize("rolls", [False, True])
@pytest.mark.parametrize("count", [2, 3, 4, 5])
def test_others_may_rest_on_the_rotor(rolls: bool, count: int) -> None:
    """Each number has a speed of its own: what rests swings, and changes the deck's inertia."""
    scene = stalling(rolls=rolls)
    found = known(scene, AT, count)
    run = mean_speeds(scene, AT, found)
    assert run[:count] == pytest.approx(found.speed, rel=2e-5)
    assert run[count:] == pytest.approx(AT, rel=3e-4)


def test_one_ball_does_not_circulate_there() -> None:
    assert known(stalling(), AT, 1) is None


@pytest.mark.parametrize(
    ("changes", "speed", "count"),
    [
        ({"c": 60.0}, 700.0, 6),
        ({"c": 5.0, "rolls": True}, 2500.0, 3),
        ({"cb": 0.15, "rolls": True}, 1400.0, 6),
        ({"cb": 0.005}, 900.0, 6),
        ({"m": (2e-3,) * 12, "cb": 0.01}, 900.0, 12),
        ({"m": (2e-2,), "me": 3e-4, "cb": 0.1}, 800.0, 1),
        ({"m": (2e-2,) * 2, "M": 3.0, "k": 2e5, "c": 50.0, "cb": 0.2, "rolls": True}, 1500.0, 2),
        ({}, -AT, 6),
        ({}, -AT, 4),
    ],
)
def test_speeds_are_those_of_long_runs(changes: dict[str, Any], speed: float, count: int) -> None:
    scene = stalling(**changes)
    found = known(scene, speed, count)
    swing = max(found.bunch_swing, found.resting_swing)
    run = mean_speeds(scene, speed, found)[:count]
    assert run == pytest.approx(found.speed, rel=1e-6 + swing**2)


@pytest.mark.parametrize("me", [3e-4, 6e-4, 8e-4])
def test_what_is_neglected_is_of_the_order_of_swings_squared(me: float) -> None:
    scene = stalling(me=me, rolls=True)
    found = known(scene, AT, 6)
    run = mean_speeds(scene, AT, found)[0]
    off = run / found.speed - 1.0
    assert found.bunch_swing <= MOST_SWING
    assert 0.03 * found.bunch_swing**2 < off < 0.1 * found.bunch_swing**2


@pytest.mark.parametrize("rolls", [False, True])
@pytest.mark.parametrize("which", [0, 1, 2])
def test_without_unbalance_they_are_exact_and_so_are_their_growth_rates(
    rolls: bool, which: int
) -> None:
    """In axes that turn at s the running equations rest, and their Jacobian says the rest."""
    scene = stalling(rolls=rolls)
    numbers = drive_of(scene)
    assert numbers is not None
    bunch = bunches(numbers, AT, 6)[which]
    system = resting_system(scene)
    balanced = system.deck_model._replace(unbalance=0.0, eccentricity=0.0)
    system = system._replace(deck_model=balanced)
    field, state = field_at(system, AT), state_of_bunch(system, bunch)
    # What turning with the rotor at s - w changes.
    slip, turn = bunch.speed - AT, np.zeros((len(state), len(state)))
    turn[:4, :4] = np.kron(np.eye(2), [[0.0, -1.0], [1.0, 0.0]])
    moved = slip * turn @ state
    moved[4:10] = slip
    slope = field.slope(0.0, state) - moved
    assert np.abs(slope).max() < 1e-8 * AT * AT * bunch.W
    values = np.linalg.eigvals(field.jacobian(0.0, state) - slip * turn)
    left = list(np.delete(values, int(np.argmin(np.abs(values)))))
    for value in bunch.eigenvalues:
        near = int(np.argmin(np.abs(np.array(left) - value)))
        assert abs(left.pop(near) - value) < 2e-5 * AT
    assert bunch.stable == (values.real.max() < 1e-3) == (which == 0)


def test_power_and_forces_are_in_balance() -> None:
    numbers = drive_of(stalling())
    assert numbers is not None
    for bunch in bunches(numbers, AT, 6):
        s = bunch.speed
        given = 6 * 0.05 * 0.015**2 * (AT - s)
        assert given == pytest.approx(20.0 * s * bunch.W**2, rel=1e-9)
        pull = s * s * 6 * 4e-3 * 0.015 * cmath.exp(1j * bunch.angle)
        assert complex(58800.0 - 0.524 * s * s, 20.0 * s) * bunch.W == pytest.approx(pull, rel=1e-9)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"m": (4e-3, 3e-3)}, "balls.mass: the balls differ"),
        ({"cb": 0.0}, "without drag nothing drives"),
        ({"rolls": True, "k3": 1e6}, "effects.hardening_suspension"),
        ({"effects": {"gravity": {"tilt": 1.5}}}, "effects.gravity"),
        ({"effects": {"race_runout": {"offset_1": 1e-5}}}, "does not cover"),
    ],
)
def test_where_it_is_not_looked_for(changes: dict[str, Any], words: str) -> None:
    scene = stalling(**changes)
    assert words in str(reason_not_covered(scene)) and drive_of(scene) is None


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("feeding-deck", "deck"),
        ("no-ball", "there are no balls"),
        ("weak-motor", "effects.motor"),
        ("packed-balls", "effects.ball_contact"),
    ],
)
def test_scenes_that_ship_and_are_not_known(name: str, words: str) -> None:
    assert words in str(reason_not_covered(load_scene(name)))


def test_nothing_circulates_about_a_rotor_at_rest_and_counts_are_checked() -> None:
    numbers = drive_of(drive())
    assert numbers is not None
    assert bunches(numbers, 0.0, 1) == []
    for count in (0, 3):
        with pytest.raises(ValueError, match=f"count = {count}: .* 1 to 2"):
            bunches(numbers, 100.0, count)
