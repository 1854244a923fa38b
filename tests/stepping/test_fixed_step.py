"""Fixed steps along a way: as translated and as ordinary Python, and however a run is cut up."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from ab_sim.base.sample_columns import ANGLE, COMMAND, STEP, TIME
from ab_sim.drive.steps import StepPlan
from ab_sim.engine.compiling import compiled
from ab_sim.engine.events.run import Run
from ab_sim.engine.integrate.steppers.rk8 import RK8
from ab_sim.engine.kernels.code import code_of
from ab_sim.engine.stepping.advance import advance
from ab_sim.engine.stepping.assemble import run_of
from ab_sim.engine.stepping.fixed_step import DRIFT, FixedSteps, normalise, take_out_turns
from ab_sim.model.dynamics.assemble import (
    MOST_ANGLE,
    start_discrete_state,
    start_state,
    state_bounds,
    system_of,
)
from ab_sim.model.dynamics.system import DIRECTION, LOADED, TURNS
from ab_sim.model.spindle import SpeedSchedule
from ab_sim.model.spindle.step_ranges import StepResolution
from ab_sim.scene import load_scene
from tests.events.track import run_on_track

Advance = Callable[..., int]
SCENES = {
    "no-ball": [],
    "thesis-baseline": ["effects.rolling_friction="],
    "packed-balls": ["balls.count=3", "start.speed=95"],
    "everything": ["start.speed=60"],
    "couple-unbalance": ["start.speed=60"],
}
"""No balls, smooth motion, impacts, everything, in space; near where there is something to see."""


class Drive:
    """A scene's Run, and how far it has gone.

    Parameters
    ----------
    name
        Of a scene that ships.
    translated
        Whether as machine code.
    """

    def __init__(self, name: str, translated: bool = True) -> None:
        scene = load_scene(name, [*SCENES[name], "solver.stepper=rk8"])
        system, step = system_of(scene), float(scene.solver.step)
        profile = SpeedSchedule.of_scene(scene)
        self.legs = [
            leg for leg, _ in StepPlan.along(profile, StepResolution(step, step), 0).after(0)
        ]
        weights = RK8.weights
        kind = self.legs[0].kind
        assert all(leg.kind is kind for leg in self.legs)
        code = code_of(system, kind)
        address = code.step(weights)
        state, discrete = start_state(scene, system), start_discrete_state(scene, system)
        bounds = state_bounds(system, step)
        self.run = run_of(system, code, address, step, state, discrete, bounds)
        self.width = self.run.ball_column + ANGLE + 2 * self.run.balls.number
        self.width += int(self.run.balls.has_motor)
        self.advance: Advance = lambda *given: advance(FixedSteps(self.run), *given)
        if translated:
            self.advance = compiled(advance).bind(FixedSteps(self.run))
        self.done = 0
        self.take(0)

    def take(self, steps: int) -> np.ndarray:
        """So many steps; their samples."""
        samples = np.zeros((steps, self.width))
        (leg,) = self.legs
        at = np.searchsorted(leg.table[:, 0], self.done, side="right") - 1
        at = int(np.searchsorted(leg.table[:, 0], leg.table[at, 0]))
        assert self.advance(leg.table, at, self.done, steps, math.nan, samples) == steps
        self.done += steps
        return samples

    def now(self) -> tuple[Any, ...]:
        """All that a run is made of."""
        run = self.run
        return run.state.tolist(), run.balls.discrete.tolist(), run.work.counts.tolist()


@pytest.mark.parametrize("name", SCENES)
def test_machine_code_says_what_python_says(name: str) -> None:
    one, other = Drive(name, True), Drive(name, False)
    np.testing.assert_array_equal(one.take(150), other.take(150))
    assert one.now() == other.now()


@pytest.mark.parametrize("name", SCENES)
def test_a_run_may_be_cut_up_anywhere(name: str) -> None:
    """Whatever is asked for at a time, and recorded between: to the last bit."""
    whole, parts = Drive(name), Drive(name)
    samples = whole.take(2000)
    rng, pieces = np.random.default_rng(1), []
    while parts.done < 2000:
        pieces.append(parts.take(min(int(rng.integers(1, 60)), 2000 - parts.done)))
        before = parts.now()
        present = np.zeros((1, parts.width))
        (leg,) = parts.legs
        line = leg.table[:, 0].searchsorted(parts.done, side="right") - 1
        given = leg.table, int(line), parts.done, 0, math.nan, present
        assert parts.advance(*given) == 0
        assert parts.now() == before, "to record the present changes nothing"
        # On the profile a time is what it is there: the same but for rounding.
        np.testing.assert_allclose(present[0], pieces[-1][-1], rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(np.concatenate(pieces), samples)
    assert parts.now() == whole.now()
    assert whole.run.work.counts[0] > 10 or not whole.run.has_events


def test_a_run_that_leaves_its_bounds_keeps_the_last_good_state() -> None:
    run = run_on_track([0.0], [1.0])
    run.work.bounds[0] = 0.55
    way, samples = np.array([[0.0, 100.0, 0.0, 0.0, 0.1]]), np.zeros((20, 7))
    assert advance(FixedSteps(run), way, 0, 0, 20, math.nan, samples) == -1 - 5
    assert run.state[0] == pytest.approx(0.5, abs=1e-12)
    assert run.work.trial[0] == pytest.approx(0.6, abs=1e-12)


def test_branches_are_checked_without_a_step_but_not_to_record() -> None:
    """A ball that sticks though its force exceeds friction."""
    pushed, loaded = (lambda t, y: 5.0), (lambda t, y: 1.0)
    run = run_on_track([0.0], [0.0], force=pushed, friction=0.5, load=loaded)
    way = np.array([[0.0, 100.0, 0.0, 0.0, 0.1]])
    for room, direction in ((1, 0), (0, 1)):
        assert advance(FixedSteps(run), way, 0, 0, 0, math.nan, np.zeros((room, 7))) == 0
        assert run.balls.discrete[0, DIRECTION] == direction


def test_samples_say_when_they_are_and_what_is_asked_for() -> None:
    run = run_on_track([0.0], [1.0])
    way, samples = np.array([[0.0, 100.0, 0.0, 0.0, 0.1]]), np.zeros((4, 7))
    assert advance(FixedSteps(run), way, 0, 3, 4, 7.5, samples) == 4
    assert samples[:, STEP].tolist() == [4, 5, 6, 7] and (samples[:, COMMAND] == 7.5).all()
    assert samples[:, TIME].tolist() == [k * 0.1 for k in (4, 5, 6, 7)]
    present = np.zeros((1, 7))
    assert advance(FixedSteps(run), way, 0, 7, 0, math.nan, present) == 0
    assert present[0, STEP] == 7 and present[0, ANGLE] == pytest.approx(0.7)


def test_a_step_in_parts_makes_one_sample() -> None:
    """Two parts of step 1, on two pieces of the profile, between whole steps."""
    lines = [
        [0, 1, 0.0, 0.0, 0.1],
        [1, 1, 0.0, 0.0, 0.03],
        [1, 2, 0.13, 0.03, 0.07],
        [2, 9, 0.13, 0.0, 0.1],
    ]
    run = run_on_track([0.0], [1.0])
    samples = np.zeros((3, 7))
    assert advance(FixedSteps(run), np.array(lines, float), 0, 0, 3, math.nan, samples) == 3
    np.testing.assert_allclose(samples[:, ANGLE + 3], [0.1, 0.2, 0.3], atol=1e-15)
    # The time on the piece of the profile that is in force at the end.
    np.testing.assert_allclose(samples[:, ANGLE], [0.1, 0.07, 0.17], atol=1e-15)


def test_a_stepper_forgets_at_a_kink_only() -> None:
    run = run_on_track([0.0], [1.0])
    run = run._replace(work=run.work._replace(memory=np.ones((2, 2))))
    lines = [[0, 5, 0.0, 0.0, 0.1], [5, 9, 0.5, 0.0, 0.1]]
    way, samples = np.array(lines, float), np.zeros((3, 7))
    run.work.smooth[0] = 0.0
    advance(FixedSteps(run), way, 0, 0, 3, math.nan, samples)
    assert run.work.memory.all()
    advance(FixedSteps(run), way, 0, 3, 3, math.nan, samples)
    assert not run.work.memory.any() and run.work.smooth[0] == 0.5


def test_whole_turns_are_counted_apart() -> None:
    run = run_on_track([6.0, -6.0], [7.0, -7.0], load=lambda t, y: 1.0)
    run.balls.discrete[:2, DIRECTION] = 1, -1
    run.balls.discrete[:2, LOADED] = 1
    way, samples = np.array([[0.0, 100.0, 0.0, 0.0, 0.1]]), np.zeros((30, 9))
    assert advance(FixedSteps(run), way, 0, 0, 30, math.nan, samples) == 30
    assert run.balls.discrete[:2, TURNS].tolist() == [4, -4] and abs(run.state[:2]).max() < 7
    angles = 6.0 + 0.7 * np.arange(1, 31)
    np.testing.assert_allclose(samples[:, ANGLE + 3], angles, rtol=1e-14)
    np.testing.assert_allclose(samples[:, ANGLE + 5], -angles, rtol=1e-14)


def test_an_angle_keeps_its_digits() -> None:
    """2 pi is not a floating-point number: what is left of it is taken out, too."""
    state, discrete = np.array([0.3 + 2.0 * math.pi]), np.zeros((1, 4), np.int64)
    assert take_out_turns(state, 0, discrete, 0) and discrete[0, TURNS] == 1
    assert state[0] == pytest.approx(0.3, abs=1e-15)
    assert not take_out_turns(state, 0, discrete, 0)


@pytest.mark.parametrize("turns", [-143_239_448_782_705, -7, 2, 3, 10**9])
def test_any_number_of_turns_is_taken_out_at_once(turns: int) -> None:
    """In machine code, where one at a time would take days."""
    state, discrete = np.array([turns * 2.0 * math.pi]), np.zeros((1, 4), np.int64)
    state += math.copysign(0.3, turns)
    within = math.atan2(math.sin(state[0]), math.cos(state[0]))
    assert compiled(take_out_turns)(state, 0, discrete, 0)
    assert abs(discrete[0, TURNS] - turns) <= 1 and abs(state[0]) <= 2.0 * math.pi
    assert math.remainder(state[0] - within, 2.0 * math.pi) == pytest.approx(
        0.0, abs=math.ulp(turns * 2.0 * math.pi)
    )


@pytest.mark.parametrize("name", ["thesis-baseline", "everything"])
@pytest.mark.parametrize("angle", [9e14, 9e15, -1e300])
def test_a_step_ends_whatever_angle_it_begins_with(name: str, angle: float) -> None:
    drive = Drive(name)
    drive.run.state[drive.run.balls.first_angle] = angle
    (leg,) = drive.legs
    taken = drive.advance(leg.table, 0, 0, 5, math.nan, np.zeros((5, drive.width)))
    assert (taken == 5) is (abs(angle) < MOST_ANGLE)


def test_a_quaternion_is_made_a_unit_one_where_it_has_drifted() -> None:
    state = np.array([9.0, 0.5, 0.5, 0.5, 0.5, 9.0])
    assert not normalise(state, 1)
    state[1:5] *= 1.0 + DRIFT
    assert normalise(state, 1)
    assert state[1:5] @ state[1:5] == pytest.approx(1.0, abs=1e-15) and state[[0, 5]].all()


def test_a_run_is_what_the_driver_is_made_for() -> None:
    """Its arrays fit: machine code takes it as it is."""
    run: Run = Drive("packed-balls").run
    assert compiled(advance).bind(FixedSteps(run))
