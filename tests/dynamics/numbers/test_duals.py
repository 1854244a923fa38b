"""Dual numbers: values to the float's bit, derivatives by the textbook and by central differences.

All formulas are in one kernel for each combination of kinds, which compiles in the time of one.
"""

import itertools
import math
from collections.abc import Callable
from typing import Any

import numba
import numpy as np
import pytest
from numba.core.errors import TypingError
from numba.extending import register_jitable

from ab_sim.dynamics.dispatch import APART, INLINED, forward
from ab_sim.equations.effects import HardeningSuspension, RaceRunout, UnequalSuspension
from ab_sim.equations.motion import Deck
from ab_sim.dynamics.numbers.cos_sin import cos_sin
from ab_sim.dynamics.numbers.duals import PARTIALS, as_duals, dual, partial_of, value_of
from ab_sim.dynamics.numbers.multiply_add import multiply_add
from ab_sim.dynamics.numbers.tables import leaves, spread
from ab_sim.spindle import RaisedCosine

COMPILED: dict[str, Any] = {"error_model": "numpy", "_nrt": False}
ULP = 2.0**-53

OPERATORS = [
    ("x + y", "1", "1"),
    ("x - y", "1", "-1"),
    ("x * y", "y", "x"),
    ("x / y", "1 / y", "-x / y**2"),
    ("max(x, y)", "x >= y", "x < y"),
    ("min(x, y)", "x <= y", "x > y"),
    ("multiply_add(x, y, x)", "y + 1", "x"),
    ("multiply_add(x, y, y)", "y", "x + 1"),
    ("multiply_add(y, 3, x)", "1", "3"),
    ("math.atan2(x, y)", "y / (x**2 + y**2)", "-x / (x**2 + y**2)"),
    ("np.arctan2(x, y)", "y / (x**2 + y**2)", "-x / (x**2 + y**2)"),
    ("math.hypot(x, y)", "x / math.hypot(x, y)", "y / math.hypot(x, y)"),
    ("np.hypot(x, y)", "x / math.hypot(x, y)", "y / math.hypot(x, y)"),
]
"""What takes two numbers, either of which may be a float: formula, its two partial derivatives."""

FUNCTIONS = [
    ("2 * x", "2", "0"),
    ("x - 1", "1", "0"),
    ("1 / x", "-1 / x**2", "0"),
    ("-x", "-1", "0"),
    ("abs(x)", "math.copysign(1, x)", "0"),
    ("x**0", "0", "0"),
    ("x**2", "2 * x", "0"),
    ("x**5", "5 * x**4", "0"),
    ("x**-3", "-3 * x**-4", "0"),
    ("abs(x) ** 1.5", "1.5 * abs(x) ** 0.5 * math.copysign(1, x)", "0"),
    ("cos_sin(3 * x)[0]", "-3 * math.sin(3 * x)", "0"),
    ("cos_sin(x)[1]", "math.cos(x)", "0"),
    ("math.cos(x)", "-math.sin(x)", "0"),
    ("np.cos(x)", "-math.sin(x)", "0"),
    ("math.sin(x)", "math.cos(x)", "0"),
    ("np.sin(x)", "math.cos(x)", "0"),
    ("math.tan(x)", "1 / math.cos(x) ** 2", "0"),
    ("np.tan(x)", "1 / math.cos(x) ** 2", "0"),
    ("math.asin(x)", "1 / math.sqrt(1 - x**2)", "0"),
    ("np.arcsin(x)", "1 / math.sqrt(1 - x**2)", "0"),
    ("math.acos(x)", "-1 / math.sqrt(1 - x**2)", "0"),
    ("np.arccos(x)", "-1 / math.sqrt(1 - x**2)", "0"),
    ("math.atan(x)", "1 / (1 + x**2)", "0"),
    ("np.arctan(x)", "1 / (1 + x**2)", "0"),
    ("math.tanh(x)", "1 / math.cosh(x) ** 2", "0"),
    ("np.tanh(x)", "1 / math.cosh(x) ** 2", "0"),
    ("math.exp(x)", "math.exp(x)", "0"),
    ("np.exp(x)", "math.exp(x)", "0"),
    ("math.log(x * x)", "2 / x", "0"),
    ("np.log(x * x)", "2 / x", "0"),
    ("math.sqrt(x * x + y)", "x / math.sqrt(x**2 + y)", "0.5 / math.sqrt(x**2 + y)"),
    ("np.sqrt(y)", "0", "0.5 / math.sqrt(y)"),
    ("math.pi * x / np.pi", "1", "0"),
    # A product of its own, which a compiler that may would fuse with what it is added to.
    ("(x + 2) * (y - 3) + 0.3", "y - 3", "x + 2"),
    ("first_of_sum(x, y)", "2", "1"),
    ("newton(y)", "0", "0.5 / math.sqrt(y)"),
    ("7.0", "0", "0"),
]


@register_jitable(**INLINED)
def first_of_sum(x: Any, y: Any) -> Any:
    """2 x + y, by in-place operators and a variable that begins as a float."""
    total = 0.0
    for _ in range(2):
        total += x
    total *= 2
    total /= 2.0
    total -= y
    total += 2.0 * y
    return total


@register_jitable(**INLINED)
def newton(x: Any) -> Any:
    """The square root, by a loop that looks at its numbers."""
    root = 1.0
    while abs(root * root - x) > 1e-15:
        before = root
        root = 0.5 * (root + x / root)
        if root == before:
            break
    return 0.5 * (root + x / root)


FORMULAS = OPERATORS + FUNCTIONS
NAMES = {
    "math": math,
    "np": np,
    "cos_sin": cos_sin,
    "multiply_add": multiply_add,
    "first_of_sum": first_of_sum,
    "newton": newton,
}


def kernel_of(formulas: list[tuple[str, str, str]], duals: str) -> Callable[..., None]:
    """``kernel(x, y, out)``: each formula's result, of floats into shape (formulas,).

    Args:
        formulas: as above.
        duals: which of x and y are dual numbers, in directions 0 and 1; with any, the shape is
            (formulas, 1 + PARTIALS).
    """
    lines = ["def kernel(x, y, out):"]
    lines += ["    out = as_duals(out)"] if duals else []
    lines += [f"    {name} = dual({name}, {'xy'.index(name)})" for name in duals]
    lines += [f"    out[{i}] = {formula}" for i, (formula, _, _) in enumerate(formulas)]
    names = {**NAMES, "as_duals": as_duals, "dual": dual}
    exec("\n".join(lines), names)
    return numba.njit(**COMPILED)(names["kernel"])


@pytest.fixture(scope="module")
def of_floats() -> Callable[..., None]:
    return kernel_of(FORMULAS, "")


@pytest.fixture(scope="module")
def of_duals() -> Callable[..., None]:
    return kernel_of(FORMULAS, "xy")


def numbers() -> np.ndarray:
    """Pairs of x and y, all formulas being smooth there: shape (pairs, 2)."""
    random = np.random.default_rng(1)
    pairs = random.uniform(0.1, 0.9, (200, 2))
    pairs[:, 0] *= random.choice([-1.0, 1.0], 200)
    return pairs


def values(
    kernel: Callable[..., None], x: float, y: float, count: int = len(FORMULAS)
) -> np.ndarray:
    out = np.zeros(count)
    kernel(x, y, out)
    return out


def results(
    kernel: Callable[..., None], x: float, y: float, count: int = len(FORMULAS)
) -> np.ndarray:
    out = np.full((count, 1 + PARTIALS), np.nan)
    kernel(x, y, out)
    return out


def test_values_are_those_of_floats_to_the_bit(of_floats: Any, of_duals: Any) -> None:
    for x, y in numbers():
        found = results(of_duals, x, y)[:, 0]
        expected = values(of_floats, x, y)
        differ = np.flatnonzero(found.view(np.int64) != expected.view(np.int64))
        assert not differ.size, [FORMULAS[i][0] for i in differ]


def test_values_are_those_of_floats_where_these_are_odd() -> None:
    """Zeros with their signs, overflow and underflow, what is infinite or no number."""
    # Newton would go on for ever, and numba raises for whole powers as for nothing else.
    formulas = [row for row in FORMULAS if row[0] not in ("newton(y)", "x**-3")]
    of_floats, of_duals = kernel_of(formulas, ""), kernel_of(formulas, "xy")
    odd = (0.0, -0.0, 1.0, 1e308, -5e-324, math.inf, -math.inf, math.nan)
    for x, y in itertools.product(odd, odd):
        found = results(of_duals, x, y, len(formulas))[:, 0]
        expected = values(of_floats, x, y, len(formulas))
        np.testing.assert_array_equal(found, expected)
        signs = np.signbit(found) == np.signbit(expected)
        assert signs[~np.isnan(expected)].all(), (x, y)


def test_derivatives_are_the_textbook_s(of_duals: Any) -> None:
    for x, y in numbers():
        found = results(of_duals, x, y)
        at = {**NAMES, "x": x, "y": y}
        expected = [[float(eval(slope, at)) for slope in slopes] for _, *slopes in FORMULAS]
        np.testing.assert_allclose(found[:, 1:3], expected, rtol=16 * ULP, atol=4 * ULP)
        assert not found[:, 3:].any(), "nothing depends on what is not there"


def test_derivatives_are_those_of_central_differences(of_floats: Any, of_duals: Any) -> None:
    h = 1e-3
    for x, y in numbers()[:50]:
        if abs(x - y) < 4 * h or min(abs(x), y) < 0.2:
            continue  # too near to the kink of max and min, or to where 1/x^3 bends too much
        found = results(of_duals, x, y)[:, 1:3]
        for k, (dx, dy) in enumerate(((h, 0.0), (0.0, h))):
            once, twice = (
                values(of_floats, x + c * dx, y + c * dy)
                - values(of_floats, x - c * dx, y - c * dy)
                for c in (1, 2)
            )
            # Error h^4 f^(5) / 30; x^-3 has the largest fifth derivative, 2520 x^-8.
            bound = h**4 / 30 * 2520 * (min(abs(x), y) - 2 * h) ** -8
            expected = (8 * once - twice) / (12 * h)
            np.testing.assert_allclose(found[:, k], expected, rtol=1e-9, atol=bound)


@pytest.mark.parametrize("which", ["x", "y"])
def test_a_float_among_duals_is_a_constant(which: str, of_duals: Any) -> None:
    kernel = kernel_of(OPERATORS, which)
    own, other = (1, 2) if which == "x" else (2, 1)
    for x, y in numbers():
        expected = results(of_duals, x, y)[: len(OPERATORS)]
        found = results(kernel, x, y, len(OPERATORS))
        np.testing.assert_array_equal(found[:, 0], expected[:, 0])
        np.testing.assert_allclose(found[:, own], expected[:, own], rtol=4 * ULP, atol=4 * ULP)
        assert not found[:, other].any()


def test_fused_values_are_rounded_once(of_duals: Any) -> None:
    """x y - x y rounded, which is what a product's rounding takes away."""

    @numba.njit(**COMPILED)
    def rest(x, y):  # type: ignore[no-untyped-def]
        a, b = dual(x, 0), dual(y, 1)
        product = a * b
        return value_of(multiply_add(a, b, -product)), value_of(a * b - product)

    x, y = 1.0 + 2.0**-30, 1.0 - 2.0**-30
    assert rest(x, y) == (-(2.0**-60), 0.0)


def test_cosine_and_sine_are_each_other_s_derivatives() -> None:
    """At any angle: through the constant that rounds the quarters a derivative would be lost."""

    @numba.njit(**COMPILED)
    def turn(x):  # type: ignore[no-untyped-def]
        c, s = cos_sin(dual(x, 6))
        return value_of(c), value_of(s), partial_of(c, 6), partial_of(s, 6)

    @numba.njit(**COMPILED)
    def of_float(x):  # type: ignore[no-untyped-def]
        return cos_sin(x)

    for x in np.random.default_rng(2).uniform(-1e4, 1e4, 1000):
        c, s = of_float(x)
        assert turn(x) == (c, s, -s, c)


@numba.njit(**COMPILED)
def compare(x, y, out):  # type: ignore[no-untyped-def]
    """All comparisons of two duals, of a dual and a float, of a dual and a whole number."""
    a, b = dual(x, 0), dual(y, 0)
    for i, outcome in enumerate(
        (
            (a < b, a <= b, a > b, a >= b, a == b, a != b),
            (a < y, a <= y, a > y, a >= y, a == y, a != y),
            (x < b, x <= b, x > b, x >= b, x == b, x != b),
            (a < 1, a <= 1, a > 1, a >= 1, a == 1, a != 1),
        )
    ):
        for k in range(6):
            out[i, k] = outcome[k]


def test_comparisons_go_by_the_value() -> None:
    def expected(x: float, y: float) -> list[bool]:
        return [x < y, x <= y, x > y, x >= y, x == y, x != y]

    for x in (-1.0, 0.0, 1.0, math.inf, math.nan):
        for y in (-0.0, 1.0, math.nan):
            out = np.zeros((4, 6), np.bool_)
            compare(x, y, out)
            assert out.tolist() == [expected(x, y)] * 3 + [expected(x, 1)]


def test_whole_numbers_are_of_the_value() -> None:
    @numba.njit(**COMPILED)
    def whole(x):  # type: ignore[no-untyped-def]
        return int(dual(x, 0))

    assert [whole(x) for x in (-1.0, 0.0, 2.9, -2.9)] == [-1, 0, 2, -2]


def test_of_a_plain_number_the_value_is_itself_and_derivatives_vanish() -> None:
    @numba.njit(**COMPILED)
    def parts(x, k):  # type: ignore[no-untyped-def]
        return value_of(x), partial_of(x, k), value_of(3), partial_of(dual(x, k), k)

    assert all(parts(0.5, k) == (0.5, 0.0, 3.0, 1.0) for k in range(PARTIALS))


def test_arrays_of_duals_take_floats_duals_and_slices() -> None:
    @numba.njit(**COMPILED)
    def write(table):  # type: ignore[no-untyped-def]
        rows = as_duals(table)
        rows[:] = 0.5
        rows[0, 0] = 7
        rows[0, 1] = rows[1, 1] * dual(3.0, 2)
        rows[0, 1] += 1
        last = rows[2]
        last[:] = rows[0, 1]
        last[0] -= rows[0, 0]
        rows[1:2, 0] = -2.0
        return rows.shape, rows.size

    # Anywhere in memory: a vector at an odd place is no fault.
    table = np.zeros(1 + 3 * 2 * 8)[1:].reshape(3, 2, 8)
    assert write(table) == ((3, 2), 6)
    expected = np.zeros((3, 2, 8))
    expected[:, :, 0] = [[7.0, 2.5], [-2.0, 0.5], [-4.5, 2.5]]
    expected[0, 1, 3] = expected[2, :, 3] = 0.5
    np.testing.assert_array_equal(table, expected)


@numba.njit(**APART)
def drifted(deck, time):  # type: ignore[no-untyped-def]
    """A deck later on, by a call that is not inlined."""
    return Deck(deck.x + time * deck.vx, deck.y + time * deck.vy, 2.0, deck.vx if time > 0 else 0.0)


def test_named_tuples_of_duals_pass_through_functions() -> None:
    @numba.njit(**COMPILED)
    def run(out):  # type: ignore[no-untyped-def]
        deck = drifted(Deck(dual(1.0, 0), 2.0, dual(3.0, 2), dual(4.0, 3)), dual(0.5, 4))
        rows = as_duals(out)
        rows[0], rows[1], rows[2], rows[3] = deck

    out = np.full((4, 8), np.nan)
    run(out)
    expected = np.zeros((4, 8))
    expected[:, 0] = [1.0 + 0.5 * 3.0, 2.0 + 0.5 * 4.0, 2.0, 3.0]
    expected[0, [1, 3, 5]] = [1.0, 0.5, 3.0]  # x + t vx
    expected[1, [4, 5]] = [0.5, 4.0]  # y + t vy
    expected[3, 3] = 1.0  # vx
    np.testing.assert_array_equal(out, expected)


METHODS = [
    ("race_shape", RaceRunout(2e-4, -1e-4, 3e-4, 0.4), (0.6, 0.8)),
    ("deck_force", HardeningSuspension(1e8), (Deck(3e-4, -2e-4, 0.05, 0.04),)),
    ("space_force", UnequalSuspension(9.0, 4.0, 0.1, 0.2, 0.3), (Deck(0.3, -0.2, 0.5, 0.4),)),
    ("speed", RaisedCosine(10.0, 90.0, 0.8), (0.3,)),
    ("angle", RaisedCosine(10.0, 90.0, 0.8), (0.3,)),
]


@pytest.mark.parametrize(("method", "thing", "arguments"), METHODS)
def test_methods_of_the_package_have_the_derivatives_of_central_differences(
    method: str, thing: Any, arguments: tuple[Any, ...]
) -> None:
    """With respect to all their numbers, those of the thing itself as well."""
    call = forward(method)
    at = np.array(leaves((thing, arguments)))
    expected = np.reshape(getattr(thing, method)(*arguments), -1)
    count = expected.size
    several = register_jitable((lambda result: result) if count > 1 else (lambda result: (result,)))

    @numba.njit(**COMPILED)
    def of_floats(thing, arguments, out):  # type: ignore[no-untyped-def]
        result = several(call(thing, *arguments))
        for i in range(count):
            out[i] = result[i]

    @numba.njit(**COMPILED)
    def of_duals(thing, arguments, table, out):  # type: ignore[no-untyped-def]
        this, given = spread((thing, arguments), as_duals(table))
        of_floats(this, given, as_duals(out))

    def value(numbers: np.ndarray) -> np.ndarray:
        out = np.zeros(count)
        rest = iter(numbers.tolist())
        this, given = type(thing)(*(next(rest) for _ in thing)), []
        for argument in arguments:
            whole = isinstance(argument, tuple)
            given.append(Deck(*(next(rest) for _ in argument)) if whole else next(rest))
        of_floats(this, tuple(given), out)
        return out

    for first in range(0, at.size, PARTIALS):
        seeds, out = np.zeros((at.size, 1 + PARTIALS)), np.zeros((count, 1 + PARTIALS))
        seeds[:, 0] = at
        for k in range(first, min(at.size, first + PARTIALS)):
            seeds[k, 1 + k - first] = 1.0
        of_duals(thing, arguments, seeds, out)
        np.testing.assert_array_equal(out[:, 0], value(at))
        for k in range(first, min(at.size, first + PARTIALS)):
            step = np.zeros(at.size)
            step[k] = 1e-3 * at[k]
            once, twice = (value(at + c * step) - value(at - c * step) for c in (1, 2))
            difference = (8 * once - twice) / (12 * step[k])
            scale = np.abs(value(at)).max() / abs(at[k])
            np.testing.assert_allclose(out[:, 1 + k - first], difference, atol=1e-11 * scale)


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        (lambda x, table: float(x), "float"),
        (lambda x, table: x**x, "pow"),
        (lambda x, table: dual(x, 0), "value_of"),
        (lambda x, table: math.floor(x), "floor"),
        (lambda x, table: as_duals(table.T), "contiguous"),
        (lambda x, table: as_duals(table.astype(np.float32)), "float64"),
    ],
)
def test_what_would_lose_derivatives_does_not_compile(body: Any, reason: str) -> None:
    body = register_jitable(body)

    @numba.njit(error_model="numpy")
    def kernel(table):  # type: ignore[no-untyped-def]
        body(dual(1.0, 0), table)

    with pytest.raises(TypingError, match=reason):
        kernel(np.zeros((2, 8)))
