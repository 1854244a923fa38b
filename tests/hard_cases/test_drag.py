"""Drag times 0 to 10,000: its rate reaches 7e6 1/s, where explicit steppers blow up.

A naive fixed-step simulator needs steps of microseconds or is unstable, and one that treats drag
by plain splitting is stable but falls to first order. Asserted: the stepper is chosen for the drag
and says why, the energy balance closes, the independent simulator (Radau) agrees, and a tolerance
is kept; naming rk8 is refused with the settings that work, and they do.
"""

import re

import numpy as np
import pytest

from ab_sim.base.errors import SceneError
from ab_sim.drive import Drive
from tests.hard_cases.extremes import errors, fast, imbalance, run


@pytest.mark.parametrize(
    ("factor", "stepper"),
    [(0, "rk8"), (10, "rk8"), (100, "imex8"), (10_000, "imex8")],
)
def test_drag_of_any_size(factor: float, stepper: str) -> None:
    # Radau, the reference's method for stiff drag, takes seconds for 0.1 s.
    time = 0.03 if stepper == "imex8" else 0.1
    drive = run(fast(effects={"viscous_drag": {"coefficient": float(factor)}}), time)
    assert drive.stepper.name == stepper
    assert ("rk8 would need steps of at most" in drive.choice.reason) == (factor > 0)
    assert imbalance(drive) < 1e-8
    balls, deck = errors(drive, "Radau" if stepper == "imex8" else "DOP853")
    assert balls < 1e-8 and deck < 1e-8


@pytest.mark.parametrize("factor", [10.0, 1000.0])
def test_errors_fall_with_the_step_where_drag_is_stiff(factor: float) -> None:
    """Stiffness reduces the order 8, but not to that of a splitting method."""
    effects = {"viscous_drag": {"coefficient": factor}}
    steps = [2.5e-3, 1.25e-3, 2.5e-4]
    runs = [
        run(fast(effects=effects, solver={"stepper": "imex8", "step": step}), 0.5) for step in steps
    ]
    last = [np.append(d.observe().theta, 100 * d.observe().u) for d in runs]
    coarse, fine = (np.abs(x - last[-1]).max() for x in last[:-1])
    assert coarse < 1e-7 and fine < coarse / 2**4, (coarse, fine)


def test_refusal_names_settings_that_work() -> None:
    effects = {"viscous_drag": {"coefficient": 10.0}}
    with pytest.raises(SceneError, match="leave solver.stepper to auto") as told:
        Drive(fast(effects=effects, solver={"stepper": "rk8"}))
    found = re.search(r"use at most (\S+) s", str(told.value))
    assert found is not None
    step = float(found.group(1))
    small = run(fast(effects=effects, solver={"stepper": "rk8", "step": step}), 2000 * step)
    auto = run(fast(effects=effects), 0.1)
    # At the stability limit itself the first milliseconds are stable, not accurate.
    assert imbalance(small) < 1e-5 and imbalance(auto) < 1e-8
