"""Where friction makes events within steps, the steppers keep their order."""

import numpy as np
import pytest

from ab_sim.drive import Drive
from tests.effects.parts import Changes, scene_of

HOLD: Changes = {
    "start": {"speed": 0.0},
    "profile": {
        "variable_speed_period": {"start_speed": 95.0, "duration": 0.5, "acceleration": 0.0},
        "kind": "start_up",
        "acceleration": 40.0,
        "target_speed": 120.0,
    },
    "spindle": {"max_speed": 150.0},
}
"""The thesis' start-up with a hold near the critical speed, and friction."""
TIME = 2.8
LOOKED_AT = 0.08
"""s: a whole number of each of the steps."""


def angles(stepper: str, step: float, arm: float) -> tuple[np.ndarray, int]:
    rough: Changes = {"effects": {"rolling_friction": {"arm": arm}}}
    solver: Changes = {"solver": {"stepper": stepper, "step": step}}
    drive = Drive(scene_of("friction", HOLD, rough, solver), energy_balance=True)
    run = drive.advance(round(TIME / step))
    assert drive.steps_with_unresolved_events == 0
    every = round(LOOKED_AT / step)
    return run.ball_angles[every - 1 :: every], drive.events


@pytest.mark.parametrize("arm", [1e-6, 1e-5])
@pytest.mark.parametrize(
    ("stepper", "steps", "order"),
    [
        ("rk4", [2e-3, 1e-3, 5e-4, 2.5e-4], 3.5),
        ("rk8", [5e-3, 4e-3, 3.2e-3, 2.5e-3], 7.0),
    ],
)
def test_order_of_convergence_with_events(
    stepper: str, steps: list[float], order: float, arm: float
) -> None:
    exact, events = angles("rk8", 2.5e-4, arm)
    assert events > 5, "there are events"
    errors = []
    for step in steps:
        got, met = angles(stepper, step, arm)
        assert met == events
        errors.append(np.abs(got - exact).max())
    assert min(errors) > 2e-13, f"above rounding: {errors}"
    measured = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert measured > order, f"order {measured:.2f}: {errors}"
