"""One collocation step: its order, and the error that it says it has."""

from typing import Any, NamedTuple

import numpy as np
import pytest

from ab_sim.collocation.run import LENGTH, STRIDE, WITHIN, CollocationRun, head_of
from ab_sim.collocation.step import begin_anew, put_states, solve_step
from ab_sim.integrate.steppers.collocation import EIGHT, Setting
from ab_sim.scene import load_scene
from tests.collocation.driven import Collocated, Runge

SMOOTH = [
    *("effects.rolling_friction=", "profile=", "start.speed=150", "start.ball_angles=[0.5,2.0]"),
    "effects.viscous_drag.coefficient=1e-4",
]
"""The thesis' drive at a constant speed, without friction; much drag would make the order less."""
EXACT = 1e-15


def at_nodes(own: CollocationRun, group: int) -> np.ndarray:
    """States at nodes (-1) or samples of the step in memory, and their times; a line for each."""
    count, states = own.method.nodes.at.size, own.run.state.size
    put_states(own, group, own.buffers.at_nodes)
    lines = own.buffers.at_nodes.reshape(-1, STRIDE * count)[: states + 1, :count]
    return lines.T.copy()


class Begun(NamedTuple):
    """A step from the scene's start, f having been constant."""

    own: CollocationRun
    error: float
    within: float

    def apart(self, group: int) -> np.ndarray:
        """How far states at its samples or nodes are from rk8's."""
        found = at_nodes(self.own, group)
        true = Runge(load_scene("thesis-hold", SMOOTH)).at(found[:, -1])
        apart: np.ndarray = np.abs(found[:, :-1] - true)
        return apart


def begun(length: float, setting: Setting, samples: int = 1) -> Begun:
    scene = load_scene("thesis-hold", [*SMOOTH, "solver.step=0.01"])
    one = Collocated(scene, tolerance=EXACT, setting=setting, plain=True)
    one.advance(0)
    (own,) = (one.of(kind) for kind in one.step_plan.kinds)
    own.run.work.trial[:] = own.run.state
    begin_anew(own, 0.0, length, own.run.state)
    head_of(own)[LENGTH] = length
    error, within = solve_step(own, 0.0, length, samples, 1.0, own.run.state)
    assert within == own.result[WITHIN]
    return Begun(own, error, within)


@pytest.mark.parametrize(
    ("setting", "lengths"),
    [(Setting(4, (1,), 4), (0.003, 0.006)), (Setting(8, (1,), 8), (0.02, 0.03))],
)
def test_the_order_at_the_end_is_twice_the_number_of_nodes(
    setting: Setting, lengths: tuple[float, float]
) -> None:
    """Of one step the error is a power more."""
    errors = [begun(length, setting).apart(0)[0, 4:6].max() for length in lengths]
    order = np.log(errors[1] / errors[0]) / np.log(lengths[1] / lengths[0])
    assert order > 2 * setting.nodes


@pytest.mark.parametrize("nodes", [4, 8, 16])
@pytest.mark.parametrize("turn", [0.2, 0.35, 0.5])
def test_errors_within_a_step_are_no_more_than_said(nodes: int, turn: float) -> None:
    """For spindles that turn so far [rad] from node to node; and not said to be much more."""
    step = begun(turn * nodes / 150.0, Setting(nodes, (1, 2, 3, 4), nodes), 4)
    within = step.apart(-1)[:, 4:6].max()
    assert within < 10.0 * step.within + 1e-13
    assert step.within < 1e3 * within + 1e-12


def test_a_step_that_is_refused_leaves_no_trace() -> None:
    setting: Any = EIGHT
    step = begun(0.02, setting)
    own = step.own
    before = own.run.work.memory.copy()
    error, _ = solve_step(own, 0.02, 0.06, 1, 1e-16, own.run.work.trial)
    assert error > 1e-16
    assert own.run.work.memory.tobytes() == before.tobytes()
