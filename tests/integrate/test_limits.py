"""The stability limit: where it lies, and that a step beyond it is refused with a way out."""

import cmath
import re
from typing import Any

import numpy as np
import pytest

from ab_sim.drive import Drive
from ab_sim.dynamics.assemble import drag_rate, linear_rates
from ab_sim.errors import DivergedError, SceneError
from ab_sim.integrate import STEPPERS
from ab_sim.integrate.limits import largest_step, stability_limit


def test_rk4_has_its_textbook_limits() -> None:
    assert stability_limit("rk4") == pytest.approx(2.785293563405282, rel=1e-12)
    assert stability_limit("rk4", 1j) == pytest.approx(8**0.5, rel=1e-3)


def test_drag_rate_of_the_thesis_ball(scene: Any) -> None:
    """c_b/(m + I/a^2) = 714 1/s on a fixed deck; a free deck of 100 balls' mass adds 1.4 %."""
    rate = drag_rate(Drive(scene(solver={"step": 1e-4})).system)
    assert rate == pytest.approx(1 / (1.4e-3 - 2 * 1e-6 / 0.1), rel=1e-12)


def test_rates_of_the_thesis_deck(scene: Any) -> None:
    system = Drive(scene()).system
    rate = linear_rates(system, 500.0)["the deck's whirl at spindle.max_speed"]
    whirl = (1000 / 0.098 - (0.1 / 0.098) ** 2) ** 0.5
    assert rate.real == pytest.approx(-0.1 / 0.098)
    assert abs(rate.imag) == pytest.approx(whirl + 500.0)


@pytest.mark.parametrize("name", STEPPERS)
@pytest.mark.parametrize("factor", [0.99, 1.01])
def test_the_limit_is_where_the_balls_go_unstable(name: str, factor: float, scene: Any) -> None:
    """Two balls side by side on a deck at rest, disturbed: they calm down, or they do not."""
    drive = Drive(scene(profile=None, solver={"stepper": name, "step": 1e-4}))
    # Past the refusal, which is what is being tested here.
    drive.step = factor * stability_limit(name) / drag_rate(drive.system)
    start = drive.snapshot()
    start.state[6:] = 1e-6
    drive.restore(start)
    rates = drive.advance(100).ball_rates[:, 0]
    grown = np.abs(rates[-20:]).max() / np.abs(rates[:20]).max()
    assert (grown < 1) == (factor < 1)


@pytest.mark.parametrize("name", STEPPERS)
@pytest.mark.parametrize("factor", [0.99, 1.1])
def test_the_limit_is_where_the_deck_goes_unstable(name: str, factor: float, scene: Any) -> None:
    """No balls; the deck disturbed, at its top speed."""
    drive = Drive(
        scene(
            balls={"count": 0},
            rotor={"eccentricity": 0.0},
            start={"speed": 500.0},
            profile=None,
            solver={"stepper": name, "step": 1e-4},
        )
    )
    rates = linear_rates(drive.system, 500.0)
    drive.step = factor * largest_step(STEPPERS[name], rates)[0]
    start = drive.snapshot()
    start.state[:] = 1e-6
    drive.restore(start)
    try:
        whirl = drive.advance(2000).whirl
        grown = whirl[-100:].max() / whirl[:100].max()
    except DivergedError:
        grown = np.inf
    # A factor e^2 at the tolerated growth of 1e-3 per step.
    assert (grown < 8) == (factor < 1)


@pytest.mark.parametrize("name", STEPPERS)
@pytest.mark.parametrize("balls", [0, 2])
def test_refusal_names_a_step_that_is_accepted(name: str, balls: int, scene: Any) -> None:
    with pytest.raises(SceneError, match="beyond the stability limit") as caught:
        Drive(scene(balls={"count": balls}, solver={"stepper": name, "step": 0.05}))
    named = re.search(r"use at most (\S+) s", str(caught.value))
    assert named is not None
    step = float(named.group(1))
    drive = Drive(scene(balls={"count": balls}, solver={"stepper": name, "step": step}))
    rates = linear_rates(drive.system, 500.0).values()
    reach = max(
        abs(rate) * step / stability_limit(name, cmath.rect(1.0, cmath.phase(rate)))
        for rate in rates
        if rate
    )
    assert 0.95 < reach <= 1.01, reach


def test_hopeless_drag_is_told_apart(scene: Any) -> None:
    with pytest.raises(SceneError, match="lower the rate"):
        Drive(scene(effects={"viscous_drag": {"coefficient": 1e9}}))


def test_friction_that_one_step_cannot_follow_is_refused(scene: Any) -> None:
    friction = {"rolling_friction": {"arm": 5e-4}}
    with pytest.raises(SceneError, match="use a step of at most"):
        Drive(scene(effects=friction))
    Drive(scene(effects={"rolling_friction": {"arm": 1e-6}}))


def test_nothing_that_limits(scene: Any) -> None:
    free = {"viscous_drag": None, "suspension": None}
    Drive(scene(effects=free, spindle={"max_speed": 400.0}, solver={"step": 1e-3}))
    assert largest_step(STEPPERS["rk4"], {"nothing": 0j})[0] == np.inf
