"""Runs by Taylor steps: their error, what they depend on, and what is refused; their series."""

import itertools
from collections.abc import Iterator
from typing import Annotated, Any, NamedTuple

import numpy as np
import pytest

import ab_sim
from ab_sim.base.errors import DivergedError, SceneError
from ab_sim.design.batch import simulate_batch
from ab_sim.drive import Drive
from ab_sim.engine.integrate.registry import stepper_named
from ab_sim.engine.integrate.steppers.taylor import HIGHEST, LOWEST, order_for
from ab_sim.engine.integrate.vector_field import VectorField
from ab_sim.engine.kernels import code
from ab_sim.engine.kernels.code import called, code_of
from ab_sim.engine.taylor.assemble import taylor_code
from ab_sim.engine.taylor.clock import BEGIN, CLOCK, END, LONGEST, UNTIL
from ab_sim.model.dynamics.assemble import active_segment
from ab_sim.model.equations.motion import ActiveSegment, DeckMotion
from ab_sim.model.spindle.schedule import Ramp
from ab_sim.scene import Scene, load_scene
from ab_sim.scene.quantities import Number, quantity
from ab_sim.scene.registry import register
from tests.integrate.random_scenes import PLANTS, scene_at_random

SMOOTH = ["effects.rolling_friction="]
ORDER = 6
"""Order of tests whose code in space takes seconds to make; they share it."""
HOLD = ["solver.stepper=taylor", "solver.step=0.005"]


def by_taylor(*changes: str) -> Drive:
    """The thesis' start-up with a hold."""
    return Drive(load_scene("thesis-hold", [*SMOOTH, *HOLD, *changes]))


@pytest.fixture(scope="module")
def true() -> np.ndarray:
    """The balls' angles in it, every 5 ms."""
    fine = ["solver.stepper=rk8", "solver.step=0.0005"]
    run = Drive(load_scene("thesis-hold", [*SMOOTH, *fine])).advance(12_000).decimated(10)
    return np.asarray(run.ball_angles)


@pytest.mark.parametrize("tolerance", [1e-5, 1e-8, 1e-11])
def test_errors_are_what_was_asked_for(tolerance: float, true: np.ndarray) -> None:
    drive = by_taylor(f"solver.parameters.tolerance={tolerance}")
    error = np.abs(drive.advance(1200).ball_angles - true).max()
    assert 0.01 * tolerance < error < tolerance


@pytest.mark.parametrize("seed", [2, 3])
@pytest.mark.parametrize("plant", PLANTS)
def test_all_effects_that_have_a_series(plant: str, seed: int) -> None:
    """Beside rk8 at short steps; and no energy is lost."""
    own = {"stepper": "taylor", "step": 0.004, "parameters": {"tolerance": 1e-8, "order": ORDER}}
    drive = Drive(scene_at_random(plant, seed, **own), energy_balance=True)
    fine = Drive(scene_at_random(plant, seed, stepper="rk8", step=1e-4), energy_balance=True)
    angles = drive.advance(50).ball_angles
    other = fine.advance(2000).decimated(40)
    assert np.abs(angles - other.ball_angles).max() < 1e-5
    balance = drive.energy()
    lost = balance.stored - balance.at_start - balance.motor_work + balance.dissipated
    assert abs(lost) < 1e-6 * (abs(balance.motor_work) + balance.dissipated)


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("plant", PLANTS)
def test_what_is_left_of_the_equations_has_the_order(plant: str, seed: int) -> None:
    """With all effects that have a series, and the energy balance, at any place of the motion."""
    drive = Drive(scene_at_random(plant, seed, stepper="rk8", step=1e-4), energy_balance=True)
    drive.advance(150)
    (segment,) = [s for s in drive.schedule.segments if s.start <= drive.time < s.end]
    time, field = drive.time - segment.start, drive.vector_field()
    coefficients = series_at(drive, active_segment(segment), time)
    lengths = np.array([4e-4, 2e-4, 1e-4]) * 100.0 / drive.scene.start.speed
    left = [residual(field, coefficients, time, h) for h in lengths]
    scale = np.abs(coefficients[:, 1]) + 1e-9
    orders = np.polyfit(np.log(lengths), np.log([np.abs(x / scale).max() for x in left]), 1)[0]
    assert orders == pytest.approx(ORDER, abs=0.5), left


def residual(field: VectorField, series: np.ndarray, time: float, h: float) -> np.ndarray:
    """What is left of y' - f(t, y) so long after the beginning."""
    powers = h ** np.arange(ORDER + 1)
    slope, out = series[:, 1:] @ (np.arange(1, ORDER + 1) * powers[:-1]), np.empty(len(series))
    field.fill(time + h, series @ powers, out)
    return slope - out


def series_at(drive: Drive, place: ActiveSegment, time: float) -> np.ndarray:
    """Coefficients of all states at the present, shape (states, ORDER + 1)."""
    kind, state = code_of(drive.system, Ramp), drive.snapshot().state
    constants, own = kind.constants(drive.system), taylor_code(kind, ORDER, 1)
    kind.put_place(constants, place.numbers)
    clock = np.zeros((len(CLOCK), 1))
    clock[BEGIN], clock[UNTIL], clock[LONGEST] = time, np.inf, np.inf
    flat = np.zeros(own.size)
    called(own.addresses["coefficients"], constants, np.zeros(kind.branches()), clock, state, flat)
    assert clock[END, 0] > time
    deck, n, found = drive.layout.deck.stop, drive.scene.balls.count, []
    for width in (*[1] * deck, n, n, *[1] * (len(state) - deck - 2 * n)):
        part, flat = np.split(flat, [width * (ORDER + 1)])
        found += list(part.reshape(ORDER + 1, width).T)
    return np.array(found)


def test_its_steps_are_its_own(true: np.ndarray) -> None:
    """With samples however far apart the motion is the same, but for how their times round."""
    short, long = by_taylor("solver.step=0.001"), by_taylor("solver.step=0.05")
    every, far = short.advance(6000), long.advance(120)
    np.testing.assert_allclose(every.ball_angles[49::50], far.ball_angles, rtol=0, atol=1e-14)
    assert np.abs(far.ball_angles - true[9::10]).max() < 1e-10


def test_nothing_depends_on_how_a_run_is_cut_up_and_continued() -> None:
    """Commands in the middle of steps, snapshots, looks ahead, and restarts."""
    one, other = by_taylor(), by_taylor()
    whole = np.concatenate([one.advance(101).samples, commanded(one).advance(99).samples])
    parts = [other.advance(k).samples for k in (1, 2, 3, 50, 45)]
    kept = other.snapshot()
    other.observe_at(other.time + 0.3 * other.step)
    commanded(other).advance(7)
    other.restore(kept)
    assert (other.present().samples[0] == parts[-1][-1]).all()
    parts += [commanded(other).advance(k).samples for k in (1, 98)]
    assert np.concatenate(parts).tobytes() == whole.tobytes()
    other.reset()
    assert other.advance(101).samples.tobytes() == whole[:101].tobytes()


def commanded(drive: Drive) -> Drive:
    drive.command(55.0)
    return drive


def test_a_look_ahead_is_on_the_same_motion() -> None:
    drive, fine = by_taylor(), by_taylor("solver.step=0.00125")
    drive.advance(300)
    fine.advance(1201)
    there = drive.observe_at(300.25 * 0.005)
    np.testing.assert_allclose(there.theta, fine.observe().theta, rtol=0, atol=1e-13)


def test_runs_side_by_side_do_not_wait_for_each_others_steps() -> None:
    """Their step lengths differ by far: each has the bits that it has alone."""
    base = load_scene("thesis-hold", [*SMOOTH, *HOLD, "duration=1.0"])
    variations = [{"effects.viscous_drag.coefficient": 3.0**k} for k in range(-3, 7)]
    batch = simulate_batch(base, variations)
    assert batch.in_lanes == 10
    for run in batch.runs:
        alone = Drive(run.scene).advance(200)
        assert run.trajectory.samples.tobytes() == alone.samples.tobytes()
    decimated = simulate_batch(base, variations[:3], every=7)
    for run, full in zip(decimated.runs, batch.runs, strict=False):
        expected = full.trajectory.samples[6::7]
        assert run.trajectory.samples.tobytes() == expected.tobytes()


def test_metrics_are_those_of_runs_by_a_runge_kutta_method() -> None:
    variations = [{"balls.mass": 1e-3 * (1 + 0.1 * k)} for k in range(9)]
    found, metric = [], "vibration_velocity_rms"
    for stepper in ("taylor", "rk8"):
        changes = [*SMOOTH, "duration=1.0", f"solver.stepper={stepper}", "solver.step=0.002"]
        batch = simulate_batch(load_scene("thesis-hold", changes), variations, metrics=[metric])
        assert batch.in_lanes == 9
        found.append(batch.metrics[metric])
    np.testing.assert_allclose(found[0], found[1], rtol=1e-8)


class Pump(NamedTuple):
    """Pushes the deck outwards, the more the further it is."""

    push: Annotated[Number, quantity("force per displacement", "N/m", ge=0, le=1e9)]

    def deck_force(self, deck: DeckMotion) -> tuple[Any, Any]:
        return self.push * deck.x, self.push * deck.y


class Rubber(NamedTuple):
    """A stop that is met on one side: it has a kink."""

    stiffness: Annotated[Number, quantity("force per length", "N/m", ge=0, le=1e9)]

    def deck_force(self, deck: DeckMotion) -> tuple[Any, Any]:
        return -(self.stiffness * abs(deck.x)), 0.0


@pytest.fixture
def strange() -> Iterator[None]:
    """Effects of these kinds are known."""
    with ab_sim.temporary_registrations():
        for kind in (Pump, Rubber):
            register(kind.__name__.lower(), equation="f = f(u)", source="this test")(kind)
        yield


def test_what_goes_beyond_all_bounds_is_told_and_left_at_its_last_good_state(
    strange: None, scene: Any
) -> None:
    changes = {"effects": {"pump": {"push": 1.3e5}}, "solver": {"stepper": "taylor"}}
    made = scene(**changes, duration=0.2, profile=None, start={"speed": 50.0})
    drive = Drive(made)
    with pytest.raises(DivergedError, match="beyond all bounds"):
        drive.advance(200)
    last = drive.steps
    again = Drive(made).advance(last)
    assert again.samples[-1].tobytes() == drive.present().samples[0].tobytes()
    batch = simulate_batch(made, [{}, {"effects.pump.push": 0.0}, {}])
    assert ["beyond all bounds" in run.failure for run in batch.runs] == [True, False, True]
    assert len(batch.runs[0].trajectory) == last
    assert len(batch.runs[1].trajectory) == 200


def test_what_has_no_series_is_refused_by_name(strange: None, scene: Any) -> None:
    made = scene(effects={"rubber": {"stiffness": 1e3}}, solver={"stepper": "taylor"})
    words = r"solver.stepper = 'taylor': .* abs\(deck\[0\]\)"
    with pytest.raises(SceneError, match=words):
        Drive(made)


@pytest.mark.parametrize("name", ["thesis-hold", "packed-balls", "weak-motor"])
def test_effects_with_events_are_refused_by_name(name: str) -> None:
    words = {
        "thesis-hold": r"effects.rolling_friction \(balls stick",
        "packed-balls": r"ball_contact \(balls collide\)",
        "weak-motor": r"motor \(a motor reaches",
    }
    with pytest.raises(SceneError, match=f"{words[name]}.*: imex8, rk4"):
        Drive(load_scene(name, ["solver.stepper=taylor"]))


def test_its_order_rises_with_what_is_asked() -> None:
    orders = [order_for(10.0**-k) for k in range(2, 17)]
    assert orders == sorted(orders)
    assert (orders[0], orders[-1]) == (LOWEST, HIGHEST)
    assert stepper_named("taylor", {"tolerance": 1e-8}).order == order_for(1e-8)
    assert stepper_named("taylor", {"tolerance": 1e-8, "order": 12}).order == 12


@pytest.mark.parametrize("taylor_first", [True, False])
def test_other_functions_of_the_same_kind_are_made_beside_its_own(
    taylor_first: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All of a kind's have one graph, and parameters of the profile are inputs of some."""
    monkeypatch.setattr(code, "KINDS", 1)
    by_taylor().advance(1)  # forgets other kinds

    def scene(stepper: str) -> Scene:
        own = ["duration=0.2", f"solver.stepper={stepper}", "profile.start_time=0.03"]
        return load_scene("nsc-case-1", own)

    def run_by_taylor() -> None:
        assert np.isfinite(Drive(scene("taylor")).advance(200).samples).all()

    def derive() -> None:
        field = Drive(scene("rk8")).vector_field()
        assert np.isfinite(field.jacobian(0.0, np.ones(field.layout.size))).all()

    for each in (run_by_taylor, derive) if taylor_first else (derive, run_by_taylor):
        each()


def test_its_clock_has_a_name_for_each_line() -> None:
    assert len(set(CLOCK)) == len(CLOCK)
    assert CLOCK[BEGIN] == "begin"
    assert all(a != b for a, b in itertools.pairwise(CLOCK))
