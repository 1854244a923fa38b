"""All ways out of the same expressions agree to the bit; cosines are right to within ulps."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ab_sim.tracing import Expression, Graph, cos, lowered, sin, sqrt, total, where
from ab_sim.tracing.functions import multiply_add
from ab_sim.tracing.llvm_text import Shape
from tests.tracing.ways_out import EACH, NAMES, Inputs, by_c, by_machine, by_plain

RUNS = 8
NARROW = "+sse4.2,+avx,+avx2,+fma,-avx512f"
"""A processor without AVX-512."""


def inputs(balls: int, seed: int) -> Inputs:
    random = np.random.default_rng(seed)
    made = {name: random.normal(0.0, 3.0, RUNS) for name in NAMES}
    made |= {name: random.normal(0.0, 3.0, (RUNS, balls)) for name in EACH}
    # What arithmetic can trip over.
    made["a"][:3] = 0.0, -0.0, 1e-310
    return made


MADE: list[Callable[..., Expression]] = [
    lambda x, y, z: x + y,
    lambda x, y, z: x - y * z,
    lambda x, y, z: x * y + z,
    lambda x, y, z: x * y - z * x,
    lambda x, y, z: x / (1.0 + y * y),
    lambda x, y, z: -x,
    lambda x, y, z: abs(x),
    lambda x, y, z: sqrt(abs(x)),
    lambda x, y, z: where(x < y, y, z),
    lambda x, y, z: where(x >= 0.5, -y, x),
    lambda x, y, z: cos(x),
    lambda x, y, z: sin(x),
    lambda x, y, z: total(x),
    lambda x, y, z: x**3,
]


@st.composite
def formulas(draw: Any) -> list[Expression]:
    """Some expressions that use all operations, on top of each other."""
    graph = Graph()
    known = [graph.input(name) for name in NAMES]
    known += [graph.input(name, per_ball=True) for name in EACH]
    known += [graph.constant(draw(st.floats(-5.0, 5.0))) for _ in range(2)]
    one = st.deferred(lambda: st.sampled_from(known))
    for _ in range(draw(st.integers(3, 25))):
        made = draw(st.sampled_from(MADE))
        known.append(made(draw(one), draw(one), draw(one)))
    return known[-6:]


@pytest.mark.parametrize("balls", [1, 3, 8, 9, 16, 21])
@settings(max_examples=8, suppress_health_check=list(HealthCheck))
@given(roots=formulas(), seed=st.integers(0, 99))
def test_all_ways_out_have_the_same_bits(
    balls: int, roots: list[Expression], seed: int, tmp_path_factory: Any
) -> None:
    low, given = lowered(roots), inputs(balls, seed)
    expected = by_plain(low, balls, given)
    finite = np.isfinite(expected)
    ways = {
        "balls in vectors": by_machine(low, Shape(balls), given),
        "without AVX-512": by_machine(low, Shape(balls), given, NARROW),
        "eight lanes": by_machine(low, Shape(balls, 8), given),
        "two lanes": by_machine(low, Shape(balls, 2), given, NARROW),
    }
    if seed % 4 == 0:
        ways["C"] = by_c(low, balls, given, Path(tmp_path_factory.mktemp("c")))
    for way, found in ways.items():
        same = found.view(np.int64) == expected.view(np.int64)
        assert np.all(same | ~finite), f"{way}: {found[~same & finite]}, {expected[~same & finite]}"
        assert np.array_equal(np.isfinite(found), finite), way


@given(x=st.floats(-1e6, 1e6))
@settings(max_examples=300)
def test_cosine_and_sine_are_right_within_two_ulps_of_one(x: float) -> None:
    graph = Graph()
    angle = graph.input("a")
    low = lowered([cos(angle), sin(angle)])
    given = {"a": np.array([x]), "b": np.zeros(1), "c": np.zeros(1)}
    given |= {name: np.zeros((1, 1)) for name in EACH}
    found = by_plain(low, 1, given)[0]
    with mpmath.workprec(200):
        exact = mpmath.cos(mpmath.mpf(x)), mpmath.sin(mpmath.mpf(x))
        errors = [abs(mpmath.mpf(float(f)) - e) for f, e in zip(found, exact, strict=True)]
    assert max(errors) <= 2 * math.ulp(1.0) / 2


@given(*(st.floats(allow_nan=False, allow_infinity=False, width=64) for _ in range(3)))
@settings(max_examples=300)
def test_python_multiplies_and_adds_with_one_rounding(a: float, b: float, c: float) -> None:
    with mpmath.workprec(5000):
        exact = mpmath.mpf(a) * mpmath.mpf(b) + mpmath.mpf(c)
        least = mpmath.mpf(2) ** -1022
        if abs(exact) < least or abs(exact) > mpmath.mpf(2) ** 1023:
            return
        with mpmath.workprec(53):
            rounded = +exact
    assert multiply_add(a, b, c) == float(rounded)
