"""Cosine and sine by arithmetic, against 80-bit ones."""

import math

import numba
import numpy as np
import pytest

from ab_sim.dynamics.numbers.cos_sin import cos_sin

ULP = 2.0**-53


@pytest.mark.parametrize(("reach", "most"), [(0.8, 1.1), (10.0, 1.1), (1e4, 1.2), (1e6, 1.5)])
def test_within_rounding_of_the_true_values(reach: float, most: float) -> None:
    if np.finfo(np.longdouble).eps > 2e-19:
        pytest.skip("this machine has no longer floats to compare with")
    x = np.random.default_rng(1).uniform(-reach, reach, 100_000)
    c, s = cos_sin(x)
    exact = x.astype(np.longdouble)
    assert np.abs(c - np.cos(exact)).max() <= most * ULP
    assert np.abs(s - np.sin(exact)).max() <= most * ULP


def test_far_out_the_error_is_that_of_the_angle_itself() -> None:
    x = np.random.default_rng(2).uniform(-1e10, 1e10, 10_000)
    c, s = cos_sin(x)
    off = np.hypot(c - np.cos(x), s - np.sin(x))
    assert (off <= np.spacing(np.abs(x))).all()


def test_quarters_nothing_and_what_is_no_number() -> None:
    assert cos_sin(0.0) == (1.0, 0.0)
    for k in range(-9, 10):
        x = k * math.pi / 2
        assert cos_sin(x) == pytest.approx((math.cos(x), math.sin(x)), abs=1e-16)
    for x in (math.nan, math.inf, -math.inf):
        assert all(math.isnan(value) for value in cos_sin(x))


def test_compiled_it_rounds_at_most_once_less() -> None:
    compiled = numba.njit(lambda x: cos_sin(x))
    for x in np.random.default_rng(3).uniform(-7.0, 7.0, 1000):
        np.testing.assert_allclose(compiled(x), cos_sin(x), rtol=0.0, atol=2 * ULP)


def test_compiled_it_is_exact_far_beyond_a_day_of_turning() -> None:
    if np.finfo(np.longdouble).eps > 2e-19:
        pytest.skip("this machine has no longer floats to compare with")
    compiled = numba.njit(lambda x: cos_sin(x))
    x = np.random.default_rng(4).uniform(-1e9, 1e9, 10_000)
    found, exact = np.array([compiled(each) for each in x]), x.astype(np.longdouble)
    assert np.abs(found[:, 0] - np.cos(exact)).max() <= 1.5 * ULP
    assert np.abs(found[:, 1] - np.sin(exact)).max() <= 1.5 * ULP
