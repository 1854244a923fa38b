"""Collocation leaves of an error what is asked, on shipped scenes and however rare the samples are.

Beside Runge and Kutta at much finer steps. Samples are as far apart as fast spindles turn several
times, so that only the tolerance keeps spans short.
"""

import functools

import numpy as np
import pytest

from ab_sim.drive import Drive
from ab_sim.scene import load_scene
from ab_sim.scene.model import Scene

SECONDS, EVERY, FINE = 2.0, 0.02, 2e-4
SAFETY = 10.0
"""Errors of whole runs beside what each span may leave, where they do not grow by themselves."""
GROWN = {
    "balanced-start-up": 12.0,
    "couple-unbalance": 2.3,
    "feeding-deck": 1.0,
    "five-balls-8000-rpm": 10.0,
    "nsc-case-1": 1.0,
    "one-ball": 1.0,
    "thesis-hold": 1.0,
    "weak-motor": 1.0,
}
"""What a small change of the balls' places at the start becomes at most."""


def smooth(name: str, *changes: str) -> Scene:
    """The scene without what makes events of its motion."""
    jumpy = [e for e in ("rolling_friction", "ball_contact") if e in load_scene(name).effects]
    return load_scene(name, [*(f"effects.{each}=" for each in jumpy), *changes])


def angles(scene: Scene) -> np.ndarray:
    """The balls', on a grid that all steps go into."""
    drive = Drive(scene)
    run = drive.advance(round(SECONDS / drive.step)).decimated(round(EVERY / drive.step))
    return np.asarray(run.ball_angles)


@functools.cache
def true(name: str) -> np.ndarray:
    return angles(smooth(name, "solver.stepper=rk8", f"solver.step={FINE}"))


@pytest.mark.parametrize("step", [0.005, EVERY])
@pytest.mark.parametrize("tolerance", [1e-5, 1e-7, 1e-9])
@pytest.mark.parametrize("name", GROWN)
def test_errors_are_what_was_asked_for(name: str, tolerance: float, step: float) -> None:
    own = ["solver.stepper=collocation", f"solver.step={step}"]
    found = angles(smooth(name, *own, f"solver.parameters.tolerance={tolerance}"))
    assert np.abs(found - true(name)).max() < SAFETY * GROWN[name] * tolerance
