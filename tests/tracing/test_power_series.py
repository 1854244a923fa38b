"""Taylor coefficients of expressions, beside mpmath's, and what has none."""

import itertools
from collections.abc import Callable
from typing import Any

import mpmath
import pytest

from ab_sim.tracing import Graph, Level, cos, lowered, sin, sqrt, where
from ab_sim.tracing.derivatives import NotAnalyticError, PowerSeries
from ab_sim.tracing.expression import Expression, reachable_nodes
from tests.tracing.plain import python_function

AT, ORDER = 0.7, 9
"""Where, and up to which power."""
MP = {"cos": mpmath.cos, "sin": mpmath.sin, "sqrt": mpmath.sqrt}
TRACED = {"cos": cos, "sin": sin, "sqrt": sqrt}
FORMULAS: dict[str, Callable[..., Any]] = {
    "a product": lambda t, of: (1.0 + t) * (2.0 - t * t),
    "a square": lambda t, of: (1.0 + t * t) ** 2,
    "a quotient": lambda t, of: (1.0 + t) / (2.0 + t * t),
    "a root": lambda t, of: of["sqrt"](1.0 + t + t * t),
    "a cosine": lambda t, of: of["cos"](3.0 * t + t * t),
    "a sine": lambda t, of: t * of["sin"](t * t),
    "all of them": lambda t, of: -of["cos"](of["sqrt"](2.0 + of["sin"](t))) / (1.0 + t * t),
}


@pytest.mark.parametrize("name", FORMULAS)
def test_coefficients_are_those_of_taylor(name: str) -> None:
    graph = Graph()
    t = graph.input("t")
    series = PowerSeries({t: graph.constant(1.0)})
    found = FORMULAS[name](t, TRACED)
    roots = lowered([series.coefficient(found, k) for k in range(ORDER + 1)])
    values = python_function(roots, {"t": "t"})(t=AT)
    with mpmath.workdps(40):
        exact = mpmath.taylor(lambda x: FORMULAS[name](x, MP), AT, ORDER)
    size = max(abs(float(x)) for x in exact)
    assert values == pytest.approx([float(x) for x in exact], rel=1e-12, abs=1e-14 * size)


def test_those_of_a_motion_follow_from_its_rates() -> None:
    """x'' = -x, of which the series is known."""
    graph = Graph()
    x, v = graph.input("x"), graph.input("v")
    series = PowerSeries({x: v, v: -x})
    roots = [series.coefficient(x * x + v * v, k) for k in range(5)]
    values = python_function(lowered(roots), {"x": "x", "v": "v"})(x=0.3, v=-1.1)
    assert values[0] == pytest.approx(0.3**2 + 1.1**2)
    assert values[1:] == pytest.approx([0.0] * 4, abs=1e-15)


def test_what_is_known_before_the_run_has_no_more_than_one() -> None:
    graph = Graph()
    k, x = graph.input("k", Level.PARAMETER), graph.input("x")
    series = PowerSeries({x: graph.constant(1.0)})
    assert series.coefficient(k * k, 0) is k * k
    assert series.coefficient(k * k, 3).payload == 0.0
    # A product with it is no sum of products.
    assert series.coefficient(k * x, 1) is k


@pytest.mark.parametrize(
    ("formula", "words"),
    [
        (lambda x: abs(x), "abs has no Taylor series: abs(x)"),
        (
            lambda x: 2.0 * where(x < 0.0, x, 1.0),
            "where has no Taylor series: where((x < 0), x, 1)",
        ),
    ],
)
def test_what_has_no_series_is_named(formula: Any, words: str) -> None:
    graph = Graph()
    x = graph.input("x")
    series = PowerSeries({x: graph.constant(1.0)})
    with pytest.raises(NotAnalyticError) as caught:
        series.coefficient(formula(x), 2)
    assert str(caught.value) == words


def test_terms_with_one_factor_are_multiplied_by_it_once() -> None:
    graph = Graph()
    k = graph.input("k", Level.PARAMETER)
    x, y = graph.input("x"), graph.input("y")
    series = PowerSeries({x: y, y: -x})
    nodes = reachable_nodes([series.coefficient(k * x * y - (k * y) * y, 3)])
    assert sum(k in node.args for node in nodes) == 1


def test_what_is_computed_last_is_added_last() -> None:
    """Each order waits for a few operations of the one before, not for a whole sum."""
    graph = Graph()
    x, y = graph.input("x"), graph.input("y")
    series = PowerSeries({x: x * y, y: x * x - y})
    coefficients = [series.coefficient(x, k) for k in range(12)]
    depths: dict[Expression, int] = {}
    for node in reachable_nodes(coefficients):
        depths[node] = 1 + max((depths[arg] for arg in node.args), default=0)
    waits = [depths[b] - depths[a] for a, b in itertools.pairwise(coefficients)]
    assert max(waits) <= 6
