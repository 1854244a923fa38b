"""The stability limit: where it lies, and that a step beyond it is refused with a way out."""

import cmath
import dataclasses
import math
import re
from typing import Any

import numpy as np
import pytest

from ab_sim.base.errors import CommandError, DivergedError, SceneError
from ab_sim.drive import Drive
from ab_sim.engine.integrate.choose import (
    choose_stepper,
    largest_step,
    stability_limit,
    step_limiting_rates,
)
from ab_sim.engine.integrate.registry import stepper_named, steppers
from ab_sim.engine.integrate.vector_field import VectorField
from ab_sim.model.dynamics.assemble import DRAG, LOOP, drag_rate, linear_rates, system_of
from ab_sim.model.spindle import SpeedSchedule
from ab_sim.scene import load_scene

LIMITED = [
    name
    for name, known in steppers().items()
    if math.isfinite(stability_limit(known, 1j)) and not known.keeps_tolerance
]
"""Those whose steps are the scene's."""


def test_rk4_has_its_textbook_limits() -> None:
    assert stability_limit(stepper_named("rk4")) == pytest.approx(2.785293563405282, rel=1e-12)
    assert stability_limit(stepper_named("rk4"), 1j) == pytest.approx(8**0.5, rel=1e-3)


@pytest.mark.parametrize(
    ("growth", "limit"),
    [
        (lambda z: (1 + z / 2) / (1 - z / 2), math.inf),  # the trapezoidal rule
        (lambda z: 1 + z / 1e6, 2e6),  # Euler's, in a million steps
    ],
)
def test_far_limits_are_told_from_none(growth: Any, limit: float) -> None:
    made = dataclasses.replace(stepper_named("rk4"), growth=growth)
    assert stability_limit(made) == pytest.approx(limit, rel=1e-12)
    assert largest_step(made, {"decay": -1e3 + 0j})[0] == pytest.approx(limit / 1e3, rel=1e-2)


def test_drag_rate_of_the_thesis_ball(scene: Any) -> None:
    """c_b/(m + I/a^2) = 714 1/s on a fixed deck; a free deck of 100 balls' mass adds 1.4 %."""
    rate = drag_rate(Drive(scene(solver={"step": 1e-4})).system)
    assert rate == pytest.approx(1 / (1.4e-3 - 2 * 1e-6 / 0.1), rel=1e-12)


def test_rates_of_the_thesis_deck(scene: Any) -> None:
    system = Drive(scene()).system
    rate = linear_rates(system, 500.0)["the deck's whirl at 500 rad/s"]
    whirl = (1000 / 0.098 - (0.1 / 0.098) ** 2) ** 0.5
    assert rate.real == pytest.approx(-0.1 / 0.098)
    assert abs(rate.imag) == pytest.approx(whirl + 500.0)


def growth(drive: Drive) -> float:
    """Two balls side by side on a deck at rest, disturbed: they calm down, or they do not."""
    start = drive.snapshot()
    start.state[drive.layout.rates] = 1e-6
    drive.restore(start)
    rates = drive.advance(100).ball_rates[:, 0]
    return float(np.abs(rates[-20:]).max() / np.abs(rates[:20]).max())


@pytest.mark.parametrize("name", [n for n in LIMITED if not stepper_named(n).solves_drag])
@pytest.mark.parametrize("factor", [0.99, 1.01])
def test_the_limit_is_where_the_balls_go_unstable(name: str, factor: float, scene: Any) -> None:
    drive = Drive(scene(profile=None, solver={"stepper": name, "step": 1e-4}))
    # Past the refusal, which is what is being tested here.
    drive.step = factor * stability_limit(stepper_named(name)) / drag_rate(drive.system)
    assert (growth(drive) < 1) == (factor < 1)


@pytest.mark.parametrize("coefficient", [1.0, 1e2, 1e4, 1e6])
def test_no_drag_is_too_stiff_for_imex8(coefficient: float, scene: Any) -> None:
    """Drag rates times step from 0.7 to 7e5."""
    drag = {"viscous_drag": {"coefficient": coefficient}}
    drive = Drive(scene(profile=None, effects=drag, solver={"stepper": "imex8"}))
    assert growth(drive) < 1


@pytest.mark.parametrize("name", LIMITED)
@pytest.mark.parametrize("factor", [0.99, 1.1])
def test_the_limit_is_where_the_deck_goes_unstable(name: str, factor: float, scene: Any) -> None:
    """No balls; the deck disturbed, at its top speed."""
    drive = Drive(
        scene(
            balls={"count": 0},
            rotor={"eccentricity": 0.0},
            start={"speed": 500.0},
            profile=None,
            solver={"stepper": name, "step": 1e-4},
        )
    )
    rates = linear_rates(drive.system, 500.0)
    drive.step = factor * largest_step(stepper_named(name), rates)[0]
    start = drive.snapshot()
    start.state[:] = 1e-6
    drive.restore(start)
    try:
        whirl = drive.advance(2000).whirl
        grown = whirl[-100:].max() / whirl[:100].max()
    except DivergedError:
        grown = np.inf
    # A factor e^2 at the tolerated growth of 1e-3 per step.
    assert (grown < 8) == (factor < 1)


@pytest.mark.parametrize("name", LIMITED)
@pytest.mark.parametrize("balls", [0, 2])
def test_refusal_names_a_step_that_is_accepted(name: str, balls: int, scene: Any) -> None:
    with pytest.raises(SceneError, match="solver.step = 0.05 s: .* stability limit") as caught:
        Drive(scene(balls={"count": balls}, solver={"stepper": name, "step": 0.05}))
    named = re.search(r"use at most (\S+) s", str(caught.value))
    assert named is not None
    step = float(named.group(1))
    drive = Drive(scene(balls={"count": balls}, solver={"stepper": name, "step": step}))
    rates = step_limiting_rates(stepper_named(name), linear_rates(drive.system, 400.0)).values()
    reach = max(
        abs(rate) * step / stability_limit(stepper_named(name), cmath.rect(1.0, cmath.phase(rate)))
        for rate in rates
        if rate
    )
    assert 0.95 < reach <= 1.01, reach


def test_hopeless_drag_is_told_apart(scene: Any) -> None:
    with pytest.raises(SceneError, match="lower the rate"):
        Drive(scene(effects={"viscous_drag": {"coefficient": 1e9}}))


def test_refusal_of_stiff_drag_names_what_follows_it(scene: Any) -> None:
    stiff = {"viscous_drag": {"coefficient": 100.0}}
    words = "; or leave solver.stepper to auto"
    with pytest.raises(SceneError, match=words):
        Drive(scene(effects=stiff, solver={"stepper": "rk8"}))
    assert Drive(scene(effects=stiff, solver={"stepper": "imex8"})).choice.longest > 1e-3


def test_stiff_drag_may_have_events(scene: Any) -> None:
    effects = {"viscous_drag": {"coefficient": 1e4}, "rolling_friction": {"arm": 1e-6}}
    drive = Drive(scene(effects=effects, solver={"stepper": "auto"}))
    assert drive.choice.stepper.name == "imex8" and drive.choice.stepper.parts == 1


@pytest.mark.parametrize(
    ("coefficient", "chosen", "reason"),
    [(1.0, "rk8", "auto: stable at this step"), (100.0, "imex8", "rk8 would need steps of")],
)
def test_auto_asks_the_drag(coefficient: float, chosen: str, reason: str, scene: Any) -> None:
    effects = {"viscous_drag": {"coefficient": coefficient}}
    choice = Drive(scene(effects=effects, solver={"stepper": "auto"})).choice
    assert choice.stepper.name == chosen and reason in choice.reason


def test_auto_does_not_help_a_deck_that_whirls_too_fast(scene: Any) -> None:
    with pytest.raises(SceneError, match="the deck's whirl at 400 rad/s") as told:
        Drive(scene(balls={"count": 0}, solver={"stepper": "auto", "step": 0.05}))
    assert "auto" not in str(told.value)


def test_a_speed_that_is_never_reached_limits_nothing(scene: Any) -> None:
    """Where no commands are taken; a step for 1e5 rad/s would be 45 us."""
    far = {"spindle": {"max_speed": 1e5}}
    with pytest.raises(SceneError, match="whirl at 100000 rad/s"):
        Drive(scene(**far), commanded=True)
    drive, same = Drive(scene(**far)), Drive(scene())
    assert drive.advance(500).samples.tobytes() == same.advance(500).samples.tobytes()
    before = drive.observe().command
    with pytest.raises(CommandError, match="command = 9000 rad/s: .* use at most"):
        drive.command(9000.0)
    assert drive.observe().command == before
    drive.command(450.0)
    drive.advance(10)
    drive.command(-450.0)
    assert drive.observe().command == -450.0


def test_a_motor_may_overshoot_its_profile(scene: Any) -> None:
    motor = {"rotor_inertia": 2.9e-5, "torque_limit": 1e-3, "proportional_gain": 1e-3}
    made = scene(effects={"motor": motor}, spindle={"max_speed": 1e5})
    with pytest.raises(SceneError, match="whirl at 100000 rad/s"):
        choose_stepper(made, system_of(made))


@pytest.mark.parametrize("arm", [1e-6, 5e-4, 1e-2])
def test_friction_of_any_size_is_followed(arm: float, scene: Any) -> None:
    """A small one gives way to the whirl at the critical speed; the others hold the balls."""
    drive = Drive(scene(effects={"rolling_friction": {"arm": arm}}))
    run = drive.advance(3000)
    assert np.isfinite(run.samples).all() and drive.steps_with_unresolved_events == 0
    assert drive.observe().stuck.all() == (arm > 1e-4)


def test_nothing_that_limits(scene: Any) -> None:
    free = {"viscous_drag": None, "suspension": None}
    Drive(scene(effects=free, spindle={"max_speed": 400.0}, solver={"step": 1e-3}))
    assert largest_step(stepper_named("rk4"), {"nothing": 0j})[0] == np.inf


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"rho_inf": 0.5}, r"takes it \(generalized-alpha\)"),
        ({"tolerence": 0.5}, "did you mean 'tolerance'"),
    ],
)
def test_auto_takes_no_parameters(given: dict[str, float], words: str, scene: Any) -> None:
    """Until now it ignored them."""
    key = next(iter(given))
    said = rf"solver.parameters.{key} = 0.5: .* 'auto'.*{words}"
    with pytest.raises(SceneError, match=said):
        Drive(scene(solver={"stepper": "auto", "parameters": given}))


FAST_MOTORS: dict[str, tuple[str, ...]] = {
    "a stiff loop": ("rotor_inertia=1e-6", "proportional_gain=3e-3", "integral_gain=0"),
    "drag on a light rotor": ("rotor_inertia=1e-7", "proportional_gain=1e-4", "integral_gain=0"),
    "drag and loop": ("rotor_inertia=1e-7", "proportional_gain=3e-4", "integral_gain=0"),
    "an integral alone": ("rotor_inertia=1e-6", "proportional_gain=1e-5", "integral_gain=4"),
    "a rotor as heavy as its balls": ("rotor_inertia=2e-7", "proportional_gain=2e-3"),
    "back-EMF": ("rotor_inertia=1e-6", "proportional_gain=1e-4", "back_emf_slope=4e-3"),
}
SIDE_BY_SIDE = [2.0 * math.pi * k / 16 for k in range(16)]


def of_motor(changes: tuple[str, ...]) -> list[str]:
    return [f"effects.motor.{change}" for change in changes]


def motor_drive(motor: str, *changes: str) -> Drive:
    free = ("start.speed=0", "profile=", "solver.step=1e-5", "effects.motor.torque_limit=1e3")
    changes = (*free, *of_motor(FAST_MOTORS[motor]), *changes)
    return Drive(load_scene("weak-motor", [*changes, "start.ball_angles=[0, 0]"]))


def fast_rates(drive: Drive) -> dict[str, complex]:
    rates = linear_rates(drive.system, 0.0)
    return {what: rates[what] for what in (DRAG, LOOP)}


@pytest.mark.parametrize("motor", FAST_MOTORS)
@pytest.mark.parametrize("name", ["rk8", "rk4"])
@pytest.mark.parametrize("factor", [0.98, 1.08])
def test_the_limit_is_where_a_motor_goes_unstable(motor: str, name: str, factor: float) -> None:
    """Somewhere around the race beyond the limit, nowhere below it."""
    drive, grown = motor_drive(motor, f"solver.stepper={name}"), []
    drive.step = factor * largest_step(stepper_named(name), fast_rates(drive))[0]
    for angle in SIDE_BY_SIDE:
        drive.reset()
        start = drive.snapshot()
        start.state[drive.layout.angles] = angle
        start.state[drive.layout.rates] = 1e-6
        start.state[drive.layout.spindle.start + 1] = 1e-6
        drive.restore(start)
        try:
            rates = np.abs(drive.advance(400).ball_rates[:, 0])
            grown.append(rates[-20:].max() > 2.0 * rates[:20].max())
        except DivergedError:
            grown.append(True)
    assert any(grown) == (factor > 1)


@pytest.mark.parametrize("motor", FAST_MOTORS)
def test_the_rates_of_a_motor_are_those_of_the_equations(motor: str) -> None:
    """The fastest eigenvalue of the exact Jacobian at rest, over balls all around the race."""
    drive, fastest = motor_drive(motor), 0.0
    start = drive.snapshot()
    scheduled = SpeedSchedule.of_scene(drive.scene).segments[0]
    field = VectorField(drive.system, scheduled, start.discrete_state)
    for angle in SIDE_BY_SIDE:
        start.state[drive.layout.angles] = angle
        eigenvalues = np.linalg.eigvals(field.jacobian(0.0, start.state))
        fastest = max(fastest, float(np.abs(eigenvalues).max()))
    assert max(map(abs, fast_rates(drive).values())) == pytest.approx(fastest, rel=0.02)


def test_a_rotor_may_have_no_inertia_besides_its_unbalance() -> None:
    """M0 e^2 (1 - M0 / M) on a deck that is free to yield."""
    own = ("rotor_inertia=0", "proportional_gain=0.4", "integral_gain=0", "back_emf_slope=0")
    rotor = "rotor={total_mass: 1, eccentric_mass: 0.2, eccentricity: 0.2}"
    changes = [rotor, *of_motor(own), "balls={count: 0}", "start.ball_angles="]
    scene = load_scene("weak-motor", changes)
    rate = linear_rates(system_of(scene), 0.0)[LOOP]
    assert rate == pytest.approx(-0.4 / (0.2 * 0.2**2 * (1 - 0.2)), rel=1e-12)
    with pytest.raises(SceneError, match=r"rotor_inertia = 0\.0 kg m\^2: must be"):
        load_scene("weak-motor", ["effects.motor.rotor_inertia=0"])


def test_a_motor_below_a_deck_in_space_has_a_limit_too() -> None:
    changes = [
        "effects.motor={torque_limit: 1, rotor_inertia: 1e-4, proportional_gain: 0.01}",
        "effects.spindle_acceleration={}",
    ]
    scene = load_scene("couple-unbalance", changes)
    rate = linear_rates(system_of(scene), scene.spindle.max_speed)["the motor's speed loop"]
    assert math.isfinite(abs(rate)) and abs(rate) > 1.0
    assert choose_stepper(scene, system_of(scene)).stepper.name
