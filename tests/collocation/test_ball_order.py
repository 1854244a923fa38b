"""Of many balls one after the other: the order, and that it changes no bit."""

import functools

import numpy as np
import pytest

from ab_sim.collocation import assemble, emission
from ab_sim.collocation.ball_order import ball_by_ball
from ab_sim.collocation.emission import ball_of
from ab_sim.drive import Drive
from ab_sim.scene import load_scene
from ab_sim.tracing import Graph, cos, lowered, total
from ab_sim.tracing.expression import Expression, reached
from ab_sim.tracing.functions import lane
from ab_sim.tracing.unrolled import unrolled

BALLS = 19
"""Groups of eight, and some."""
MANY = (
    *("effects.rolling_friction=", f"balls.count={BALLS}", f"balls.mass={2e-3 / BALLS}"),
    f"start.ball_angles={[round(6.0 * k / BALLS, 3) for k in range(BALLS)]}",
    "solver.stepper=collocation",
)


def nodes_in_order() -> tuple[list[Expression], list[Expression]]:
    """Nodes of formulas with one sum over the balls behind another, as written, and ordered."""
    graph = Graph()
    p, q = (graph.input(name, each=True) for name in "pq")
    first = total(cos(p) * lane(q, 1)) * 2.0
    second = total(q * first + p) - first
    columns = unrolled([p * second, second], BALLS)
    roots = lowered([x for column in columns for x in column])
    found = reached(roots)
    own = [x for x in sorted(found, key=lambda x: x.number) if x.args and x.op != "lane"]
    return own, ball_by_ball(own, BALLS, ball_of)


def test_arguments_come_first() -> None:
    written, order = nodes_in_order()
    assert {x.number for x in order} == {x.number for x in written}
    at = {x.number: k for k, x in enumerate(order)}
    for x in order:
        assert all(
            at[argument.number] < at[x.number] for argument in x.args if argument.number in at
        )


def test_a_ball_is_done_with_before_the_next_one() -> None:
    _, order = nodes_in_order()
    touched = [
        ball
        for x in order
        for argument in x.args
        if argument.op == "input" and (ball := ball_of(argument.payload)) is not None
    ]
    # Three rounds: for each sum one, and for what comes behind both.
    assert sum(a > b for a, b in zip(touched, touched[1:], strict=False)) == 2


def test_the_order_changes_no_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    scene, found = load_scene("thesis-hold", MANY), []
    for at_once in (emission.AT_ONCE, 10**9):
        monkeypatch.setattr(emission, "AT_ONCE", at_once)
        made = functools.cache(assemble.CollocationCode)
        monkeypatch.setattr(assemble, "collocation_code", made)
        drive = Drive(scene)
        found.append(np.concatenate([drive.advance(steps).samples for steps in (1, 60, 3, 200)]))
    assert found[0].tobytes() == found[1].tobytes()
