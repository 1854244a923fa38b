"""Scenes and checks that the families share; few sets of effects, because each needs a kernel."""

from typing import Any

import numpy as np

from ab_sim.drive import Drive
from ab_sim.model.equations.neighbours import start_angles
from ab_sim.scene import Scene, check_scene
from tests.conftest import THESIS, merge
from tests.overlap import assert_apart
from tests.reference import simulate
from tests.reference.of_scene import params_of

APART = (0.3, -0.9)
RUBBING: dict[str, Any] = {
    "rolling_friction": {"arm": 5e-6},
    "gravity": {"tilt": 0.0},
    "ball_contact": {"restitution_coefficient": 0.5},
}
"""Effects in addition to those of the thesis."""


def scene_of(**changes: Any) -> Scene:
    """Return the thesis' scene with automatic choice of the stepper and changes."""
    return check_scene(merge(merge(THESIS, {"solver": {"stepper": "auto"}}), changes), "test")


def fast(**changes: Any) -> Scene:
    """Return a scene at 120 rad/s, a little above the critical speed, with the deck at rest."""
    held = {"start": {"speed": 120.0, "ball_angles": list(APART)}, "profile": None}
    return scene_of(**merge(held, changes))


def run(scene: Scene, time: float) -> Drive:
    """Advance a drive by ``time`` [s] and check it in pieces.

    All samples must be finite and without overlaps, and all events must be resolved.
    """
    drive = Drive(scene, energy_balance=True)
    left = round(time / drive.step)
    while left:
        part = drive.advance(min(left, 5000))
        assert np.isfinite(part.samples).all()
        assert_apart(drive, part)
        left -= len(part)
    assert drive.steps_with_unresolved_events == 0
    return drive


def imbalance(drive: Drive) -> float:
    """Return the residual of the energy balance relative to its largest entry."""
    e = drive.energy()
    assert e.dissipated >= -1e-12 * abs(e.stored)
    largest = max(abs(e.stored), abs(e.at_start), abs(e.motor_work), e.dissipated, 1e-300)
    return abs(e.stored - e.at_start - e.motor_work + e.dissipated) / largest


def errors(drive: Drive, method: str = "DOP853") -> tuple[float, float]:
    """Return the distance from the reference: ball angles [rad], deck relative to its whirl."""
    scene, now = drive.scene, drive.observe()
    ref = simulate(params_of(scene), start_angles(scene), [drive.time], method=method, rtol=1e-11)
    off = np.hypot(ref.x[0] - now.position[0], ref.y[0] - now.position[1])
    return float(np.abs(ref.theta[0] - now.theta).max()), float(off / max(now.whirl, 1e-300))
