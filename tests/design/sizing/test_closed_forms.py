"""Balls that balance and fit, growth rates, borders of drag: against closed forms."""

import math

import numpy as np
import pytest

from ab_sim.analysis.circulating import drag_ranges, drive_of
from ab_sim.analysis.equilibria import equilibria_of
from ab_sim.design.sizing.claims import bunch_stays, scene_of, step_at, with_contact
from ab_sim.design.sizing.closed_forms import (
    FittingBalls,
    balanced_places,
    ball_radius,
    balls_of,
    couplings,
    drive_of_balls,
    largest_ball,
    largest_growth,
    least_mass,
)
from ab_sim.design.sizing.drag_window import (
    ABOVE_BORDER,
    circulation_border,
    predicted_share,
    sized_balls,
)
from tests.design.sizing.wanted import wanted

HEAVY = {"unbalance": "2 g cm", "race_width": "8 mm"}


def test_two_small_balls_just_balance_where_2_m_R_is_U() -> None:
    """Dense balls are small, and side by side as if at one place."""
    asked = wanted(density=25000.0, unbalance=1e-10)
    mass = least_mass(2, 1e-10, asked)
    assert mass is not None
    balls = balls_of(2, mass, asked)
    assert 2.0 * mass * (0.012 - balls.radius) == pytest.approx(1e-10, rel=1e-4)
    assert balls.moment > 1e-10 and balls.in_a_row == pytest.approx(1e-10, rel=1e-9)


def test_a_row_balances_what_its_vectors_add_up_to() -> None:
    balls = FittingBalls(5, 2e-4, 2e-3, 0.01)
    apart = 2.0 * math.asin(2e-3 / 0.01)
    angles = apart * (np.arange(5) - 2.0)
    assert balls.in_a_row == pytest.approx(abs(np.sum(2e-6 * np.exp(1j * angles))), rel=1e-12)
    # Neighbours touch.
    assert 0.02 * math.sin(0.5 * apart) == pytest.approx(2.0 * balls.radius)


def test_a_steel_ball_of_one_millimetre() -> None:
    assert ball_radius(7850.0 * 4.0 / 3.0 * math.pi * 1e-9, 7850.0) == pytest.approx(1e-3)


@pytest.mark.parametrize(("count", "width", "radius"), [(2, 4e-3, 2e-3), (6, 12e-3, 4e-3)])
def test_the_largest_balls_touch_the_sides_or_each_other(
    count: int, width: float, radius: float
) -> None:
    """Six equal balls around fill a wall of three times their radius."""
    asked = wanted(race_width=width)
    mass = largest_ball(count, asked)
    assert ball_radius(mass, asked.density) == pytest.approx(radius)


def test_where_none_fit_it_says_what_to_change() -> None:
    asked = wanted(unbalance="2 g cm")
    assert least_mass(3, asked.largest_unbalance, asked) is None
    found = sized_balls(3, asked)
    assert found.balls is None and "the largest 3 balls that fit, 4 mm wide" in str(
        found.reason_unsuitable
    )


@pytest.mark.parametrize("count", [2, 3, 5])
@pytest.mark.parametrize("drag", [1e-3, 2e-2])
def test_growth_rates_are_those_of_the_running_equations(count: int, drag: float) -> None:
    asked = wanted()
    mass = least_mass(count, asked.largest_unbalance, asked)
    assert mass is not None
    balls = balls_of(count, 1.5 * mass, asked)
    scene = scene_of(balls, asked, drag)
    states = [s for s in equilibria_of(scene, asked.speed).branches if "balanced" in s.label]
    assert len(states) == (1 if count == 2 else 3)
    for state in states:
        drive = drive_of_balls(balls, asked, drag)
        rho = np.array([abs(np.exp(2j * state.theta).mean())])
        found = largest_growth(drive, asked.speed, couplings(drive, rho))
        assert found[0] == pytest.approx(state.lambda_max, rel=1e-6, abs=1e-7)


def test_numbers_of_a_drive_are_those_of_its_scene() -> None:
    asked = wanted()
    balls = balls_of(4, 1e-4, asked)
    numbers = drive_of(scene_of(balls, asked, 2e-3))
    assert numbers is not None
    assert numbers == pytest.approx(drive_of_balls(balls, asked, 2e-3), rel=1e-12)


def test_places_balance_their_rotors() -> None:
    asked = wanted()
    mass = least_mass(2, asked.largest_unbalance, asked)
    assert mass is not None
    balls = balls_of(2, 1.3 * mass, asked)
    places = balanced_places(balls, asked)
    # Two balls at +-beta: cos beta = -U / (2 m R), rho = |cos 2 beta|.
    cosine = places.unbalances / balls.moment
    assert places.rhos == pytest.approx(np.abs(2.0 * cosine**2 - 1.0), abs=1e-6)


def test_of_fewer_balls_the_border_lies_in_proportion_lower() -> None:
    asked = wanted()
    drive = drive_of_balls(balls_of(3, 1.2e-4, asked), asked, 1.0)
    border = circulation_border(drive, asked.speed)
    start = drive._replace(drag=border)
    highest = [
        max(reach.high for reach in drag_ranges(start, asked.speed, count)) for count in (1, 2, 3)
    ]
    assert highest[2] == pytest.approx(border, rel=1e-6)
    assert highest[:2] == pytest.approx([border / 3, 2 * border / 3], rel=0.03)


def test_a_bunch_stays_below_the_border_and_comes_to_rest_above() -> None:
    asked = wanted()
    balls = balls_of(3, 1.2e-4, asked)
    border = circulation_border(drive_of_balls(balls, asked, 1.0), asked.speed)
    for factor, stays in ((0.97, True), (1.03, False)):
        scene = scene_of(balls, asked, factor * border)
        assert bunch_stays(scene, asked.speed, border * (1.0 - 1e-6)) == stays
    assert bunch_stays(with_contact(scene), asked.speed, border) is None


def test_the_share_falls_below_what_is_wanted_at_both_ends_of_a_window() -> None:
    asked = wanted()
    found = sized_balls(5, asked)
    assert found.balls is not None and found.window is not None and found.reason_unsuitable is None
    window = found.window
    assert window.low >= ABOVE_BORDER * found.border and window.low_end == "too slow"
    for end, outside in ((window.low, 0.98), (window.high, 1.02)):
        assert predicted_share(found.balls, asked, end) >= asked.share
        assert predicted_share(found.balls, asked, outside * end) < asked.share
    assert found.drag == pytest.approx(math.sqrt(window.low * window.high))


def test_windows_that_circulation_ends_below() -> None:
    """A weakly damped suspension lets balls circulate up to a larger drag."""
    found = sized_balls(6, wanted(settle="4 s", damping_ratio=0.02))
    assert found.window is not None and found.window.low_end == "circulation"
    assert found.window.low == pytest.approx(ABOVE_BORDER * found.border)


@pytest.mark.parametrize(
    ("count", "changes", "words"),
    [
        (2, {"settle": "1 s"}, "at no drag 90 % of drives are balanced in time"),
        (3, {"drag_tolerance": 0.8}, "tolerance of the drag, 80 %, exceeds the width"),
        (5, {**HEAVY, "damping_ratio": 0.01, "settle": "5 s"}, "balls circulate"),
    ],
)
def test_no_window_says_why(count: int, changes: dict[str, object], words: str) -> None:
    assert words in str(sized_balls(count, wanted(**changes)).reason_unsuitable)


@pytest.mark.parametrize(
    ("speed", "step"), [(200.0, 1e-3), (837.0, 2e-4), (1000.0, 2e-4), (50, 1e-3)]
)
def test_steps_are_round(speed: float, step: float) -> None:
    assert step_at(speed) == pytest.approx(step, rel=1e-12)
