"""A stepper of a stranger's own: all of it is in this file, and no file of the package knows it."""

from collections.abc import Iterator

import numpy as np
import pytest

import ab_sim
from ab_sim.base.errors import SceneError
from ab_sim.drive import Drive
from ab_sim.engine.integrate.registry import steppers
from ab_sim.scene import load_scene

NAME = "midpoint"


@pytest.fixture(autouse=True)
def registered() -> Iterator[None]:
    """Known while a test runs."""
    assert NAME not in steppers()
    with ab_sim.temporary_registrations():
        ab_sim.register_stepper(NAME, 2, "Runge (1895)", rows=[[0.5]], weights=[0.0, 1.0])
        yield


def angles(stepper: str, step: float) -> np.ndarray:
    """Of the balls after 0.1 s on the way up."""
    changes = [f"solver.stepper={stepper}", f"solver.step={step}", "start.ball_angles=[2.0,-1.0]"]
    drive = Drive(load_scene("nsc-case-1", ["start.speed=100", *changes]))
    return drive.advance(round(0.1 / step)).ball_angles[-1]


def test_it_runs_by_its_name_with_its_order() -> None:
    true = angles("rk8", 1e-4)
    errors = [np.abs(angles(NAME, step) - true).max() for step in (4e-4, 2e-4, 1e-4)]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert orders == pytest.approx(2.0, abs=0.1), errors


def test_its_steps_are_limited_by_its_growth() -> None:
    with pytest.raises(SceneError, match=rf"solver.step = .*with {NAME} use at most"):
        angles(NAME, 0.1)
    assert NAME in steppers()
