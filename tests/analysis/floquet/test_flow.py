"""Steps with duals: the run's own values, and the derivatives of those very steps."""

import numpy as np
import pytest

from ab_sim.analysis.held_speed import held
from ab_sim.drive import Drive
from ab_sim.engine.integrate.registry import steppers
from ab_sim.engine.integrate.vector_field import Flow
from ab_sim.engine.kernels.runge_kutta import Tableau
from ab_sim.model.dynamics.assemble import start_state
from ab_sim.scene import Scene, load_scene
from tests.analysis.floquet.scenes import deck, plane

SCENES = {"plane": plane, "deck": lambda: deck("start.deck.tilt=[0.01, -0.02, 0.005]")}
SPEED, DURATION = 120.0, 0.05


def flow_of(scene: Scene, stepper: str = "rk8") -> Flow:
    field = held(scene, SPEED)
    return Flow(field.system, field.scheduled, field.discrete_state, steppers()[stepper])


@pytest.mark.parametrize("name", SCENES)
def test_derivatives_are_those_of_central_differences(name: str) -> None:
    scene = SCENES[name]()
    flow, start = flow_of(scene), start_state(scene, held(scene, SPEED).system)
    exact = flow.over(start, DURATION, 40).matrix
    names = flow.layout.names
    sizes = [1.0 if "ball" in x or "tilt" in x else 0.1 if "qua" in x else 0.03 for x in names]
    for j, size in enumerate(sizes):
        h = np.zeros(start.size)
        h[j] = 1e-3 * size
        one, two, three = (
            (
                flow.over(start + c * h, DURATION, 40, columns=0).states[-1]
                - flow.over(start - c * h, DURATION, 40, columns=0).states[-1]
            )
            / (2 * c * h[j])
            for c in (1, 2, 3)
        )
        sixth = (15 * one - 6 * two + three) / 10
        scale = np.abs(exact[:, j]).max()
        np.testing.assert_allclose(sixth, exact[:, j], rtol=0, atol=1e-7 * scale)


def test_values_are_those_of_the_drive() -> None:
    """With the same steps, to rounding."""
    scene = deck("start.speed=120", "start.deck.tilt=[0.01, -0.02, 0.005]")
    drive = Drive(scene)
    states = [drive.snapshot().state]
    for _ in range(50):
        drive.advance(1)
        states.append(drive.snapshot().state)
    found = flow_of(scene).over(states[0], 50 * scene.solver.step, 50, columns=0).states
    scale = np.abs(states).max(axis=0)
    assert (np.abs(found - states) <= 1e-12 * scale + 1e-18).all()


@pytest.mark.parametrize("name", SCENES)
def test_fewer_columns_are_the_first_ones(name: str) -> None:
    scene = SCENES[name]()
    flow, start = flow_of(scene), start_state(scene, held(scene, SPEED).system)
    whole, part = flow.over(start, DURATION, 30), flow.over(start, DURATION, 30, columns=5)
    assert part.matrix.tobytes() == whole.matrix[:, :5].tobytes()
    assert part.states.tobytes() == whole.states.tobytes()


def explicit_ones() -> list[str]:
    return [name for name, each in steppers().items() if isinstance(each.weights, Tableau)]


@pytest.mark.parametrize("stepper", explicit_ones())
def test_derivatives_converge_at_the_stepper_s_order(stepper: str) -> None:
    """Those of a method of order p are of order p: they solve the linearised equations so."""
    scene, order = plane(), steppers()[stepper].order
    start = start_state(scene, held(scene, SPEED).system)
    exact = flow_of(scene).over(start, DURATION, 1000).matrix
    steps = np.array([16, 20, 25, 32] if order > 6 else [400, 500, 640, 800])
    flow = flow_of(scene, stepper)
    errors = [np.abs(flow.over(start, DURATION, int(n)).matrix / exact - 1.0).max() for n in steps]
    slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert -slope == pytest.approx(order, abs=0.3)


def test_events_and_steppers_that_take_floats_only_are_refused() -> None:
    field = held(load_scene("thesis-baseline"), SPEED)
    with pytest.raises(ValueError, match="has events"):
        Flow(field.system, field.scheduled, field.discrete_state, steppers()["rk8"])
    only = next(s for s in steppers().values() if not s.takes_lanes)
    with pytest.raises(ValueError, match=f"{only.name}: .* explicit Runge-Kutta"):
        flow_of(plane(), only.name)
