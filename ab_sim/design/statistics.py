"""Statistics of independent runs, with 95 % confidence intervals."""

import math
from typing import Any, NamedTuple

import numpy as np

from ab_sim.base.errors import InputError, exact

LEVEL = 0.95
"""Confidence level."""
Z = 1.959963984540054
"""Quantile of the standard normal distribution at 1 - (1 - LEVEL) / 2."""


class ShareBalanced(NamedTuple):
    """Share of runs with Wilson's interval."""

    balanced: int
    """Number of balanced runs."""
    runs: int
    """Number of all runs."""
    low: float
    high: float
    """Limits of the interval, ``low`` and ``high``, 0 to 1."""

    @property
    def value(self) -> float:
        """Share, 0 to 1."""
        return self.balanced / self.runs

    @property
    def half_width(self) -> float:
        """Half-width of the interval."""
        return (self.high - self.low) / 2.0

    def report(self) -> dict[str, Any]:
        """Return the share and its interval as JSON-able values."""
        return {**self._asdict(), "value": self.value}

    def runs_for(self, half_width: float) -> int:
        """Return the approximate total number of runs for a half-width of the interval.

        It solves Wilson's half-width for the number of runs at the present share.

        Raises
        ------
        InputError
            The half-width is not above 0 and below 0.5.
        """
        if not 0.0 < half_width < 0.5:
            raise InputError(f"half width {exact(half_width)}: must be above 0 and below 0.5")
        z, spread, h = Z * Z, self.value * (1.0 - self.value), half_width * half_width
        # h (1 + z x)^2 = z (spread x + z x^2 / 4), x = 1 / runs; the positive root
        square, line = z * z * (h - 0.25), z * (2.0 * h - spread)
        x = (-line - math.sqrt(line * line - 4.0 * square * h)) / (2.0 * square)
        return math.ceil(1.0 / x - 1e-9)


class QuantileOfMetric(NamedTuple):
    """Quantile, with an interval between two values of the sample."""

    p: float
    """Probability of the quantile: 0.5 is the median."""
    value: float
    """Quantile of the sample."""
    low: float | None
    """Lower limit of the interval; None if there are too few values."""
    high: float | None
    """Upper limit of the interval; None if there are too few values."""


class PairedShares(NamedTuple):
    """Shares of two designs evaluated with the same draws."""

    both: int
    """Number of draws with which both designs are balanced."""
    only_first: int
    """Number of draws with which only the first design is balanced."""
    only_second: int
    """Number of draws with which only the second design is balanced."""
    neither: int
    """Number of draws with which neither design is balanced."""
    difference: float
    """Share of the first minus share of the second."""
    low: float
    high: float
    """Limits of the difference's interval, ``low`` and ``high``."""
    p_value: float
    """Probability of a difference at least this large by chance alone (McNemar's exact test)."""


class MeanInterval(NamedTuple):
    """Mean of differences with Student's interval; median with that of order statistics."""

    pairs: int
    """Number of draws for which the metric has a value in both designs."""
    mean: float
    """Mean difference, in the metric's unit."""
    low: float
    high: float
    """Limits of the mean's interval, ``low`` and ``high``."""
    median: QuantileOfMetric
    """Median difference."""


def share_of(balanced: np.ndarray) -> ShareBalanced:
    """Return the share of true values, with the interval of Wilson (1927), by scipy.

    Its width is nonzero even if all or none are true.

    Parameters
    ----------
    balanced
        Booleans, shape (runs,), at least one run.
    """
    from scipy.stats import binomtest

    count, runs = int(np.count_nonzero(balanced)), len(balanced)
    low, high = binomtest(count, runs).proportion_ci(LEVEL, method="wilson")
    return ShareBalanced(count, runs, float(low), float(high))


def quantile_of(values: np.ndarray, p: float) -> QuantileOfMetric:
    """Return a quantile with the interval of order statistics (Conover 1999, 3.2), by scipy.

    It holds for any distribution: the number of values below the quantile is binomial.

    Parameters
    ----------
    values
        Finite values, shape (n,), at least one.
    p
        Probability above 0 and below 1.
    """
    from scipy.stats import quantile_test

    interval: Any = quantile_test(values, p=p).confidence_interval(LEVEL)
    low, high = (float(x) if math.isfinite(x) else None for x in (interval.low, interval.high))
    return QuantileOfMetric(p, float(np.quantile(values, p)), low, high)


def paired_shares(first: np.ndarray, second: np.ndarray) -> PairedShares:
    """Compare the shares of two designs that were run with the same draws.

    The interval is method 10 of Newcombe, Statistics in Medicine 17 (1998) 2635.

    Parameters
    ----------
    first, second
        Booleans, shape (runs,), at least one.
    """
    from scipy.stats import binomtest

    both = int(np.count_nonzero(first & second))
    one, other = (int(np.count_nonzero(x & ~y)) for x, y in ((first, second), (second, first)))
    neither = len(first) - both - one - other
    a, b = share_of(first), share_of(second)
    phi = corrected_correlation(both, one, other, neither)

    def width(x: float, y: float) -> float:
        """Return the width of a difference, from two widths of results with correlation phi."""
        return math.sqrt(max(x * x - 2.0 * phi * x * y + y * y, 0.0))

    difference = a.value - b.value
    low = difference - width(a.value - a.low, b.high - b.value)
    high = difference + width(a.high - a.value, b.value - b.low)
    p_value = float(binomtest(one, one + other).pvalue) if one + other else 1.0
    return PairedShares(both, one, other, neither, difference, low, high, p_value)


def paired_difference(first: np.ndarray, second: np.ndarray) -> MeanInterval | None:
    """Return the difference of a metric, first minus second, of designs run with the same draws.

    Parameters
    ----------
    first, second
        Values, shape (runs,), NaN for missing ones; such pairs are left out.

    Returns
    -------
    MeanInterval | None
        Interval of the mean; None with fewer than two pairs.
    """
    from scipy.stats import t

    differences = first - second
    differences = differences[np.isfinite(differences)]
    if len(differences) < 2:
        return None
    mean = float(np.mean(differences))
    half = float(t.ppf(0.5 + LEVEL / 2.0, len(differences) - 1) * np.std(differences, ddof=1))
    half /= math.sqrt(len(differences))
    return MeanInterval(
        len(differences), mean, mean - half, mean + half, quantile_of(differences, 0.5)
    )


def corrected_correlation(both: int, one: int, other: int, neither: int) -> float:
    """Return the correlation phi of two outcomes, with Newcombe's continuity correction.

    Parameters
    ----------
    both, one, other, neither
        Numbers of draws, as in ``PairedShares``.
    """
    product = (both + one) * (other + neither) * (both + other) * (one + neither)
    if product == 0:
        return 0.0
    runs, excess = both + one + other + neither, both * neither - one * other
    corrected = max(excess - runs / 2.0, 0.0) if excess > 0 else float(excess)
    return corrected / math.sqrt(product)


_RESAMPLES = 999
"""Number of bootstrap resamples."""
_AT_A_TIME = 4_000_000
"""Number of values in a batch of resamples: 32 MB."""


class SobolIndex(NamedTuple):
    """Share of a variance that is due to a factor."""

    factor: str
    """Name of the factor."""
    first: float
    """Share of the variance due to the factor alone."""
    first_interval: tuple[float, float]
    """Confidence interval of ``first``."""
    total: float
    """Share of the variance due to the factor, interactions with other factors included."""
    total_interval: tuple[float, float]
    """Confidence interval of ``total``."""


def sobol_of(
    a: np.ndarray, b: np.ndarray, exchanged: np.ndarray, factors: tuple[str, ...]
) -> tuple[SobolIndex, ...]:
    """Return the Sobol indices of a metric, by scipy.stats.sobol_indices.

    The estimators are those of Saltelli and others, Computer Physics Communications 181 (2010) 259,
    table 2 (b) and (f). Intervals are percentiles of a bootstrap over the pairs, which are
    independent draws.

    Parameters
    ----------
    a, b
        Values of independently drawn drives, shape (n,), n a power of 2.
    exchanged
        Values of drives of ``a`` with one factor of ``b``, shape (factors, n).
    factors
        Names of the factors.

    Returns
    -------
    tuple[SobolIndex, ...]
        One index per factor; empty if the metric does not vary.
    """
    from scipy.stats import sobol_indices

    if np.ptp(np.concatenate([a, b])) == 0.0:
        return ()
    values: Any = {"f_A": a[None], "f_B": b[None], "f_AB": exchanged[:, None]}
    indices = sobol_indices(func=values, n=len(a))
    low, high = _intervals(a, b, exchanged)
    firsts, totals = np.atleast_2d(indices.first_order)[0], np.atleast_2d(indices.total_order)[0]
    return tuple(
        SobolIndex(
            factor,
            float(firsts[i]),
            (float(low[0, i]), float(high[0, i])),
            float(totals[i]),
            (float(low[1, i]), float(high[1, i])),
        )
        for i, factor in enumerate(factors)
    )


def _intervals(
    a: np.ndarray, b: np.ndarray, exchanged: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the lower and the upper limits of the intervals of Sobol indices.

    Each has shape (2, factors): first-order indices, then total ones. Arguments are those of
    ``sobol_of``.

    ``SobolResult.bootstrap`` computes them as well, but with n^2 numbers: 2 GB at 4096 pairs.
    Batches of percentile bootstrap have no such limit.
    """
    from scipy.stats import bootstrap

    def statistic(pairs: np.ndarray, axis: int) -> np.ndarray:
        """Return both indices of all factors for resampled pairs, as in ``sobol_of``."""
        f_a, f_b, mixed = a[pairs], b[pairs], exchanged[:, pairs]
        mean = (f_a.mean(axis) + f_b.mean(axis)) / 2.0
        centred = f_b - mean[..., None]
        variance = (f_a.var(axis) + f_b.var(axis)) / 2.0
        variance += ((f_a.mean(axis) - f_b.mean(axis)) / 2.0) ** 2
        first = (centred * (mixed - f_a)).mean(-1)
        total = 0.5 * ((f_a - mixed) ** 2).mean(-1)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.nan_to_num(np.stack([first, total]) / variance, posinf=0.0, neginf=0.0)

    size = len(a) * (2 + len(exchanged))
    intervals = bootstrap(
        (np.arange(len(a)),),
        statistic,
        n_resamples=_RESAMPLES,
        batch=max(1, _AT_A_TIME // size),
        vectorized=True,
        method="percentile",
        confidence_level=LEVEL,
        rng=np.random.default_rng(0),
    ).confidence_interval
    return np.asarray(intervals.low), np.asarray(intervals.high)
