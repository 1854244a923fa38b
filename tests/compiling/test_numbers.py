"""Arithmetic and comparisons say what Python's say, digit by digit."""

import math
from types import SimpleNamespace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ab_sim.engine.compiling import compiled, fma
from tests.compiling.ways import same

floats = st.floats() | st.sampled_from([0.0, -0.0, 1.0, -1.5, 0.1, 5e-324, 1e308])
ordinary = st.floats(-1e15, 1e15) | st.sampled_from([0.0, -0.0, 0.5, -3.0])
ints = st.integers(-(2**31), 2**31) | st.integers(-4, 4)
THREE, HALF, YES, LOWEST = 3, 0.5, True, -(2**63)
namespace = SimpleNamespace(inner=SimpleNamespace(seven=7))


def of_floats(x: float, y: float) -> tuple[float, float, float, float, float]:
    return x + y, x - y, x * y, -x, abs(x)


def divided(x: float, y: float) -> float:
    return x / y


def of_ints(i: int, j: int) -> tuple[int, int, int, int, int]:
    return i + j, i - j, i * j, -i, abs(i)


def divided_ints(i: int, j: int) -> tuple[int, int, float]:
    return i // j, i % j, i / j


def mixed(x: float, i: int, b: bool) -> tuple[float, float, float, int, int, float]:
    return x + i, i * x, x - b, i + b, b - b, i / THREE


def in_place(x: float, i: int) -> tuple[float, int]:
    x += i
    x *= 2
    x -= HALF
    x /= 3
    i //= 3
    i %= 5
    i -= 1
    return x, i


def constants(x: float) -> tuple[float, float, float, int, int]:
    seven = namespace.inner.seven
    return x + THREE, x * HALF, (math.pi if YES else math.inf), seven + THREE * 2, LOWEST


def compared(x: float, y: float) -> tuple[bool, bool, bool, bool, bool, bool]:
    return x < y, x <= y, x > y, x >= y, x == y, x != y


def compared_ints(i: int, x: float) -> tuple[bool, bool, bool, bool]:
    return i < x, i == x, i != 3, (i > 2) == (x > 2.0)


def in_a_row(x: float, y: float, z: float) -> tuple[bool, bool, bool]:
    return x < y < z, 0.0 <= x <= y != z, not x < y > z


def smallest_and_largest(x: float, y: float, z: float) -> tuple[float, float, float, float]:
    return min(x, y), max(x, y), min(x, y, z), max(x, y, z)


def smallest_ints(i: int, j: int, x: float) -> tuple[int, int, float]:
    return min(i, j), max(i, j, 3), max(0, x, i)


def whole(x: float, i: int) -> tuple[int, int, float]:
    return int(x), int(i), float(i)


def asked(x: float, i: int) -> tuple[bool, bool, bool, int]:
    return math.isnan(x), not x, not i, int(x > 0.0)


def root(x: float) -> float:
    return math.sqrt(abs(x))


def multiplied_and_added(x: float, y: float, z: float) -> tuple[float, float]:
    return fma(x, y, z), x * y + z


@given(floats, floats, floats)
@settings(max_examples=300)
def test_floats(x: float, y: float, z: float) -> None:
    same(of_floats, x, y)
    same(compared, x, y)
    same(in_a_row, x, y, z)
    same(smallest_and_largest, x, y, z)
    same(root, x)
    same(multiplied_and_added, x, y, z)
    same(asked, x, 0)
    if y != 0.0:
        same(divided, x, y)


@given(ints, ints, ordinary)
@settings(max_examples=300)
def test_ints_and_both(i: int, j: int, x: float) -> None:
    same(of_ints, i, j)
    if j != 0:
        same(divided_ints, i, j)
    same(mixed, x, i, i > 0)
    same(in_place, x, i)
    same(compared_ints, i, x)
    same(smallest_ints, i, j, x)
    same(whole, x, i)
    same(asked, x, i)
    same(constants, x)


def test_python_s_first_argument_wins_against_a_nan() -> None:
    assert math.isnan(same(smallest_and_largest, math.nan, 1.0, 2.0)[0])
    assert same(smallest_and_largest, 1.0, math.nan, 2.0) == (1.0, 1.0, 1.0, 2.0)
    assert same(compared, math.nan, math.nan) == (False,) * 5 + (True,)
    assert same(asked, math.nan, 0) == (True, False, True, 0)


def test_where_python_raises_machine_code_goes_on() -> None:
    assert compiled(divided)(1.0, 0.0) == math.inf
    assert math.isnan(compiled(divided)(0.0, 0.0))
    assert compiled(whole)(1e300, 0)[0] == 2**63 - 1
    assert compiled(whole)(-math.inf, 0)[0] == -(2**63)
    assert compiled(whole)(math.nan, 0)[0] == 0
    assert compiled(of_ints)(2**62, 2**62)[0] == -(2**63), "64 bits wrap"


@pytest.mark.parametrize("x", [1e300, -2.5e-310, 123456.789, 0.1])
def test_a_product_is_not_fused_with_a_sum_unless_it_says_so(x: float) -> None:
    found = same(multiplied_and_added, x, 1.0 / 3.0, -x * (1.0 / 3.0))
    assert found[1] == 0.0
