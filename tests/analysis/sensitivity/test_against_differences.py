"""Exact derivatives of runs beside differences of whole runs: kinds of keys, plants and events."""

import numpy as np
import pytest

from ab_sim.analysis.sensitivity import real_keys, sensitivities
from ab_sim.analysis.sensitivity.keys import moved, scale_of
from ab_sim.scene.load import load_scene
from tests.analysis.sensitivity.differences import run_of, worst_of_keys

APART = "start.ball_angles=[0.3, 1.2]"
SEGMENTS = (
    "profile={kind: segments, segments: [{to: 80, acceleration: 150}, {hold: 0.0703}, "
    "{duration: 0.05, acceleration: 50}, {to: 50, acceleration: 200}]}"
)
CASES = {
    # Breakpoints within steps, and friction that lets go.
    "ramps": ("thesis-hold", APART, "duration=0.2", "start.speed=90", "solver.step=0.0007",
              "profile.variable_speed_period.duration=0.05"),
    # At the steps' ends.
    "ramps on the grid": ("thesis-hold", APART, "duration=0.4", "start.speed=96",
                          "profile.variable_speed_period.duration=0.1"),
    "tsit5, raised cosine": (
        "nsc-case-1", "duration=0.2", "profile.start_time=0.0301", "profile.duration=0.0707",
        "start.ball_angles=[2.0, -2.5]", "start.deck.position=[1e-4, 0.0]", "solver.stepper=tsit5",
    ),
    "rk4, segments, rolling balls": (
        "balanced-start-up", "duration=0.4", "start.speed=60", "solver.stepper=rk4", SEGMENTS,
        "start.ball_rates=[5.0, -3.0]",
    ),
    "motor at its limit": ("weak-motor", APART, "duration=0.2",
                           "effects.motor.torque_limit=0.001"),
    "sticking": ("on-edge", "effects.ball_contact=", "start.ball_angles=[0.3, -0.2]",
                 "duration=0.7"),
    "impacts and rows": ("on-edge", "start.ball_angles=[0.3, -0.2]", "duration=0.5"),
    "in space": ("couple-unbalance", "duration=0.1", "start.speed=200",
                 "effects.gravity={tilt: 0.2}"),
    "all effects": ("everything", "start.speed=20", "duration=0.3", "solver.step=0.0005"),
    "more balls than lanes": (
        "packed-balls", "balls.count=10", "balls.mass=0.0002", "effects.ball_contact=",
        "start.ball_angles=[0.0, 0.7, 1.2, 1.9, 2.5, 3.1, -0.6, -1.1, -1.9, -2.4]", "duration=0.1",
    ),
}  # fmt: skip
TELLING = {
    "in space": ["rotor.inertia.4", "deck.inertia.0", "mounts.1.stiffness", "race.height.1",
                 "balls.mass.3", "effects.gravity.tilt", "profile.acceleration"],
    "more balls than lanes": ["balls.mass.9", "start.ball_angles.8", "rotor.eccentricity"],
    "all effects": ["rotor.total_mass", "race.radius", "balls.radius", "effects.gravity.direction",
                    "effects.motor.rotor_inertia", "effects.motor.back_emf_slope",
                    "effects.race_friction.coefficient", "effects.race_runout.lobe_angle",
                    "effects.unequal_suspension.axis_angle", "start.ball_angles.1"],
}  # fmt: skip
"""Of scenes with many, those that are looked at; else all."""


@pytest.mark.parametrize("case", CASES)
def test_derivatives_are_those_of_differences_of_runs(case: str) -> None:
    name, *changes = CASES[case]
    scene = load_scene(name, changes)
    keys = TELLING.get(case) or [key.key for key in real_keys(scene)]
    found = sensitivities(scene, keys)
    steps = len(found.trajectory) - 1
    assert (run_of(scene, steps).samples == found.trajectory.samples).all()
    worst = worst_of_keys(found)
    # Of a deck in space some channels hardly move, and differences of them are rounding.
    assert max(worst.values()) < (1e-4 if scene.deck else 2e-6), worst


@pytest.mark.parametrize("case", ["ramps", "impacts and rows"])
def test_what_a_derivative_leaves_falls_with_the_square(case: str) -> None:
    # Taylor's remainder: the proof that it is the derivative, and not nearly so.
    name, *changes = CASES[case]
    scene = load_scene(name, changes)
    keys = ["balls.mass", "effects.viscous_drag.coefficient", "profile.acceleration"]
    found = sensitivities(scene, keys)
    steps, at = len(found.trajectory) - 1, len(found.trajectory) - 1
    here = found.trajectory.position[at]
    for k, key in enumerate(real for real in real_keys(scene) if real.key in keys):
        way, left = found.derivatives[:, keys.index(key.key), at], []
        slope = way[[found.channels.index("x"), found.channels.index("y")]]
        for size in (1e-2, 5e-3, 2.5e-3):
            step = size * scale_of(key)
            there = run_of(moved(scene, key.key, key.value + step), steps).position[at]
            left.append(float(np.abs(there - here - step * slope).max()))
        ratios = np.array(left[:-1]) / left[1:]
        assert np.allclose(ratios, 4.0, rtol=0.05), (k, key.key, left)


def test_collocation_is_run_by_rk8_and_agrees_with_it() -> None:
    scene = load_scene("thesis-hold", [APART, "duration=0.1", "solver.stepper=collocation"])
    found = sensitivities(scene, ["balls.mass"])
    assert found.stepper == "rk8" and found.scene.solver.stepper == "rk8"
    steps = len(found.trajectory) - 1
    away = np.abs(run_of(scene, steps).position - found.trajectory.position).max()
    assert away < 1e-6 * np.abs(found.trajectory.position).max()
