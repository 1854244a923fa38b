"""The stability limit: where it lies, and that a step beyond it is refused with a way out."""

import re
from typing import Any

import numpy as np
import pytest

from ab_sim.drive import Drive
from ab_sim.dynamics.assemble import drag_rate
from ab_sim.errors import SceneError
from ab_sim.integrate import STEPPERS
from ab_sim.integrate.limits import real_stability_limit


def test_rk4_has_its_textbook_limit() -> None:
    assert real_stability_limit("rk4") == pytest.approx(2.785293563405282, rel=1e-12)


def test_drag_rate_of_the_thesis_ball(scene: Any) -> None:
    """c_b/(m + I/a^2) = 714 1/s on a fixed deck; a free deck of 100 balls' mass adds 1.4 %."""
    rate = drag_rate(Drive(scene(solver={"step": 1e-4})).system)
    assert rate == pytest.approx(1 / (1.4e-3 - 2 * 1e-6 / 0.1), rel=1e-12)


@pytest.mark.parametrize("name", STEPPERS)
@pytest.mark.parametrize("factor", [0.99, 1.01])
def test_the_limit_is_where_the_balls_go_unstable(name: str, factor: float, scene: Any) -> None:
    """Two balls side by side on a deck at rest, disturbed: they calm down, or they do not."""
    drive = Drive(scene(profile=None, solver={"stepper": name, "step": 1e-4}))
    # Past the refusal, which is what is being tested here.
    drive.step = factor * real_stability_limit(name) / drag_rate(drive.system)
    start = drive.snapshot()
    start.state[6:] = 1e-6
    drive.restore(start)
    rates = drive.advance(100).ball_rates[:, 0]
    grown = np.abs(rates[-20:]).max() / np.abs(rates[:20]).max()
    assert (grown < 1) == (factor < 1)


@pytest.mark.parametrize("name", STEPPERS)
def test_refusal_names_a_step_that_is_accepted(name: str, scene: Any) -> None:
    with pytest.raises(SceneError, match="beyond the stability limit") as caught:
        Drive(scene(solver={"stepper": name, "step": 0.05}))
    named = re.search(r"use at most (\S+) s", str(caught.value))
    assert named is not None
    drive = Drive(scene(solver={"stepper": name, "step": float(named.group(1))}))
    assert drive.step > 0.9 * real_stability_limit(name) / drag_rate(drive.system)


def test_no_drag_no_limit(scene: Any) -> None:
    Drive(scene(effects={"viscous_drag": None}, solver={"step": 0.05}))
    Drive(scene(balls={"count": 0}, solver={"step": 0.05}))
