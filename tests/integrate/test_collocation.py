"""Collocation: its exact responses, beside Runge and Kutta, to the bit, and what it refuses."""

import math
from typing import Any

import numba
import numpy as np
import pytest
from scipy.linalg import expm

from ab_sim.drive import Drive
from ab_sim.errors import DivergedError, SceneError
from ab_sim.integrate import responses
from ab_sim.integrate.responses import LINES, NODES, NUMBERS
from ab_sim.scene import load_scene

NAME, STEP = "collocation", 0.02
SMOOTH = "effects.rolling_friction="
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


@numba.njit
def filled(nodes: Any, length: float, c: float, k: float, values: Any, table: Any) -> None:
    responses.fill(nodes, length, c, k, values, table)


def exactly(until: float, length: float, c: float, k: float, force: Any, state: Any) -> Any:
    """x and v after a share of a step under a polynomial force in that share.

    By the exponential of one matrix, which has the powers of time among its unknowns.
    """
    size = 2 + len(force)
    a = np.zeros((size, size))
    a[0, 1], a[1, :3] = 1.0, (-k * length**2, -c * length, length**2)
    a[range(2, size - 1), range(3, size)] = 1.0
    derivatives = force * [math.factorial(p) for p in range(len(force))]
    begin = np.concatenate([state * [1.0, length], derivatives])
    return (expm(a * until) @ begin)[:2] / [1.0, length]


@pytest.mark.parametrize(
    ("c", "k"),
    [(0.0, 0.0), (2.0, 1e4), (300.0, 1e4), (200.0, 1e4), (0.0, 9e4), (714.0, 0.0), (7e4, 0.0)],
)
def test_responses_to_polynomials_are_exact(c: float, k: float) -> None:
    length, made = 0.02, responses.nodes()
    table, values = np.zeros((LINES, NODES)), np.zeros(NODES)
    filled(made, length, c, k, values, table)
    state = np.array([0.3, -2.0])
    force = np.array([5.0, -20.0, 8.0, 8.0, -5.0, 0.0, -3.0, 12.0])
    nodes = np.polynomial.polynomial.polyval(made.at, force)
    for j, until in [*enumerate(made.at), (NODES, 1.0)]:
        if j < NODES:
            u, g, r = table[responses.UNIT : responses.IMPULSE_RATE + 1, j]
            into_x, into_v = table[: 2 * NODES, j].reshape(2, NODES) @ nodes
        else:
            u, g, r = table[NUMBERS, responses.LAST_UNIT : responses.LAST_RATE + 1]
            into_x, into_v = table[[responses.END_X, responses.END_V]] @ nodes
        found = [
            (1.0 - k * u) * state[0] + g * state[1] + into_x,
            -k * g * state[0] + r * state[1] + into_v,
        ]
        true = exactly(until, length, c, k, force, state)
        np.testing.assert_allclose(found, true, rtol=1e-11, atol=1e-13)


def test_it_goes_as_runge_and_kutta_on_steps_twenty_times_as_long() -> None:
    """rk8's own error there is below 1e-13."""
    true = hold("rk8", 1e-3).advance(6000)
    for step, error in ((0.04, 2e-7), (0.02, 3e-11), (0.01, 5e-12)):
        run, every = hold(NAME, step).advance(round(6.0 / step)), round(step / 1e-3)
        off = run.ball_angles - true.ball_angles[every - 1 :: every]
        assert np.abs(off).max() < error
        for name, scale in (("x", 1e-2), ("vx", 1.0), ("ax", 100.0)):
            assert np.abs(run[name] - true[name][every - 1 :: every]).max() < error * scale * 10


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
    """With the ledger, which closes."""
    found = []
    for stepper, step in (("rk8", 5e-4), (NAME, 0.01)):
        solver = {"stepper": stepper, "step": step}
        drive = Drive(scene(effects=EVERYTHING, solver=solver), ledger=True)
        last, energy = drive.advance(round(3.0 / step)).ball_angles[-1], drive.energy()
        found.append([*last, energy.motor_work, energy.dissipated])
        gained = energy.motor_work - energy.dissipated
        assert abs(energy.stored - energy.at_start - gained) < 1e-9 * energy.motor_work
    np.testing.assert_allclose(found[1], found[0], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("coefficient", [1e-6, 1e2, 1e5])
def test_any_drag_is_solved_exactly(coefficient: float, scene: Any) -> None:
    """Drag rates times step from 1e-5 to 1e6; sweeps at a tenth of the step."""
    drag = {"viscous_drag": {"coefficient": coefficient}}
    start = {"ball_angles": [2.0, -1.0], "speed": 60.0}
    found = []
    for stepper, step in (("sweeps", 1e-3), (NAME, 0.01)):
        drive = Drive(scene(effects=drag, start=start, solver={"stepper": stepper, "step": step}))
        found.append(drive.advance(round(1.0 / step)).ball_angles[-1])
    np.testing.assert_allclose(found[1], found[0], rtol=0.0, atol=1e-8)


def test_a_step_that_is_too_long_is_taken_in_parts() -> None:
    """The deck makes 12 rad in a step that hardly any iteration gets over."""
    true = hold("rk8", 1e-3).advance(6000).ball_angles[-1]
    last = hold(NAME, 0.06).advance(100).ball_angles[-1]
    np.testing.assert_allclose(last, true, rtol=0.0, atol=1e-3)


def test_a_step_without_a_solution_is_told() -> None:
    drive = hold(NAME, 0.02, "start.ball_rates=[140.0,-140.0]", "start.deck.velocity=[1e5,0]")
    with pytest.raises(DivergedError, match="went beyond all bounds"):
        drive.advance(200)


MOTOR = {"rotor_inertia": 2.9e-5, "torque_limit": 1e-3, "proportional_gain": 1e-3}


@pytest.mark.parametrize(
    ("effects", "words"),
    [
        ({"race_friction": {"coefficient": 1e-5}}, "cannot be cut at events"),
        ({"ball_contact": {"restitution_coefficient": 0.5}}, "cannot be cut at events"),
        ({"motor": MOTOR}, "cannot be cut at events"),
    ],
)
def test_what_has_events_is_refused(effects: Any, words: str, scene: Any) -> None:
    with pytest.raises(SceneError, match=f"solver.stepper = 'collocation': .*{words}"):
        Drive(scene(effects=effects, solver={"stepper": NAME}, start={"ball_angles": [0, 1]}))


def test_a_deck_in_space_is_refused() -> None:
    with pytest.raises(SceneError, match="'collocation': is for a deck that moves in the plane"):
        Drive(load_scene("feeding-deck", [f"solver.stepper={NAME}"]))


def test_its_parameter_is_checked() -> None:
    with pytest.raises(SceneError, match="tolerance = 0: must be within 1e-16 to 0.01"):
        hold(NAME, STEP, "solver.parameters.tolerance=0")
