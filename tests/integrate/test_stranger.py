"""A stepper of a stranger's own: all of it is in this file, and no file of the package knows it."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import pytest

from ab_sim.drive import Drive
from ab_sim.dynamics.slope import evaluate
from ab_sim.errors import SceneError
from ab_sim.integrate import registry
from ab_sim.integrate.registry import steppers
from ab_sim.integrate.stepper import Stepper
from ab_sim.scene import load_scene

NAME = "midpoint"


class Midpoint(NamedTuple):
    """Of a step, as a part of it."""

    half: float

    def step(self, plant: Any, begin: float, length: float, state: Any, work: Any) -> None:
        for j in range(state.size):
            work.trial[j] = state[j] + self.half * length * work.slopes[0, j]
        evaluate(plant, begin + self.half * length, work.trial, work.slopes[1])
        for j in range(state.size):
            work.trial[j] = state[j] + length * work.slopes[1, j]


@pytest.fixture(autouse=True)
def registered(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Known while a test runs."""
    assert NAME not in steppers()
    monkeypatch.setattr(registry, "_families", dict(registry._families))
    registry.register(
        Stepper(
            NAME,
            2,
            "Runge (1895)",
            Midpoint(0.5),
            evaluations=2,
            growth=lambda z: 1.0 + z + 0.5 * z * z,
            slopes=2,
            priced=False,
        )
    )
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
    with pytest.raises(SceneError, match=rf"beyond the stability limit.*with {NAME} use at most"):
        angles(NAME, 0.1)
    assert NAME in steppers()
