"""Intervals have what they are intervals of as often as they say; indices are those known."""

import math
import warnings

import numpy as np
import pytest
from scipy import stats

from ab_sim.base.errors import InputError
from ab_sim.design.statistics import (
    SobolIndex,
    corrected_correlation,
    paired_difference,
    paired_shares,
    quantile_of,
    share_of,
    sobol_of,
)

REPEATS = 400
OFTEN = (0.93, 0.97)
"""Within which a coverage of 95 % lies in so many repeats, but for one time in sixteen."""


def is_often(hits: np.ndarray) -> bool:
    return OFTEN[0] <= float(np.mean(hits)) <= OFTEN[1]


def test_the_correlation_of_two_outcomes_is_corrected_for_continuity() -> None:
    """Newcombe (1998), Statist. Med. 17, 2635, method 10: half of all runs is taken off."""
    assert corrected_correlation(8, 2, 1, 9) == pytest.approx((72 - 2 - 20 / 2) / math.sqrt(9900))
    assert corrected_correlation(2, 8, 9, 1) == pytest.approx((2 - 72) / math.sqrt(9900))
    assert corrected_correlation(5, 5, 5, 5) == 0.0 == corrected_correlation(10, 0, 0, 0)


@pytest.mark.parametrize(("share", "runs"), [(0.5, 400), (0.9, 400), (0.03, 1000)])
def test_wilson_covers(share: float, runs: int) -> None:
    rng, hits = np.random.default_rng(1), []
    for _ in range(REPEATS):
        found = share_of(rng.random(runs) < share)
        hits.append(found.low <= share <= found.high)
    assert is_often(np.array(hits))


def test_wilson_is_what_its_formula_gives_also_at_the_ends() -> None:
    z = stats.norm.ppf(0.975)
    for count, runs in ((0, 50), (1, 50), (37, 50), (50, 50)):
        found, p = share_of(np.arange(runs) < count), count / runs
        middle = (p + z * z / (2 * runs)) / (1 + z * z / runs)
        half = z / (1 + z * z / runs) * math.sqrt(p * (1 - p) / runs + z * z / (4 * runs**2))
        assert (found.low, found.high) == pytest.approx((middle - half, middle + half), abs=1e-12)
        assert found.value == p and found.half_width > 0.01


@pytest.mark.parametrize(("count", "runs"), [(0, 50), (50, 50), (45, 50), (9000, 10000)])
def test_it_says_how_many_runs_a_precision_takes(count: int, runs: int) -> None:
    found = share_of(np.arange(runs) < count)
    assert found.runs_for(found.half_width) in (runs, runs + 1)
    for half in (found.half_width / 2, 0.001):
        more = found.runs_for(half)
        again = share_of(np.arange(more) < round(more * count / runs))
        assert again.half_width == pytest.approx(half, rel=0.01)
    for half in (0.0, 0.5, -1.0, math.nan):
        with pytest.raises(InputError, match="half width"):
            found.runs_for(half)


@pytest.mark.parametrize(("p", "runs"), [(0.5, 400), (0.05, 1000), (0.95, 1000)])
def test_quantile_intervals_cover(p: float, runs: int) -> None:
    """Of a skew distribution."""
    rng, hits, true = np.random.default_rng(2), [], stats.lognorm(1.0).ppf(p)
    for _ in range(REPEATS):
        found = quantile_of(rng.lognormal(size=runs), p)
        assert found.low is not None and found.high is not None
        hits.append(found.low <= true <= found.high)
    assert is_often(np.array(hits))


def test_quantiles_of_few_values_have_no_end() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = quantile_of(np.arange(10.0), 0.95)
    assert found.value == pytest.approx(8.55) and found.high is None


@pytest.mark.parametrize(("both", "one", "other"), [(0.6, 0.2, 0.1), (0.9, 0.05, 0.05)])
def test_paired_intervals_of_shares_cover(both: float, one: float, other: float) -> None:
    rng, hits = np.random.default_rng(3), []
    for _ in range(REPEATS):
        drawn = rng.random(400)
        first = drawn < both + one
        second = (drawn < both) | ((drawn >= both + one) & (drawn < both + one + other))
        found = paired_shares(first, second)
        hits.append(found.low <= one - other <= found.high)
    assert is_often(np.array(hits))


def test_paired_shares_are_those_of_the_paper() -> None:
    """Newcombe 1998, table II, method 10: both 36, one 12, other 2, neither 0."""
    first = np.repeat([True, True, False], (36, 12, 2))
    second = np.repeat([True, False, True], (36, 12, 2))
    found = paired_shares(first, second)
    assert (found.both, found.only_first, found.only_second, found.neither) == (36, 12, 2, 0)
    assert found.difference == pytest.approx(0.2)
    assert (found.low, found.high) == pytest.approx((0.0569, 0.3404), abs=5e-5)
    assert found.p_value == pytest.approx(stats.binomtest(2, 14).pvalue)
    back = paired_shares(second, first)
    assert (back.low, back.high) == pytest.approx((-found.high, -found.low))


@pytest.mark.parametrize(("first", "second"), [(True, True), (True, False), (False, False)])
def test_paired_shares_of_all_or_none_are_no_point(first: bool, second: bool) -> None:
    found = paired_shares(np.full(100, first), np.full(100, second))
    assert found.difference == float(first) - float(second)
    assert -1.0 <= found.low < found.high <= 1.0 and found.high - found.low > 0.01
    assert found.p_value == pytest.approx(1.0 if first == second else 0.5**99)


def test_paired_intervals_of_metrics_cover() -> None:
    rng, means, medians = np.random.default_rng(4), [], []
    for _ in range(REPEATS):
        common = rng.normal(size=300)
        found = paired_difference(common + rng.exponential(size=300), common)
        assert found is not None and found.median.low is not None
        assert found.median.high is not None
        means.append(found.low <= 1.0 <= found.high)
        medians.append(found.median.low <= math.log(2.0) <= found.median.high)
    assert is_often(np.array(means)) and is_often(np.array(medians))


def test_pairs_without_a_value_are_left_out() -> None:
    found = paired_difference(np.array([1.0, np.nan, 3.0, 4.0]), np.array([0.0, 0.0, 1.0, np.nan]))
    assert found is not None and found.pairs == 2 and found.mean == 1.5
    assert paired_difference(np.array([1.0, np.nan]), np.array([0.0, 0.0])) is None


def sampled(function, draw, pairs: int, factors: int) -> tuple[SobolIndex, ...]:  # type: ignore[no-untyped-def]
    a, b = draw((factors, pairs)), draw((factors, pairs))
    mixed = []
    for place in range(factors):
        x = a.copy()
        x[place] = b[place]
        mixed.append(function(x))
    names = tuple(f"x{k}" for k in range(factors))
    return sobol_of(function(a), function(b), np.array(mixed), names)


def ishigami(x: np.ndarray) -> np.ndarray:
    return np.sin(x[0]) + 7 * np.sin(x[1]) ** 2 + 0.1 * x[2] ** 4 * np.sin(x[0])


def test_indices_of_ishigamis_function() -> None:
    """In closed form: Ishigami and Homma 1990, a = 7, b = 0.1."""
    b, four = 0.1, math.pi**4
    alone = [0.5 * (1 + b * four / 5) ** 2, 49 / 8, 0.0]
    together = 8 * b**2 * four**2 / 225
    variance = sum(alone) + together
    rng = np.random.default_rng(5)
    found = sampled(ishigami, lambda shape: rng.uniform(-math.pi, math.pi, shape), 2**15, 3)
    for place, each in enumerate(found):
        total = alone[place] + (0.0 if place == 1 else together)
        assert each.first == pytest.approx(alone[place] / variance, abs=0.02)
        assert each.total == pytest.approx(total / variance, abs=0.02)
        assert each.first_interval[0] <= alone[place] / variance <= each.first_interval[1]
        assert each.total_interval[0] <= total / variance <= each.total_interval[1]
        assert each.first_interval[1] - each.first_interval[0] < 0.05


def test_the_bootstrap_is_one_of_the_same_estimators() -> None:
    """With scipy's own intervals, which are corrected for bias, where there are few pairs."""
    rng = np.random.default_rng(6)
    a, b = rng.normal(size=(2, 2, 256))
    mixed = np.array([b[0] + 2 * a[1], a[0] + 2 * b[1]])
    ours = sobol_of(a[0] + 2 * a[1], b[0] + 2 * b[1], mixed, ("x", "y"))
    values = {"f_A": (a[0] + 2 * a[1])[None], "f_B": (b[0] + 2 * b[1])[None]}
    theirs = stats.sobol_indices(func={**values, "f_AB": mixed[:, None]}, n=256)
    boot = theirs.bootstrap(0.95, 2000)
    for place, each in enumerate(ours):
        assert each.first == theirs.first_order.ravel()[place]
        assert each.total == theirs.total_order.ravel()[place]
        for own, other in (
            (each.first_interval, boot.first_order.confidence_interval),
            (each.total_interval, boot.total_order.confidence_interval),
        ):
            ends = [float(np.ravel(end)[place]) for end in other]
            assert own == pytest.approx(ends, abs=0.25 * (ends[1] - ends[0]))


def test_bootstrap_intervals_of_a_linear_model_cover() -> None:
    """y = x + 2 y: shares of the variance are 1/5 and 4/5, alone and in all."""
    rng, hits, repeats = np.random.default_rng(7), [], REPEATS // 2
    for _ in range(repeats):
        found = sampled(lambda x: x[0] + 2 * x[1], lambda shape: rng.normal(size=shape), 128, 2)
        for true, each in zip((0.2, 0.8), found, strict=True):
            ends = (each.first_interval, each.total_interval)
            hits.append([low <= true <= high for low, high in ends])
    covered = np.array(hits).reshape(repeats, 4).mean(axis=0)
    assert ((covered > 0.91) & (covered < 0.985)).all(), covered


def test_what_does_not_vary_has_no_index() -> None:
    ones = np.ones(8)
    assert sobol_of(ones, ones, np.ones((2, 8)), ("x", "y")) == ()
