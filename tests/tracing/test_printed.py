"""Expressions in print: signs, brackets, powers and fractions, as LaTeX and as plain text."""

import pytest

from ab_sim.tracing import Expression, Graph, cos, sin, sqrt, total, where
from ab_sim.tracing.expression import across, fma, rows
from ab_sim.tracing.notations import latex, latex_symbol, plain_text
from ab_sim.tracing.printed import with_local_names

GRAPH = Graph()
a, b, c, x = (GRAPH.input(name) for name in "abcx")
m, theta = (GRAPH.input(name, per_ball=True) for name in ("m", "theta"))

CASES: list[tuple[Expression, str, str]] = [
    (a - b + c, "a - b + c", "a - b + c"),
    (a - (b - c), "a - (b - c)", r"a - \left(b - c\right)"),
    (a - (b + c), "a - (b + c)", r"a - \left(b + c\right)"),
    (-(a + b), "-(a + b)", r"-\left(a + b\right)"),
    (-a * b - c * x, "-a b - c x", r"-a \, b - c \, x"),
    (a + b * -2.0, "a - 2 b", r"a - 2 \, b"),
    (a * -3.0, "-3 a", r"-3 \, a"),
    (a - 1.0 - b, "a - 1 - b", "a - 1 - b"),
    (-1.0 - a, "-1 - a", "-1 - a"),
    (a * (b + c), "a (b + c)", r"a \, \left(b + c\right)"),
    ((a + b) * (a + b) * c, "(a + b)^2 c", r"\left(a + b\right)^{2} \, c"),
    (a * b * a * a, "a^3 b", r"a^{3} \, b"),
    ((a * b) ** 2, "a^2 b^2", r"a^{2} \, b^{2}"),
    (0.5 * a * a, "1/2 a^2", r"\frac{1}{2} \, a^{2}"),
    (a + 0.4, "a + 2/5", r"a + \frac{2}{5}"),
    (0.1 * a, "0.1 a", r"0.1 \, a"),
    (2e-9 * a, "2e-09 a", r"2 \cdot 10^{-9} \, a"),
    (2.0 * a * 3.0, "2 * 3 a", r"2 \cdot 3 \, a"),
    (a / b * c, "c a/b", r"c \, \frac{a}{b}"),
    (a / b * (c / x), "(a/b) c/x", r"\frac{a}{b} \, \frac{c}{x}"),
    (a * (1.0 / b), "a/b", r"\frac{a}{b}"),
    ((a + b) * (1.0 / (b * c)), "(a + b)/(b c)", r"\frac{a + b}{b \, c}"),
    (a / (b / c), "a/(b/c)", r"\frac{a}{\frac{b}{c}}"),
    (a / b / c, "(a/b)/c", r"\frac{\frac{a}{b}}{c}"),
    ((a / b) ** 2, "(a/b)^2", r"\left(\frac{a}{b}\right)^{2}"),
    (-a / b, "-a/b", r"\frac{-a}{b}"),
    (c + -a / (b + c), "c - a/(b + c)", r"c + \frac{-a}{b + c}"),
    (cos(x) * a, "a cos(x)", r"a \, \cos x"),
    (cos(x) ** 2 - sin(2.0 * x), "cos(x)^2 - sin(2 x)", r"\cos^{2} x - \sin\left(2 \, x\right)"),
    (abs(a - b) * sqrt(c), "|a - b| sqrt(c)", r"\left|a - b\right| \, \sqrt{c}"),
    (
        a + where(x <= 0.0, b, -c),
        "a + (b if x <= 0, else -c)",
        r"a + \begin{cases} b & x \le 0 \\ -c & \text{else} \end{cases}",
    ),
    (total(m * cos(theta)), "sum_i m_i cos(theta_i)", r"\sum_i m_{i} \, \cos theta_{i}"),
    (a - total(-(m * a)), "a + sum_i m_i a", r"a + \sum_i m_{i} \, a"),
    (total(m + a) * b, "b sum_i (m_i + a)", r"b \, \sum_i \left(m_{i} + a\right)"),
    (rows(m * a) * m, "m_i sum_j B_ij m_j a", r"m_{i} \, \sum_j B_{ij} \, m_{j} \, a"),
    (fma(a, b, -c), "a b - c", r"a \, b - c"),
    (across(a), "across(a)", r"\mathrm{across} a"),
]


@pytest.mark.parametrize(("x", "text", "tex"), CASES, ids=[case[1] for case in CASES])
def test_expressions_in_print(x: Expression, text: str, tex: str) -> None:
    assert plain_text(x) == text
    assert latex(x) == tex


def test_a_node_that_is_named_is_printed_by_its_name() -> None:
    load = m * cos(theta)
    named = {load.number: "load"}
    assert plain_text(total(load * a) - load, named=named) == "sum_i load_i a - load_i"
    assert plain_text(load, named=named) == "m_i cos(theta_i)"
    assert latex(load * load, named=named) == "load_{i}^{2}"


@pytest.mark.parametrize(
    ("symbol", "tex"),
    [
        ("k_3", "k_{3}"),
        ("M0", "M_{0}"),
        ("theta'", r"\dot{\theta}"),
        ("s''", r"\ddot{s}"),
        ("beta_b", r"\beta_{b}"),
        ("T_max", r"T_{\mathrm{max}}"),
        ("rest_speed", r"\mathrm{rest\_speed}"),
        ("offset_1", r"\mathrm{offset}_{1}"),
        ("|u|", r"\left|u\right|"),
        ("w_c", r"\omega_{c}"),
        ("clip(T_a)", r"\mathrm{clip}\left(T_{a}\right)"),
    ],
)
def test_symbols_as_latex(symbol: str, tex: str) -> None:
    assert latex_symbol(symbol, {"w": r"\omega"}) == tex


def test_indices_join() -> None:
    v_n = GRAPH.input("v_{n}", per_ball=True)
    assert latex(v_n) == "v_{n,i}"
    assert plain_text(v_n, lambda _: "v_n") == "v_n,i"
    assert plain_text(theta, lambda _: "theta''") == "theta_i''"


def test_local_variables_name_what_they_stand_for() -> None:
    def inner(x: Expression) -> Expression:
        square = x * x
        return square + 1.0

    def formula(x: Expression, k: float) -> Expression:
        grown = inner(x)
        grown = grown * k
        return grown * x

    result, named = with_local_names(formula, x, 2.0)
    assert [(one.name, plain_text(one.node)) for one in named] == [
        ("square", "x^2"),
        ("grown", "2 (x^2 + 1)"),
    ]
    assert plain_text(result, named={one.node.number: one.name for one in named}) == "grown x"
