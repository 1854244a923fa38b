"""What becomes of eight steps' results, beside what becomes of one's."""

import math

import numpy as np
import pytest

from ab_sim.engine.events.location import within_bounds
from ab_sim.engine.kernels.code import called, code_of
from ab_sim.engine.stepping.assemble import run_of
from ab_sim.engine.stepping.emitted import MOVED, SOUND, settle_address
from ab_sim.engine.stepping.fixed_step import unwind
from ab_sim.engine.stepping.side_by_side import LANES, stacked
from ab_sim.model.dynamics.assemble import start_discrete_state, system_of
from ab_sim.model.dynamics.system import TURNS, layout_of
from ab_sim.model.spindle import Ramp
from ab_sim.scene import load_scene


@pytest.mark.parametrize("name", ["weak-motor", "feeding-deck", "no-ball"])
def test_it_is_what_becomes_of_a_run_alone(name: str) -> None:
    """Turns of balls and spindle, a quaternion off its length, numbers out of bounds, NaN."""
    scene, rng = load_scene(name), np.random.default_rng(1)
    system = system_of(scene)
    layout, code = layout_of(system), code_of(system, Ramp)
    quaternion = type(system.deck_model).UNIT_AT
    settle = settle_address(code, layout, quaternion, LANES)
    moved = 0
    for _ in range(20):
        trial = rng.normal(0.0, 5.0, (layout.size, LANES)).clip(-12.5, 12.5)
        if quaternion >= 0:
            unit = trial[quaternion : quaternion + 4]
            unit[:] = np.round(unit / np.linalg.norm(unit, axis=0), 13)
            unit[:, :4] *= 1.0 + 1e-11
        trial[rng.integers(layout.size), 0], trial[0, 1] = math.nan, -1e9
        before, bounds = rng.normal(size=(layout.size, LANES)), np.full((layout.size, LANES), 1e6)
        lengths = np.where(np.arange(LANES) == 2, 0.0, 1e-3)
        state, said = stacked(list(before.T)), stacked([np.array([1.0, 0.0])] * LANES)
        lines = len(system.balls) + (layout.spindle.stop > layout.spindle.start)
        turns = stacked([np.full(lines, 3.0)] * LANES)
        arrays = stacked([lengths]).reshape(-1), state, stacked(list(trial.T)), bounds, turns, said
        called(settle, *arrays)
        for lane in range(LANES):
            discrete = start_discrete_state(scene, system)
            discrete[:, TURNS] = 3
            taken = trial[:, lane] if lengths[lane] else before[:, lane]
            run = run_of(system, code, 0, 1e-3, taken.copy(), discrete, bounds[:, lane])
            sound = within_bounds(trial[:, lane], bounds[:, lane]) or not lengths[lane]
            assert said[SOUND, lane] == float(sound)
            if sound:
                assert said[MOVED, lane] == float(unwind(run))
                assert state[:, lane].tobytes() == run.state.tobytes()
                assert turns[:, lane].tolist() == discrete[:lines, TURNS].tolist()
                moved += int(said[MOVED, lane])
    assert moved > 20 or not lines
