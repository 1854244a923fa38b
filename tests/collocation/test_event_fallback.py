"""Events within a collocation step: polynomials in pieces, and the event functions of scenes."""

from typing import Any

import numpy as np
import pytest

from ab_sim.collocation.assemble import method_of
from ab_sim.collocation.event_fallback import (
    before_events,
    parts_of_step,
    pieces_above,
    put_event_functions,
    reach_of,
)
from ab_sim.collocation.nodes import PIECES, bounds_within_pieces, gauss
from ab_sim.compiling import compiled
from ab_sim.integrate.steppers.collocation import Setting
from ab_sim.scene import load_scene
from ab_sim.stepping.fixed_step import EqualSteps
from tests.collocation.driven import Collocated

COUNTS = (4, 8, 16)


class Own:
    """As much of a Collocation as polynomials need."""

    def __init__(self, nodes: int) -> None:
        self.method = method_of(Setting(nodes, (1,), nodes), 1e-9, 0.0)


@pytest.mark.parametrize("nodes", COUNTS)
def test_polynomials_lie_within_their_bounds(nodes: int) -> None:
    rng, at = np.random.default_rng(1), gauss(nodes)[0]
    for _ in range(20):
        polynomial = np.polynomial.Polynomial(rng.normal(size=nodes))
        values = polynomial(at)
        for scheduled, matrix in enumerate(bounds_within_pieces(at)):
            bounds, x = values @ matrix, np.linspace(0.0, 1.0, 50)
            if scheduled < PIECES:
                x = (scheduled + x) / PIECES
            room = 1e-11 * np.abs(values).max()
            assert bounds.min() - room < polynomial(x).min()
            assert polynomial(x).max() < bounds.max() + room
            assert bounds[[0, -1]] == pytest.approx(polynomial(x[[0, -1]]), abs=10 * room)


@pytest.mark.parametrize("nodes", COUNTS)
@pytest.mark.parametrize("crossed", [0.03, 0.21, 0.5, 0.74, 0.99])
def test_what_comes_before_a_crossing_is_found(nodes: int, crossed: float) -> None:
    """Never a piece too many, and hardly one too few, however the rest of a polynomial is."""
    own: Any = Own(nodes)
    rng = np.random.default_rng(7)
    at = own.method.lines[0]
    for power in (1, 3):
        more = 0.1 * rng.normal(size=max(nodes - 3 - power, 0))
        values = (crossed - at) ** power * np.polynomial.Polynomial([1.0, *more])(at)
        found = pieces_above(own, values, PIECES)
        assert found <= int(crossed * PIECES)
        if power < nodes - 2:
            assert found >= int(crossed * PIECES) - power
        assert pieces_above(own, values, 2) == min(found, 2)


def test_a_dip_between_nodes_is_seen() -> None:
    own: Any = Own(8)
    at = own.method.lines[0]
    middle = 0.5 * (at[3] + at[4])
    values = (at - middle) ** 2 - 1e-4
    assert values.min() > 0.0
    assert 0 < pieces_above(own, values, PIECES) <= int((middle - 0.01) * PIECES)
    assert pieces_above(own, values + 2e-4, PIECES) == PIECES


def test_what_is_seen_only_by_the_last_coefficients_is_in_doubt() -> None:
    """No function is known better than to what its polynomial leaves out."""
    own: Any = Own(8)
    at = own.method.lines[0]
    last = np.polynomial.legendre.legval(2.0 * at - 1.0, [0.0] * 7 + [1.0])
    assert pieces_above(own, 1.0 + 0.1 * last, PIECES) == PIECES
    assert pieces_above(own, 0.5 + 0.45 * last, PIECES) == 0


def begun(plain: bool, *changes: str) -> tuple[Any, Any]:
    """A scene with events on its way by collocation, and its Collocation."""
    scene = load_scene("thesis-hold", ["solver.step=0.002", *changes])
    run = Collocated(scene, plain=plain)
    run.advance(0)
    run.advance(200)
    return run, run.of(next(iter(run.step_plan.kinds)))


def test_event_functions_at_nodes_are_those_of_the_states_there() -> None:
    """Of balls that slide: path speed the way they slide, and the race's normal force."""
    _, own = begun(True)
    put_event_functions(own)
    n, line = own.run.balls.number, 3 * own.method.nodes.at.size
    first = own.run.balls.first_rate
    for i in range(n):
        direction = own.run.balls.discrete[i, 0]
        rates = own.buffers.at_nodes[(first + i) * line :][:8]
        assert own.buffers.values[:, i].tobytes() == (direction * rates).tobytes()
        assert np.all(own.buffers.values[:, 2 * n + i] > 0.0)


def test_machine_code_says_the_same() -> None:
    _, own = begun(True)
    expected = before_events(own)
    assert compiled(before_events)(own) == expected


def test_long_steps_of_the_other_stepper_are_cut() -> None:
    _, own = begun(True)
    parts = [parts_of_step(own, EqualSteps(0.0, 200, 0.0, length)) for length in (1e-5, 2e-3, 0.02)]
    assert parts[0] == 1 and parts[2] == 8 * parts[1] or parts[2] == 16 * parts[1]
    assert reach_of(1e-16) < reach_of(1e-9) <= 2.0
