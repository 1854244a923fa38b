"""Drag times 0, 10, 100 and 1000: its rate reaches 7e5 1/s, where explicit steppers blow up.

A naive fixed-step simulator needs steps of microseconds or is unstable, and one that treats drag
by plain splitting is stable but falls to first order. Asserted: the stepper is chosen for the drag
and says why, the energy balance closes, the independent simulator (Radau) agrees, and a tolerance
is kept; naming rk8 is refused with the settings that work, and they do.
"""

import re

import numpy as np
import pytest

from ab_sim.drive import Drive
from ab_sim.errors import SceneError
from tests.hard_cases.extremes import errors, fast, imbalance, run


@pytest.mark.parametrize(
    ("factor", "stepper"),
    [(0, "rk8"), (10, "collocation"), (100, "collocation"), (1000, "collocation")],
)
def test_drag_of_any_size(factor: float, stepper: str) -> None:
    drive = run(fast(effects={"viscous_drag": {"coefficient": float(factor)}}), 0.1)
    assert drive.stepper.name == stepper
    assert ("rk8 would need steps of at most" in drive.choice.reason) == (stepper != "rk8")
    assert imbalance(drive) < 1e-8
    balls, deck = errors(drive, "Radau" if factor else "DOP853")
    assert balls < 1e-8 and deck < 1e-8


@pytest.mark.parametrize("factor", [10.0, 1000.0])
def test_a_tolerance_is_kept_where_drag_is_stiff(factor: float) -> None:
    """Splitting the drag off would leave errors that fall with the step alone."""
    effects = {"viscous_drag": {"coefficient": factor}}
    tolerances = [1e-6, 1e-9, 1e-11, 1e-14]
    runs = []
    for tolerance in tolerances:
        solver = {"stepper": "collocation", "parameters": {"tolerance": tolerance}, "step": 2.5e-3}
        runs.append(run(fast(effects=effects, solver=solver), 0.5))
    last = [np.append(d.observe().theta, 100 * d.observe().u) for d in runs]
    missed = np.array([np.abs(x - last[-1]).max() for x in last[:-1]])
    assert np.all(missed < 10.0 * np.array(tolerances[:-1])), missed
    assert missed[0] > 0.0, "a setting that makes a difference"


def test_refusal_names_settings_that_work() -> None:
    effects = {"viscous_drag": {"coefficient": 10.0}}
    with pytest.raises(
        SceneError, match="leave solver.stepper to auto, or name collocation"
    ) as told:
        Drive(fast(effects=effects, solver={"stepper": "rk8"}))
    found = re.search(r"use at most (\S+) s", str(told.value))
    assert found is not None
    step = float(found.group(1))
    small = run(fast(effects=effects, solver={"stepper": "rk8", "step": step}), 2000 * step)
    auto = run(fast(effects=effects), 0.1)
    # At the stability limit itself the first milliseconds are stable, not accurate.
    assert imbalance(small) < 1e-5 and imbalance(auto) < 1e-8
