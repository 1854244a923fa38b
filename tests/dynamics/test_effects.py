"""What holds for every registered effect, whatever it does, and what a kernel is made of."""

import math
from typing import Any

import numba
import numpy as np
import pytest

from ab_sim.drive import Drive
from ab_sim.dynamics.dispatch import COMPILED, any_effect_has, sum_over_effects
from ab_sim.dynamics.effects import RollingFriction, Suspension, ViscousDrag
from ab_sim.dynamics.motion import Ball
from ab_sim.integrate.fixed_step import advance
from ab_sim.scene.registry import effect_classes, effect_parameters

METHODS = {
    "deck_force",
    "ball_inertia",
    "ball_force",
    "friction_coefficient",
    "spindle_acceleration",
    "motor_torque",
    "deck_energy",
    "ball_energy",
    "deck_loss",
    "ball_loss",
}


@pytest.mark.parametrize(("name", "effect"), effect_classes().items())
def test_effects_are_documented(name: str, effect: Any) -> None:
    assert effect.__doc__ and effect.equation and effect.source
    for key, field in effect_parameters(effect).items():
        assert field["description"] and field["unit"], key
    own = {key for key in vars(effect) if callable(vars(effect)[key]) and not key.startswith("_")}
    assert own & METHODS, "it does something"
    assert own <= METHODS, "and nothing that no kernel would call"


def test_sums_leave_out_effects_without_the_method() -> None:
    inertia = sum_over_effects("ball_inertia", 0.0)
    assert inertia((Suspension(1.0, 1.0), ViscousDrag(1.0)), Ball(1.0, 1.0)) == 0.0
    friction = sum_over_effects("friction_coefficient", 0.0)
    both = (RollingFriction(0.1), Suspension(1.0, 1.0), RollingFriction(0.2))
    assert friction(both, Ball(1.0, 1.0)) == pytest.approx(0.3)
    assert any_effect_has("ball_force")(both) is False


def kernel_of(scene: Any) -> tuple[str, str]:
    """Typed names and machine code of the kernel compiled for a scene."""
    drive = Drive(scene)
    drive.advance(1)
    effects = drive.system.effects
    for signature in advance.signatures:
        system = dict(zip(signature[0].fields, signature[0].types, strict=True))
        classes = [kind.instance_class for kind in system["effects"]]
        if classes == [type(effect) for effect in effects] and not len(system["ledger"]):
            # Compiled again: code that came from the disk cache cannot be inspected.
            fresh = numba.njit(**COMPILED)(advance.py_func)
            fresh.compile(signature)
            return str(signature[0]), fresh.inspect_llvm(signature)
    raise AssertionError("no kernel for these effects")


@pytest.mark.parametrize(
    "left_out",
    ["suspension", "viscous_drag", "spindle_acceleration", "ball_spin", "rolling_friction"],
)
def test_what_a_scene_does_not_name_is_not_in_its_kernel(left_out: str, scene: Any) -> None:
    """Its class is not among the types that the kernel is compiled for, nor in its code."""
    all_of_them = {"rolling_friction": {"arm": 1e-6}}
    without = {**all_of_them, left_out: None}
    class_name = effect_classes()[left_out].__name__
    radius = 1e-3
    full, code = kernel_of(scene(effects=all_of_them, balls={"radius": radius}))
    assert class_name in code
    # Without the balls' spin their drag is faster than RK8 can follow at 1 ms.
    fewer, lean = kernel_of(scene(effects=without, solver={"step": 1e-4}))
    assert class_name not in fewer
    assert class_name not in lean


def test_kernel_without_friction_is_shorter(scene: Any) -> None:
    _, plain = kernel_of(scene())
    _, rubbing = kernel_of(scene(effects={"rolling_friction": {"arm": 1e-6}}))
    assert len(plain) < len(rubbing)


@pytest.mark.parametrize(
    ("change", "limit"),
    [
        (
            {"effects": {"viscous_drag": {"coefficient": 1e-12}}},
            {"effects": {"viscous_drag": None}},
        ),
        (
            {"effects": {"rolling_friction": {"arm": 1e-15}}},
            {"effects": {"rolling_friction": None}},
        ),
        (
            {"effects": {"suspension": {"stiffness": 1e-9, "damping": 1e-12}}},
            {"effects": {"suspension": None}},
        ),
    ],
)
def test_limit_is_the_model_without_the_effect(scene: Any, change: Any, limit: Any) -> None:
    one, other = (Drive(scene(**changes)).advance(1000) for changes in (change, limit))
    assert np.abs(one.ball_angles[-1]).max() > 1e-4, "something moved"
    np.testing.assert_allclose(one.ball_angles, other.ball_angles, atol=1e-6)
    np.testing.assert_allclose(one.whirl, other.whirl, atol=1e-9)


def test_without_spindle_acceleration_only_its_terms_are_missing(scene: Any) -> None:
    """At constant speed nothing changes; during the run-up balls are not left behind."""
    held = {"profile": None, "start": {"speed": 80.0, "ball_angles": [0.3, -0.9]}}
    one, other = (
        Drive(scene(**held, effects=effects)).advance(1000)
        for effects in ({}, {"spindle_acceleration": None})
    )
    np.testing.assert_array_equal(one.samples, other.samples)
    run_up, without = (
        Drive(scene(effects=effects)).advance(200).ball_rates[-1]
        for effects in ({}, {"spindle_acceleration": None})
    )
    # Lag of a ball that is dragged along: (mu - spin) al / c_b, spin (R + a)/R times I/a^2.
    lag = (1.4e-3 - 0.4e-3 * 1.1) * 40.0 / 1.0
    np.testing.assert_allclose(run_up, -lag, rtol=0.1)
    assert np.abs(without).max() < 0.1 * lag


def test_friction_dissipates_and_the_balance_closes(scene: Any) -> None:
    """With friction the force jumps within steps: the balance closes with the first order."""

    def balance(step: float, effects: Any) -> tuple[float, float]:
        start = {"ball_angles": [0.3, -0.9]}
        drive = Drive(scene(effects=effects, start=start, solver={"step": step}), ledger=True)
        drive.advance(round(3.0 / step))
        energy = drive.energy()
        residual = energy.stored - energy.at_start - energy.motor_work + energy.dissipated
        return abs(residual) / energy.stored, energy.dissipated

    friction = {"rolling_friction": {"arm": 5e-6}}
    coarse, dissipated = balance(1e-3, friction)
    fine, _ = balance(1e-4, friction)
    assert coarse < 1e-3
    assert fine < 0.3 * coarse
    _, without = balance(1e-3, {})
    assert not math.isclose(dissipated, without, rel_tol=1e-3), "it rubbed"


def test_energy_balance_over_a_whole_start_up(scene: Any, with_hold: Any) -> None:
    """Friction off: closes to 1e-10 of the energy at every instant looked at."""
    drive = Drive(
        scene(
            start={"ball_angles": [0.3, -0.9]},
            profile=with_hold(target_speed=200.0, start_speed=100.0, duration=0.5),
        ),
        ledger=True,
    )
    for _ in range(60):
        drive.advance(100)
        energy = drive.energy()
        residual = energy.stored - energy.at_start - energy.motor_work + energy.dissipated
        assert abs(residual) < 1e-10 * energy.stored
    assert energy.motor_work > 0 and energy.dissipated > 0


def test_undamped_drive_conserves_energy_at_constant_speed(scene: Any) -> None:
    """No drag, no damping, constant speed: only the motor's work changes the energy."""
    drive = Drive(
        scene(
            effects={"suspension": {"damping": 0.0}, "viscous_drag": None},
            start={"speed": 120.0, "ball_angles": [0.3, -0.9]},
            profile=None,
        ),
        ledger=True,
    )
    drive.advance(5000)
    energy = drive.energy()
    assert energy.dissipated == 0.0
    assert energy.stored - energy.at_start == pytest.approx(energy.motor_work, rel=1e-9)
