"""A motor too weak to pass resonance: the whirl takes all of its power (Sommerfeld effect).

With a prescribed speed this cannot happen, and the passage looks easy. Asserted: the spindle stays
below the critical speed however long one waits, the torque is at its limit, half the step gives
the same motion, energy balances; and a stronger motor passes.
"""

import numpy as np
import pytest

from ab_sim.drive import Drive
from ab_sim.scene import load_scene
from tests.hard_cases.extremes import imbalance


def weak_motor(*changes: str) -> Drive:
    return Drive(load_scene("weak-motor", changes), energy_balance=True)


def test_it_is_caught() -> None:
    drive = weak_motor()
    scene = drive.scene
    run = drive.advance(round(scene.duration / drive.step))
    late = run["speed"][len(run) // 2 :]
    assert scene.critical_speed is not None
    assert late.max() < scene.critical_speed < run["command"][-1]
    motor, now = scene.effects["motor"], drive.observe()
    given = now.motor_torque + motor.back_emf_slope * now.omega
    assert given == pytest.approx(motor.torque_limit, rel=1e-12)
    assert imbalance(drive) < 1e-9
    assert drive.steps_with_unresolved_events == 0


def test_half_the_step_moves_the_same() -> None:
    coarse = weak_motor()
    step = coarse.step
    fine = weak_motor(f"solver.step={step / 2}")
    one, other = coarse.advance(round(3.0 / step)), fine.advance(round(6.0 / step))
    np.testing.assert_allclose(one["speed"], other["speed"][1::2], atol=1e-8)
    np.testing.assert_allclose(one.ball_angles, other.ball_angles[1::2], atol=1e-8)


def test_a_stronger_one_passes() -> None:
    drive = weak_motor("effects.motor.torque_limit=0.01")
    scene = drive.scene
    run = drive.advance(round(scene.duration / drive.step))
    assert scene.critical_speed is not None
    assert run["speed"][-1] > 1.2 * scene.critical_speed
