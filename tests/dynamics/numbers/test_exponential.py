"""The exponential in lanes."""

import math

import numba
import numpy as np

from ab_sim.dynamics.numbers.lanes import LANES, as_lanes
from ab_sim.integrate.workspace import aligned


@numba.njit(error_model="numpy", _nrt=False)
def exponentials(x, out):  # type: ignore[no-untyped-def]
    numbers, found = as_lanes(x), as_lanes(out)
    for i in range(numbers.shape[0]):
        found[i] = math.exp(numbers[i])


def test_it_is_right_to_two_roundings() -> None:
    x, found = aligned((5000, LANES)), aligned((5000, LANES))
    x[:] = np.random.default_rng(1).uniform(-700.0, 700.0, x.shape)
    x[1000:] *= 10.0 ** -np.random.default_rng(2).uniform(0.0, 20.0, (4000, LANES))
    exponentials(x, found)
    true = np.exp(x.astype(np.longdouble))
    assert float(np.abs(found / true - 1.0).max()) < 2.5e-16


def test_beyond_its_range_it_stays_at_the_end_and_no_number_stays_none() -> None:
    x, found = aligned((1, LANES)), aligned((1, LANES))
    x[0] = [0.0, -0.0, 700.0, 1e9, math.inf, -1e9, -math.inf, math.nan]
    exponentials(x, found)
    most = math.exp(700.0)
    expected = [1.0, 1.0, most, most, most, 1.0 / most, 1.0 / most, math.nan]
    np.testing.assert_allclose(found[0], expected, rtol=1e-15)
