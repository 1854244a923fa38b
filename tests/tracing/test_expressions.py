"""Expressions: what they fold, what they refuse, what they print, and their derivatives."""

import math

import numpy as np
import pytest

from ab_sim.tracing import (
    Expression,
    Graph,
    Level,
    cos,
    derivatives,
    lowered,
    sin,
    sqrt,
    total,
    where,
)
from ab_sim.tracing.expression import rows
from ab_sim.tracing.llvm_text import border
from ab_sim.tracing.notations import latex
from tests.tracing.ways_out import by_plain


def test_equal_nodes_are_one() -> None:
    graph = Graph()
    a, b = graph.input("a"), graph.input("b")
    assert a * b + 1.0 is b * a + 1.0
    assert a - b is not b - a
    assert graph.constant(0.0) is not graph.constant(-0.0)
    assert len(graph) == 9


def test_what_adds_nothing_is_not_there() -> None:
    graph = Graph()
    a, p = graph.input("a"), graph.input("p", per_ball=True)
    assert a + 0.0 is a and 1.0 * a is a and (-a) * -1.0 is a and a - 0 is a and a / 1.0 is a
    assert total(0.0 * p) is graph.constant(0.0)
    assert a**2 is a * a and where(a < 0, p, p) is p


def test_a_branch_on_a_traced_number_names_it() -> None:
    a = Graph().input("speed")
    with pytest.raises(TypeError, match=r"write where\(.*; it is \(speed < 2\)"):
        if a < 2.0:
            pass
    with pytest.raises(TypeError, match="from math; .*speed"):
        math.cos(a)
    with pytest.raises(TypeError, match="whole number, 1 to 16"):
        a**0.5


def test_graphs_do_not_mix() -> None:
    with pytest.raises(ValueError, match="different graphs"):
        Graph().input("a") + Graph().input("a")
    graph = Graph()
    graph.input("a")
    with pytest.raises(ValueError, match="'a' is there already"):
        graph.input("a", Level.PARAMETER)


def test_numpys_functions_take_expressions() -> None:
    a = Graph().input("a")
    assert np.cos(a) is cos(a) and np.sin(a) is sin(a) and np.sqrt(a) is sqrt(a)


def test_floats_go_through_the_same_formulas() -> None:
    assert cos(0.5) == math.cos(0.5) and sqrt(4.0) == 2.0 and where(1 < 2, 3.0, 4.0) == 3.0
    assert total([1.0, 2.0, 3.0]) == 6.0
    with pytest.raises(TypeError, match="^total of 1.0: "):
        total(1.0)


def test_sums_of_floats_have_the_order_of_sums_of_balls() -> None:
    numbers = np.random.default_rng(1).normal(size=21)
    graph = Graph()
    root = total(graph.input("p", per_ball=True))
    given = {name: np.zeros(1) for name in "abc"} | {"q": np.zeros((1, 21)), "p": numbers[None]}
    assert by_plain(lowered([root]), 21, given)[0, 0] == total(list(numbers))


def formula(a: Expression, p: Expression) -> Expression:
    pulled = where(p < 0.1, a * p, sqrt(abs(p) + 1.0))
    return total(sin(a * p) / (1.0 + cos(p) ** 2) - pulled * a) + abs(a) * a


@pytest.mark.parametrize("order", [1, 2])
def test_derivatives_are_the_limits_of_differences(order: int) -> None:
    """By one number and by one per ball, once and twice, against central differences."""
    graph = Graph()
    a, p = graph.input("a"), graph.input("p", per_ball=True)
    along = {a: graph.constant(0.7), p: graph.input("q", per_ball=True)}
    lower = formula(a, p)
    for _ in range(order - 1):
        (lower,) = derivatives([lower], along)
    (rate,) = derivatives([lower], along)
    random = np.random.default_rng(3)
    point, direction = random.normal(size=5), random.normal(size=5)

    def value(root: Expression, t: float) -> float:
        given = {"a": np.array([1.3 + 0.7 * t]), "b": np.zeros(1), "c": np.zeros(1)}
        given |= {"p": (point + t * direction)[None], "q": direction[None]}
        return float(by_plain(lowered([root]), 5, given)[0, 0])

    h = 1e-5
    differences = (value(lower, h) - value(lower, -h)) / (2 * h)
    assert value(rate, 0.0) == pytest.approx(differences, rel=1e-8)


def test_rows_change_by_what_the_matrix_does() -> None:
    graph = Graph()
    a, m = graph.input("a"), graph.input("m", per_ball=True)
    (fixed,) = derivatives([rows(m * a)], {a: graph.constant(2.0)})
    assert fixed is rows(m * 2.0)


def test_only_inputs_change() -> None:
    graph = Graph()
    a = graph.input("a")
    with pytest.raises(ValueError, match="^along: .*inputs only"):
        derivatives([a], {a * a: graph.constant(1.0)})


def test_what_is_known_before_a_run_is_computed_before() -> None:
    graph = Graph()
    k, m = (graph.input(name, Level.PARAMETER) for name in "km")
    x = graph.input("x")
    roots = lowered([x * (k / m) + cos(k), k * m])
    assert {latex(node) for node in border(roots, Level.PARAMETER)} >= {r"\frac{k}{m}", r"k \, m"}
    assert all(node.level <= Level.PARAMETER for node in border(roots, Level.PARAMETER))


def test_formulas_in_print() -> None:
    graph = Graph()
    k, x, m = graph.input("k"), graph.input("x"), graph.input("m", per_ball=True)
    theta = graph.input("theta", per_ball=True)
    greek = {"theta": r"\theta"}
    written = latex(-(k * (x - 2.0)) / (1.0 + k**2), lambda name: greek.get(name, name))
    assert written == r"\frac{-k \, \left(x - 2\right)}{1 + k^{2}}"
    written = latex(total(m * cos(theta)), lambda name: greek.get(name, name))
    assert written == r"\sum_i m_{i} \, \cos \theta_{i}"
    assert latex(where(x < 0.0, sqrt(k), abs(k))) == (
        r"\begin{cases} \sqrt{k} & x < 0 \\ \left|k\right| & \text{else} \end{cases}"
    )
