"""Collocation along speed profiles: the same bits however it is run, and as exact as is asked."""

from collections import OrderedDict
from functools import partial
from typing import Any

import numpy as np
import pytest

from ab_sim.collocation.assemble import ByCollocation
from ab_sim.collocation.run import SAMPLES, head_of
from ab_sim.compiling import Compiled
from ab_sim.drive import Drive
from ab_sim.dynamics.assemble import system_of
from ab_sim.integrate.steppers.collocation import (
    EIGHT,
    FINE,
    SIXTEEN,
    Setting,
    collocation,
    setting_for,
)
from ab_sim.kernels import code
from ab_sim.scene import Scene, load_scene
from ab_sim.tracing import machine_code
from tests.collocation import driven
from tests.collocation.driven import Collocated
from tests.deck.scenes import odd
from tests.effects.parts import scene_of
from tests.hard_cases.extremes import RUBBING
from tests.hard_cases.extremes import scene_of as extreme
from tests.integrate.test_collocation_of_deck_models import IN_SPACE
from tests.integrate.test_event_fallback import STICK_SLIP

SAFETY = {4: 60.0, 8: 3.0, 16: 2.0}
"""Errors of whole runs beside what each step may leave, by its nodes: four are too few for what
decays behind a kink of the speed."""


def hold(step: float) -> Scene:
    """The thesis' hold without friction: pieces of a profile, of one kind and another."""
    return load_scene("thesis-hold", ["effects.rolling_friction=", f"solver.step={step}"])


def in_space(step: float) -> Scene:
    return odd("smooth", IN_SPACE, {"solver": {"step": step}})


def weak_motor(step: float) -> Scene:
    return load_scene("weak-motor", [f"solver.step={step}"])


def stick_slip(step: float) -> Scene:
    return scene_of("friction", STICK_SLIP, {"solver": {"step": step}})


def packed(step: float) -> Scene:
    """A row of four around the unbalance, which breaks up, meets again, and rubs."""
    row = {"count": 4, "mass": 5e-4, "radius": 1e-3}
    effects = {**RUBBING, "gravity": None, "viscous_drag": {"coefficient": 0.5}}
    return extreme(balls=row, effects=effects, start={"speed": 90.0}, solver={"step": step})


MADE: dict[str, Any] = {
    "hold": hold,
    "in space": in_space,
    "motor": weak_motor,
    "stick-slip": stick_slip,
    "packed": packed,
}


def balls(run: Collocated, samples: np.ndarray) -> np.ndarray:
    """Angles in samples."""
    n = len(run.system.balls)
    first = 2 + run.of(next(iter(run.step_plan.kinds))).run.ball_column
    return samples[:, first : first + 2 * n : 2]


@pytest.mark.parametrize("name", ["hold", "motor", "stick-slip"])
def test_machine_code_has_the_bits_of_python(name: str) -> None:
    found = []
    for plain in (False, True):
        run = Collocated(MADE[name](2e-3), plain=plain, energy_balance=name != "hold")
        run.advance(0)
        found.append(run.advance(40).tobytes() + run.state.tobytes())
    assert found[0] == found[1]


@pytest.mark.parametrize("setting", [EIGHT, SIXTEEN])
@pytest.mark.parametrize("name", MADE)
def test_to_the_bit_however_it_is_cut_up(name: str, setting: Setting) -> None:
    """In groups, with looks at the present in between, memory and all."""
    scene = MADE[name](1e-3)
    one, other = (Collocated(scene, setting=setting, energy_balance=True) for _ in range(2))
    for run in (one, other):
        run.advance(0)
    whole, parts = one.advance(300).tobytes(), b""
    for count in (1, 0, 30, 3, 1, 102, 1, 1, 1, 160):
        other.advance(0, record=True)
        parts += other.advance(count).tobytes()
    assert whole == parts
    assert one.state.tobytes() == other.state.tobytes()
    assert one.discrete.tobytes() == other.discrete.tobytes()


@pytest.mark.parametrize("nodes", [4, 8, 16])
def test_errors_are_what_was_asked_for(nodes: int) -> None:
    """Whatever the nodes, and whatever the samples."""
    samples = tuple(n for n in SIXTEEN.samples if n <= 2 * nodes)
    true = Collocated(hold(1e-3), tolerance=1e-14, setting=SIXTEEN)
    exact = balls(true, true.advance(6000))
    for step in (1e-3, 5e-3, 0.02):
        for tolerance in (1e-7, 1e-9, 1e-11):
            setting = Setting(nodes, samples, min(nodes, 10))
            run = Collocated(hold(step), tolerance=tolerance, setting=setting)
            found = balls(run, run.advance(round(6.0 / step)))
            every = round(step / 1e-3)
            assert np.abs(found - exact[every - 1 :: every]).max() < SAFETY[nodes] * tolerance


def test_more_nodes_make_longer_steps() -> None:
    lengths = []
    for setting in (EIGHT, SIXTEEN):
        run = Collocated(hold(1e-3), tolerance=1e-12, setting=setting)
        run.advance(5900)
        lengths.append(head_of(run.of(next(iter(run.step_plan.kinds))))[SAMPLES])
    assert lengths[1] > lengths[0] >= 4


def test_nodes_follow_from_tolerance_and_scene() -> None:
    found = [setting_for(collocation(t, 0.0, 0.0).weights, True) for t in (1e-3, FINE, 1e-12)]
    assert found == [EIGHT, EIGHT, SIXTEEN]
    assert setting_for(collocation(1e-12, 0.0, 0.0).weights, False) == EIGHT
    named = collocation(1e-3, 0.0, 16.0)
    assert (setting_for(named.weights, False), named.order) == (SIXTEEN, 32)


@pytest.mark.parametrize(
    ("name", "nodes"), [("hold", 16), ("motor", 8), ("stick-slip", 8), ("in space", 8)]
)
def test_events_and_a_deck_in_space_call_for_fewer_nodes(name: str, nodes: int) -> None:
    scene = MADE[name](1e-3)
    changed = {"stepper": "collocation", "parameters": {"tolerance": 1e-12}}
    solver = scene.solver.model_copy(update=changed)
    drive = Drive(scene.model_copy(update={"solver": solver}))
    assert drive.stepper.weights.setting is None
    made = ByCollocation(system_of(scene), drive.stepper.weights)
    assert made.nodes == nodes


def test_a_run_that_diverges_keeps_its_last_good_sample() -> None:
    """In the middle of a step, however it got there: bounds are drawn where a sound run goes."""
    found = []
    for group in (1, 1000):
        run = Collocated(hold(1e-3))
        for kind in run.step_plan.kinds:
            own = run.of(kind).run
            own.work.bounds[own.balls.first_rate :] = 5.0
        with pytest.raises(FloatingPointError):
            for _ in range(6000 // group):
                run.advance(group)
        found.append((run.taken, run.state.tobytes()))
    assert found[0] == found[1]
    assert found[0][0] > 0


@pytest.mark.parametrize("name", ["hold", "packed", "motor"])
def test_the_same_bits_without_wide_vectors(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """As on a processor that has no AVX-512, control and all."""
    found = []
    for features in (None, "+avx2,+fma"):
        if features is not None:
            made = partial(machine_code._machine, features)
            monkeypatch.setattr(machine_code, "_machine", lambda _, effort, made=made: made(effort))
        monkeypatch.setattr(code, "_codes", OrderedDict())
        run = Collocated(MADE[name](1e-3), setting=SIXTEEN, energy_balance=True)
        monkeypatch.setattr(driven, "compiled", Compiled)
        run.advance(0)
        found.append(run.advance(200).tobytes())
    assert found[0] == found[1]
