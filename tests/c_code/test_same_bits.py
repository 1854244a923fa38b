"""A drive in C has the bits of a Drive: states, outputs, accelerometers, whatever is commanded."""

import math
from typing import Any, NamedTuple

import numpy as np
import pytest

import ab_sim.tracing
from ab_sim.base.sample_columns import ANGLE
from ab_sim.drive import Drive
from ab_sim.model.dynamics.assemble import MOST_ANGLE
from ab_sim.scene import Scene, load_scene
from tests.c_code.compiled import DIVERGED, OK, REFUSED, InC, needs_compiler

pytestmark = needs_compiler

FIRST_ANGLE = 4
"""Place in a planar drive's state, behind the deck's."""
SMOOTH = "effects.rolling_friction="
QUIET = ("sensors.front.noise_density=0", "sensors.front.axis_angle=0.3", "sensors.front.range=0.5")
CASES = {
    "thesis": ("thesis-hold", SMOOTH, "start.ball_angles=[9.0, -2.0]"),
    "sensors": ("thesis-hold", SMOOTH, *QUIET, "sensors.front.sample_rate=250"),
    "no ball": ("no-ball", "start.angle=5.0"),
    "three balls": ("thesis-hold", SMOOTH, "balls.count=3", "start.ball_angles=[0.1, 2.0, 4.0]"),
    "eight balls": ("thesis-hold", SMOOTH, "balls.count=8", "start.ball_angles="),
    "nineteen balls": ("thesis-hold", SMOOTH, "balls.count=19", "start.ball_angles="),
    "a raised cosine": ("nsc-case-1", "profile.start_time=0.1001", "profile.duration=0.2"),
    "a short one": ("nsc-case-3", "profile.start_time=0.1", "profile.duration=0.0031"),
    "rk4": ("thesis-hold", SMOOTH, "solver.stepper=rk4", "solver.step=2e-4"),
    "springs, gravity, runout": (
        *("everything", SMOOTH, "effects.race_friction=", "effects.ball_contact="),
        *("effects.motor=", "sensors.accelerometer.noise_density=0"),
    ),
    "in space": ("couple-unbalance", *QUIET, "sensors.front.position=[0.02, 0.01, 0.003]"),
    "tilted, hardening": (
        *("feeding-deck", "effects.gravity.tilt=1.0", "effects.ball_spin={}", "balls.radius=0.001"),
        *("effects.hardening_suspension.cubic_stiffness=1e8", "solver.stepper=tsit5"),
        *("start.deck.tilt=[0.01, 0.0, 0.02]", "solver.step=5e-4"),
    ),
}  # fmt: skip


def case(name: str) -> Scene:
    scene, *changes = CASES[name]
    return load_scene(scene, changes)


def same(found: np.ndarray, expected: np.ndarray) -> bool:
    """To the bit, but for the sign of zeros."""
    return np.array_equal(found, expected)


@pytest.mark.parametrize("name", CASES)
def test_profile_and_commands(name: str) -> None:
    scene = case(name)
    drive, in_c = Drive(scene), InC(scene)
    ours = drive.advance(600).samples[:, ANGLE:]
    assert same(in_c.rows(600), ours)
    random = np.random.default_rng(len(name))
    for _ in range(5):
        speed = random.uniform(-1.0, 1.0) * scene.spindle.max_speed
        acceleration = random.uniform(0.01, 1.0) * scene.spindle.max_acceleration
        drive.command(speed, acceleration)
        assert in_c.call("command_ramp", speed, acceleration) == OK
        steps = int(random.integers(1, 200))
        found, ours = in_c.rows(steps), drive.advance(steps).samples[:, ANGLE:]
        if "raised_cosine" in in_c.sources.files["drive.c"]:
            # Where a command finds such a curve, its speed is to rounding that of NumPy.
            np.testing.assert_allclose(found, ours, rtol=1e-9, atol=1e-12)
        else:
            assert same(found, ours)
    assert in_c.library.drive_time(in_c.me) == drive.time
    assert in_c.library.drive_whirl(in_c.me) == drive.present().whirl[0]


def test_a_short_ramp_ends_within_a_step() -> None:
    """Steps are cut there, and where two commands come in one of them."""
    scene = case("thesis")
    drive, in_c = Drive(scene, commanded=True), InC(scene)
    in_c.call("init")
    for speed in (0.001, 0.0010001, 20.0, 20.0 + 1e-13, 20.0, -20.0):
        drive.command(speed)
        assert in_c.call("command", speed) == OK
        assert same(in_c.rows(7), drive.advance(7).samples[:, ANGLE:])


def test_a_long_run_keeps_its_bits() -> None:
    """Turns of the balls are counted apart; steps come many at a time."""
    scene = load_scene("thesis-hold", [SMOOTH, "effects.viscous_drag.coefficient=0.02"])
    drive, in_c = Drive(scene), InC(scene, "-O3", "-march=native", "-std=gnu99")
    drive.advance(10_000)
    assert in_c.call("step", 10_000) == OK
    state = drive.snapshot().state
    assert same(in_c.state(len(state)), state)
    assert same(in_c.row(), drive.present().samples[0, ANGLE:])
    assert np.abs(drive.present().ball_angles).max() > 20.0


def test_parameters_change_while_it_runs() -> None:
    """What is set is what a scene with that value has; what follows from masses, too."""
    scene = case("three balls")
    in_c = InC(scene)
    other = load_scene(
        CASES["three balls"][0],
        [*CASES["three balls"][1:], "balls.mass=0.002", "effects.suspension.damping=0.7"],
    )
    drive = Drive(other)
    for ball in range(3):
        in_c.set(f"ball_mass[{ball}]", 0.002)
    in_c.set("suspension_damping", 0.7)
    in_c.set("unbalance", drive.system.deck_model.unbalance)
    in_c.call("reset")
    in_c.call("follow_profile")
    assert same(in_c.rows(300), drive.advance(300).samples[:, ANGLE:])
    snapshot = drive.snapshot()
    in_c.set("suspension_damping", scene.effects["suspension"].damping)
    in_c.call("update")
    softer = Drive(
        load_scene(CASES["three balls"][0], [*CASES["three balls"][1:], "balls.mass=0.002"])
    )
    softer.restore(snapshot)
    assert same(in_c.rows(100), softer.advance(100).samples[:, ANGLE:])


def test_an_effect_of_one_s_own_comes_along() -> None:
    class AirDrag(NamedTuple):
        coefficient: float

        def deck_force(self, deck: Any) -> tuple[Any, Any]:
            size = self.coefficient * ab_sim.tracing.sqrt(deck.vx * deck.vx + deck.vy * deck.vy)
            return -size * deck.vx, -size * deck.vy

    changes = [SMOOTH, "effects.air-drag.coefficient=20.0", "start.deck.velocity=[0.1, 0.0]"]
    with ab_sim.temporary_registrations():
        ab_sim.register_effect("air-drag", equation="f = -c |v| v", source="this test")(AirDrag)
        scene = load_scene("thesis-hold", changes)
    drive, in_c = Drive(scene), InC(scene)
    assert "air-drag: f = -c |v| v (this test)" in in_c.sources.files["drive.c"]
    assert same(in_c.rows(200), drive.advance(200).samples[:, ANGLE:])


def test_a_copy_goes_on_from_there() -> None:
    in_c = InC(case("sensors"))
    in_c.rows(333)
    kept = in_c.me.raw
    assert in_c.call("command", 30.0) == OK
    once = in_c.rows(200)
    in_c.me.raw = kept
    assert in_c.call("command", 30.0) == OK
    assert same(in_c.rows(200), once)


@pytest.mark.parametrize(
    ("speed", "acceleration"),
    [(math.nan, 1.0), (420.1, 1.0), (-math.inf, 1.0), (1.0, 0.0), (1.0, 50.1), (1.0, math.nan)],
)
def test_commands_beyond_the_limits_change_nothing(speed: float, acceleration: float) -> None:
    in_c = InC(case("thesis"))
    in_c.rows(10)
    before = in_c.me.raw
    assert in_c.call("command_ramp", speed, acceleration) == REFUSED
    assert in_c.me.raw == before


def test_a_state_beyond_all_bounds_ends_it_at_the_last_good_one() -> None:
    in_c = InC(case("thesis"))
    assert in_c.call("step", 1000) == OK
    in_c.set("suspension_stiffness", 6e6)  # far too stiff for the step
    in_c.call("update")
    assert in_c.call("step", 1000) == DIVERGED
    assert 1.0 < in_c.library.drive_time(in_c.me) < 1.1
    state = in_c.state(8)
    assert 1e-3 < np.abs(state[:4]).max() < 1e6 and np.isfinite(in_c.row()).all()
    assert in_c.call("step", 1) == DIVERGED
    assert same(in_c.state(8), state)


@pytest.mark.parametrize("angle", [9e14, 9e15])
def test_a_step_ends_whatever_angle_it_begins_with(angle: float) -> None:
    in_c = InC(case("thesis"))
    in_c.library.drive_state(in_c.me)[FIRST_ANGLE] = angle
    assert in_c.call("step", 1) == (OK if angle < MOST_ANGLE else DIVERGED)
