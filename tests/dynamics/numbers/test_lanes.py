"""Lanes: eight floats' results at once, and never mixed with duals."""

import math
from typing import Any

import numba
import numpy as np
import pytest
from numba.core.errors import TypingError
from numba.extending import register_jitable

from ab_sim.dynamics.numbers.cos_sin import cos_sin
from ab_sim.dynamics.numbers.duals import dual
from ab_sim.dynamics.numbers.lanes import LANES, as_lanes, where_less
from ab_sim.dynamics.numbers.multiply_add import multiply_add
from ab_sim.integrate.workspace import aligned

COMPILED: dict[str, Any] = {"error_model": "numpy", "_nrt": False}


@register_jitable
def formulas(x: Any, y: Any, out: Any) -> None:
    """All that lanes can do, but for ``where_less``."""
    total = 0.0
    for _ in range(2):
        total += x
    total -= 3
    total *= y
    total /= 2.0
    out[0] = x + y
    out[1] = x - 2
    out[2] = 3 * x
    out[3] = x / y
    out[4] = abs(-x)
    out[5] = total
    out[6] = multiply_add(x, y, 1.0)
    out[7] = cos_sin(x)[0]
    out[8] = math.cos(x) * np.cos(y)
    out[9] = math.sin(x) * np.sin(y)
    out[10] = 7.0


def test_each_lane_has_its_float_s_result() -> None:
    @numba.njit(**COMPILED)
    def side_by_side(pair, out):  # type: ignore[no-untyped-def]
        formulas(as_lanes(pair)[0], as_lanes(pair)[1], as_lanes(out))

    @numba.njit(**COMPILED)
    def one(x, y, out):  # type: ignore[no-untyped-def]
        formulas(x, y, out)

    pair, found, expected = aligned((2, LANES)), aligned((11, LANES)), np.zeros((11, LANES))
    pair[:] = np.random.default_rng(1).uniform(-3.0, 3.0, pair.shape)
    side_by_side(pair, found)
    for lane, (x, y) in enumerate(pair.T):
        column = np.zeros(11)
        one(x, y, column)
        expected[:, lane] = column
    # Their products may be fused with what they are added to: results differ by roundings.
    np.testing.assert_allclose(found, expected, rtol=1e-14, atol=1e-14)


def test_where_less_chooses_in_each_lane() -> None:
    @numba.njit(**COMPILED)
    def choose(x, y, out):  # type: ignore[no-untyped-def]
        as_lanes(out)[0] = where_less(as_lanes(x)[0], as_lanes(y)[0], 1.0, as_lanes(y)[0])

    x, y, out = (aligned((1, LANES)) for _ in range(3))
    x[0] = [0.0, 1.0, 2.0, math.nan, 0.0, -math.inf, 5.0, -0.0]
    y[0] = [1.0, 1.0, 1.0, 1.0, math.nan, 1.0, 6.0, 0.0]
    choose(x, y, out)
    np.testing.assert_array_equal(out, np.where(x < y, 1.0, y))


def either(x: Any, y: Any, table: Any) -> Any:
    if table[0, 0] > 0.0:
        x = y
    return x


def assigned(x: Any, y: Any, table: Any) -> None:
    as_lanes(table)[0] = y


@pytest.mark.parametrize(
    "mixed",
    [
        lambda x, y, table: x + y,
        lambda x, y, table: y * x,
        lambda x, y, table: x < 1.0,
        lambda x, y, table: multiply_add(x, 1.0, y),
        lambda x, y, table: where_less(x, 1.0, y, 0.0),
        either,
        assigned,
    ],
)
def test_lanes_and_duals_do_not_mix_and_lanes_do_not_branch(mixed: Any) -> None:
    mixed = register_jitable(mixed)

    @numba.njit(error_model="numpy")
    def kernel(table):  # type: ignore[no-untyped-def]
        mixed(as_lanes(table)[0], dual(1.0, 0), table)

    with pytest.raises(TypingError):
        kernel(aligned((2, LANES)))
