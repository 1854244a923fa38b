"""Every registered stepper: a new one needs only its steps in ``STEPS``."""

import itertools
from typing import Any

import numpy as np
import pytest

from ab_sim.base.errors import SceneError
from ab_sim.drive import Drive
from ab_sim.engine.integrate.registry import stepper_named, steppers
from ab_sim.engine.integrate.steppers.rk8 import RK8
from ab_sim.engine.kernels.runge_kutta import Tableau

TABLEAUX = {name: s for name, s in steppers().items() if isinstance(s.weights, Tableau)}

BAND = 0.3
"""How far the observed order may be from the declared one."""

STEPS = {
    "rk4": (1e-3, 5e-4, 2.5e-4),
    "tsit5": (2e-3, 1e-3, 5e-4),
    "rk8": (5e-3, 4e-3, 2.5e-3),
    "generalized-alpha": (2e-4, 1e-4, 5e-5),
    "imex8": (5e-3, 4e-3, 2.5e-3),
    "taylor": (1.25e-3, 1e-3, 8e-4),
}
"""Below the stability limit, above rounding; each divides the time asked for."""

UNTIL = {"imex8": 2.0}
"""Times before the hold [s], at whose kinks drag decays too fast for the order to show."""

PARAMETERS: dict[str, dict[str, float]] = {"taylor": {"order": 6, "steps": 1}}
"""Parameters of steppers whose own steps otherwise follow the motion."""


def state_at(scene: Any, profile: Any, stepper: str, step: float, time: float = 3.2) -> np.ndarray:
    """State after the run-up through the critical speed."""
    drive = Drive(
        scene(
            start={"ball_angles": [0.3, -0.9]},
            profile=profile,
            solver={
                "stepper": stepper,
                "step": step,
                "parameters": PARAMETERS.get(stepper, {}),
            },
        )
    )
    drive.advance(round(time / step))
    now = drive.observe()
    return np.concatenate([now.theta, 100 * now.u / 1e-2])


@pytest.fixture
def hold(with_hold: Any) -> Any:
    """A hold that is off every grid."""
    return with_hold(start_time=2.51234, duration=0.2)


@pytest.mark.parametrize("name", steppers())
def test_observed_order_is_the_declared_one(name: str, scene: Any, hold: Any) -> None:
    until = UNTIL.get(name, 3.2)
    exact = state_at(scene, hold, "rk8", 5e-4, until)
    errors = [
        np.abs(state_at(scene, hold, name, step, until) - exact).max() for step in STEPS[name]
    ]
    order = np.polyfit(np.log(STEPS[name]), np.log(errors), 1)[0]
    declared = stepper_named(name, PARAMETERS.get(name)).order
    assert order == pytest.approx(declared, abs=BAND), errors


def test_every_stepper_has_steps_to_try() -> None:
    assert set(STEPS) == set(steppers()), "a new stepper needs a line in STEPS"


@pytest.mark.parametrize("name", TABLEAUX)
def test_rooted_tree_conditions(name: str) -> None:
    """Butcher's conditions up to order 4, and the quadrature and tall-tree ones up to the order."""
    a, b, c = TABLEAUX[name].weights
    order = TABLEAUX[name].order
    assert np.array_equal(a, np.tril(a, -1)), "explicit"
    for q in range(1, order + 1):
        assert b @ c ** (q - 1) == pytest.approx(1 / q, rel=1e-12)
        tall = np.linalg.matrix_power(a, q - 1) @ np.ones(len(b))
        assert b @ tall == pytest.approx(1 / np.prod(np.arange(1, q + 1)), rel=1e-10)
    if order >= 4:
        assert b @ (c * (a @ c)) == pytest.approx(1 / 8, rel=1e-12)
        assert b @ (a @ c**2) == pytest.approx(1 / 12, rel=1e-12)


@pytest.mark.parametrize("name", TABLEAUX)
def test_declared_order_is_not_exceeded(name: str) -> None:
    """A declared order that is too low would make the order test above pass for a while."""
    a, b, c = TABLEAUX[name].weights
    p = TABLEAUX[name].order
    tall = b @ np.linalg.matrix_power(a, p) @ np.ones(len(b))
    missed = [abs(b @ c**p - 1 / (p + 1)), abs(tall - 1 / np.prod(np.arange(1, p + 2)))]
    assert max(missed) > 1e-9


def test_breakpoints_restart_the_step(scene: Any, hold: Any) -> None:
    """The hold is off every grid: an unrestarted step would be stuck at first order."""
    fine, coarse = (state_at(scene, hold, "rk8", step) for step in (5e-4, 2e-3))
    assert np.abs(fine - coarse).max() < 1e-9


@pytest.mark.parametrize("name", steppers())
def test_result_does_not_depend_on_how_steps_are_grouped(name: str, scene: Any) -> None:
    one, other = (Drive(scene(solver={"stepper": name})) for _ in range(2))
    one.advance(300)
    for count in itertools.chain([1] * 50, [7] * 20, [110]):
        other.advance(count)
    assert one.steps == other.steps == 300
    assert one.snapshot().state.tobytes() == other.snapshot().state.tobytes()


def test_their_order_does_not_depend_on_who_was_imported_first() -> None:
    assert list(steppers()) == sorted(steppers())
    assert RK8 is stepper_named("rk8")


def test_unknown_stepper() -> None:
    known = ", ".join([*steppers(), "auto"])
    with pytest.raises(SceneError, match=rf"mean 'rk8'.*known are: {known}"):
        stepper_named("rk88")
