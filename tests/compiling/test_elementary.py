"""Elementary functions against mpmath, and against the tracer's."""

import math
from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ab_sim.compiling import Floats
from ab_sim.compiling.elementary import exp, expm1, power_of_two
from ab_sim.tracing import Graph, cos, lowered, sin
from ab_sim.tracing.cosine import cos_sin
from ab_sim.tracing.plain import python_function
from tests.compiling.ways import agree, machine_code, same


def each_exp(x: Floats, out: Floats) -> None:
    for i in range(x.size):
        out[i] = exp(x[i])


def each_expm1(x: Floats, out: Floats) -> None:
    for i in range(x.size):
        out[i] = expm1(x[i])


def ulps(found: float, exact: Any) -> float:
    spacing = math.ulp(float(exact))
    return float(abs(mpmath.mpf(found) - exact) / spacing)


RANGES = [(-1e-3, 1e-3), (-0.5, 0.5), (-2.0, 2.0), (0.3, 0.6), (-40.0, 60.0), (-708.0, 709.0)]


@pytest.mark.parametrize("low, high", RANGES)
@pytest.mark.parametrize(
    "each, right, most", [(each_exp, mpmath.exp, 0.65), (each_expm1, mpmath.expm1, 0.75)]
)
def test_exponentials(
    each: Callable[..., None], right: Callable[..., Any], most: float, low: float, high: float
) -> None:
    x = np.random.default_rng(3).uniform(low, high, 3000)
    found = np.empty_like(x)
    machine_code(each)(x, found)
    with mpmath.workprec(150):
        worst = max(ulps(y, right(mpmath.mpf(at))) for at, y in zip(x.tolist(), found.tolist()))  # noqa: B905
    assert worst <= most


def test_exponentials_that_are_hardly_numbers() -> None:
    x = np.random.default_rng(3).uniform(-745.0, -708.0, 500)
    found = np.empty_like(x)
    machine_code(each_exp)(x, found)
    with mpmath.workprec(150):
        for at, y in zip(x.tolist(), found.tolist(), strict=True):
            assert ulps(y, mpmath.exp(mpmath.mpf(at))) <= 0.8


ENDS = [0.0, -0.0, math.inf, -math.inf, math.nan, 709.782712893384, 709.7827128933841]
ENDS += [-745.13, -745.14, -1e308, 1e308, 5e-324, -1e-310, 0.5, -0.5, 37.1, -37.1, -40.1]


@given(st.floats() | st.floats(-800.0, 800.0) | st.sampled_from(ENDS))
@settings(max_examples=300)
def test_all_ways_have_the_same_bits(x: float) -> None:
    if math.isfinite(x):
        same(cos_sin, x)
    for function, right in ((exp, math.exp), (expm1, math.expm1)):
        found = same(function, x)
        try:
            expected = right(x)
        except OverflowError:
            expected = math.inf
        if math.isfinite(expected):
            assert abs(found - expected) <= 2.0 * math.ulp(expected)
        else:
            assert agree(found, expected)


def test_powers_of_two() -> None:
    for n in range(-1022, 1024):
        assert power_of_two(n) == 2.0**n


@given(st.floats(-10.0, 10.0) | st.floats(-1e9, 1e9))
@settings(max_examples=300)
def test_cosine_and_sine_are_those_of_emitted_formulas(x: float) -> None:
    graph = Graph()
    angle = graph.input("a")
    emitted = python_function(lowered([cos(angle), sin(angle)]), {"a": "a"})
    found = cos_sin(x)
    assert agree(found, tuple(emitted(a=x)))
    assert abs(found[0] - math.cos(x)) < 3e-16 and abs(found[1] - math.sin(x)) < 3e-16
