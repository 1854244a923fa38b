"""Collocation: beside Runge and Kutta, to the bit, and what it refuses."""

from typing import Any

import numpy as np
import pytest

from ab_sim.collocation.run import HEAD, SAMPLES
from ab_sim.drive import Drive
from ab_sim.drive.trajectory import Trajectory
from ab_sim.errors import DivergedError, SceneError
from ab_sim.scene import load_scene
from tests.hard_cases.extremes import errors

NAME, STEP = "collocation", 0.02
SMOOTH = "effects.rolling_friction="
SAFETY = 5.0
"""Errors of whole runs beside what each span may leave, where the motion forgets."""
EVERYTHING: dict[str, Any] = {
    "gravity": {"tilt": 1.5707963},
    "hardening_suspension": {"cubic_stiffness": 1e7},
    "suspension": None,
    "unequal_suspension": {
        "stiffness_1": 1000.0,
        "stiffness_2": 900.0,
        "damping_1": 0.2,
        "damping_2": 0.15,
        "axis_angle": 0.3,
    },
    "race_runout": {"offset_1": 1e-5, "offset_2": 0.0, "lobe": 2e-6, "lobe_angle": 0.1},
}


def hold(stepper: str = NAME, step: float = STEP, *changes: str) -> Drive:
    """The thesis' hold without friction."""
    own = [SMOOTH, f"solver.stepper={stepper}", f"solver.step={step}"]
    return Drive(load_scene("thesis-hold", [*own, *changes]))


@pytest.fixture(scope="module")
def true() -> Trajectory:
    """rk8's own error there is below 1e-13."""
    return hold("rk8", 1e-3).advance(6000)


@pytest.mark.parametrize("step", [1e-3, 5e-3, 0.02])
def test_errors_are_what_was_asked_for(step: float, true: Trajectory) -> None:
    """Whatever the samples: within a factor of five of each span's, at the worst of them."""
    every = round(step / 1e-3)
    for tolerance in (1e-7, 1e-9, 1e-11):
        drive = hold(NAME, step, f"solver.parameters.tolerance={tolerance}")
        run = drive.advance(round(6.0 / step))
        off = run.ball_angles - true.ball_angles[every - 1 :: every]
        assert np.abs(off).max() < SAFETY * tolerance
        for name, scale in (("x", 1e-2), ("vx", 1.0), ("ax", 100.0)):
            most = np.abs(run[name] - true[name][every - 1 :: every]).max()
            assert most < SAFETY * tolerance * scale * 10


def test_spans_are_longer_than_steps() -> None:
    """Of a millisecond: in a hold each goes over many of them."""
    drive = hold(NAME, 1e-3)
    drive.advance(5900)
    assert drive.snapshot().memory[0, -HEAD + SAMPLES] >= 4


@pytest.mark.parametrize("before", [1, 3, 8, 17, 30])
def test_a_command_in_the_middle_of_a_span(before: int) -> None:
    """Does the same to the bit however the steps on either side of it are grouped."""
    one, other = (hold(NAME, 1e-3) for _ in range(2))
    one.advance(3000)
    for _ in range(20):
        other.advance(150)
    whole = one.advance(before).samples
    parts = [other.advance(1).samples for _ in range(before)]
    kept = other.snapshot()
    for drive in (one, other):
        drive.command(120.0)
    whole = np.concatenate([whole, one.advance(100).samples])
    parts += [other.advance(count).samples for count in (1, 0, 40, 59)]
    assert whole.tobytes() == np.concatenate(parts).tobytes()
    again = hold(NAME, 1e-3)
    again.restore(kept)
    again.command(120.0)
    assert again.advance(100).samples.tobytes() == whole[before:].tobytes()


def test_a_run_that_diverges_keeps_its_last_good_sample() -> None:
    """In the middle of a span, however it got there: bounds are drawn where a sound run goes."""
    found = []
    for group in (1, 1000):
        drive = hold(NAME, 1e-3)
        drive._work.bounds[drive.layout.rates] = 5.0
        with pytest.raises(DivergedError):
            for _ in range(6000 // group):
                drive.advance(group)
        found.append((drive.steps, drive._state.tobytes()))
    assert found[0] == found[1]


@pytest.mark.parametrize("begins", [2.5, 2.51234])
def test_it_resumes_to_the_bit(begins: float) -> None:
    """Snapshots on either side of a breakpoint, on the grid of steps and off it."""
    change = f"profile.variable_speed_period.start_time={begins}"
    no_speed = "profile.variable_speed_period.start_speed="
    one, other = (hold(NAME, STEP, change, no_speed) for _ in range(2))
    whole = one.advance(200).samples
    kept = []
    for count in (1, 0, 6, 117, 1, 1, 1, 23, 50):
        kept.append(other.snapshot())
        other.observe_at(other.time + 0.3 * STEP)
        other.advance(count)
    assert other.snapshot().state.tobytes() == one.snapshot().state.tobytes()
    for snapshot in kept:
        again = hold(NAME, STEP, change, no_speed)
        again.restore(snapshot)
        rest = again.advance(200 - snapshot.steps).samples
        assert rest.tobytes() == whole[snapshot.steps :].tobytes()


def test_kinks_of_the_speed_restart_it() -> None:
    """Off every grid of steps, and commanded on the way."""
    found = []
    for stepper, step in (("rk8", 1e-3), (NAME, STEP)):
        change = ["profile.variable_speed_period.start_time=2.51234"]
        drive = hold(stepper, step, *change, "profile.variable_speed_period.start_speed=")
        drive.advance(round(3.0 / step))
        drive.command(60.0)
        drive.advance(round(0.5 / step))
        drive.command(120.0)
        found.append(drive.advance(round(1.0 / step)).ball_angles[-1])
    np.testing.assert_allclose(found[1], found[0], rtol=0.0, atol=1e-10)


def test_all_that_is_smooth_in_the_plane(scene: Any) -> None:
    """With the energy balance, which closes."""
    found = []
    for stepper, step in (("rk8", 5e-4), (NAME, 0.01)):
        solver = {"stepper": stepper, "step": step}
        drive = Drive(scene(effects=EVERYTHING, solver=solver), energy_balance=True)
        last, energy = drive.advance(round(3.0 / step)).ball_angles[-1], drive.energy()
        found.append([*last, energy.motor_work, energy.dissipated])
        gained = energy.motor_work - energy.dissipated
        assert abs(energy.stored - energy.at_start - gained) < 1e-9 * energy.motor_work
    np.testing.assert_allclose(found[1], found[0], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("coefficient", [1e-6, 1e2, 1e5])
def test_any_drag_is_solved_exactly(coefficient: float, scene: Any) -> None:
    """Drag rates times step from 1e-5 to 1e6; an independent simulator beside it."""
    drag = {"viscous_drag": {"coefficient": coefficient}}
    start = {"ball_angles": [2.0, -1.0], "speed": 60.0}
    drive = Drive(scene(effects=drag, start=start, solver={"stepper": NAME, "step": 0.01}))
    drive.advance(30)
    balls, deck = errors(drive, "Radau" if coefficient > 1.0 else "DOP853")
    assert balls < 1e-8 and deck < 1e-8


def test_a_layer_far_thinner_than_a_step_is_seen() -> None:
    """Behind each jump of the acceleration drag rules for 14 us, of steps of 5 and of 0.2 ms."""
    drag = "effects.viscous_drag.coefficient=100"
    found, true = (
        hold(NAME, step, drag, f"solver.parameters.tolerance={tolerance}").advance(round(6 / step))
        for step, tolerance in ((5e-3, 1e-11), (2e-4, 1e-14))
    )
    every = slice(24, None, 25)
    np.testing.assert_allclose(found.ball_angles, true.ball_angles[every], rtol=0.0, atol=1e-11)


@pytest.mark.parametrize(("steps", "error"), [(0, 1e-10), (1, 1e-3)])
def test_a_step_that_is_too_long_is_taken_in_parts(steps: int, error: float, true: Any) -> None:
    """The deck makes 12 rad in a step that hardly any iteration gets over."""
    last = hold(NAME, 0.06, f"solver.parameters.steps={steps}").advance(100).ball_angles[-1]
    np.testing.assert_allclose(last, true.ball_angles[-1], rtol=0.0, atol=error)


def test_a_step_without_a_solution_is_told() -> None:
    drive = hold(NAME, 0.02, "start.ball_rates=[140.0,-140.0]", "start.deck.velocity=[1e8,0]")
    with pytest.raises(DivergedError, match="went beyond all bounds"):
        drive.advance(200)


def test_its_parameter_is_checked() -> None:
    with pytest.raises(SceneError, match="tolerance = 0: must be within 1e-16 to 0.01"):
        hold(NAME, STEP, "solver.parameters.tolerance=0")


@pytest.mark.parametrize(
    ("drag", "speed", "step", "tolerance"),
    [(1e-12, 60.0, 0.05, 1e-11), (0.01, 150.0, 0.05, 1e-11), (1e-12, 400.0, 0.02, 1e-7)],
)
def test_the_end_of_a_span_is_not_right_by_chance(
    drag: float, speed: float, step: float, tolerance: float
) -> None:
    """With one sample, at the span's end, the last coefficients alone say nothing there."""
    own = (
        f"effects.viscous_drag.coefficient={drag}", "profile=", f"start.speed={speed}",
        "start.ball_angles=[0.5,2.0]",
    )  # fmt: skip
    found = hold(NAME, step, *own, f"solver.parameters.tolerance={tolerance}").advance(2)
    times = round(step / 2.5e-4)
    true = hold("rk8", 2.5e-4, *own).advance(2 * times)
    np.testing.assert_allclose(
        found.ball_angles, true.ball_angles[times - 1 :: times], rtol=0, atol=SAFETY * tolerance
    )


@pytest.mark.parametrize(
    "changes",
    [
        ("rotor.eccentricity=0",),
        ("profile=", "start.speed=0"),
        ("profile=", "start.speed=0", "start.deck.position=[1e-3,0]"),
        ("rotor.eccentricity=1e-12", "start.deck.position=[1e-3,0]"),
    ],
)
def test_without_balls_and_hardly_any_force(changes: tuple[str, ...]) -> None:
    found, true = (
        Drive(load_scene("no-ball", [*changes, f"solver.stepper={name}", "solver.step=0.005"]))
        for name in (NAME, "rk8")
    )
    np.testing.assert_allclose(found.advance(400)["x"], true.advance(400)["x"], rtol=0, atol=1e-9)
