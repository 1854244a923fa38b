"""What a number of independent runs says of all of them, and how surely: intervals of 95 %."""

import math
from typing import Any, NamedTuple

import numpy as np

from ab_sim.errors import InputError, exact

LEVEL = 0.95
"""How often an interval has what it is an interval of."""
Z = 1.959963984540054
"""Quantile of the standard normal distribution at 1 - (1 - LEVEL) / 2."""


class ShareBalanced(NamedTuple):
    """A share of runs, and Wilson's interval of it."""

    balanced: int
    """Runs that are of it."""
    runs: int
    low: float
    high: float

    @property
    def value(self) -> float:
        """The share, 0 to 1."""
        return self.balanced / self.runs

    @property
    def half_width(self) -> float:
        """Of the interval."""
        return (self.high - self.low) / 2.0

    def runs_for(self, half_width: float) -> int:
        """About how many runs, these included, an interval of a half width takes.

        Solves Wilson's half width for the runs, at the share that was found.

        Raises:
            InputError: the half width is not above 0 and below 0.5.
        """
        if not 0.0 < half_width < 0.5:
            raise InputError(f"half width {exact(half_width)}: must be above 0 and below 0.5")
        z, spread, h = Z * Z, self.value * (1.0 - self.value), half_width * half_width
        # h (1 + z x)^2 = z (spread x + z x^2 / 4), x = 1 / runs; the positive root
        square, line = z * z * (h - 0.25), z * (2.0 * h - spread)
        x = (-line - math.sqrt(line * line - 4.0 * square * h)) / (2.0 * square)
        return math.ceil(1.0 / x - 1e-9)


class QuantileOfMerit(NamedTuple):
    """A quantile, and an interval between two values of the sample."""

    p: float
    """Which: 0.5 is the median."""
    value: float
    low: float | None
    """None where there are too few values to have one."""
    high: float | None


class PairedShares(NamedTuple):
    """Shares of two designs in the same draws."""

    both: int
    only_first: int
    only_second: int
    neither: int
    difference: float
    """Share of the first less that of the second."""
    low: float
    high: float
    p_value: float
    """McNemar's exact test: how often chance alone makes such a difference."""


class MeanInterval(NamedTuple):
    """A mean of differences, with Student's interval; a median, with that of order statistics."""

    pairs: int
    """With a value in both designs."""
    mean: float
    low: float
    high: float
    median: QuantileOfMerit


def share_of(balanced: np.ndarray) -> ShareBalanced:
    """The share of true ones, with the interval of Wilson (1927), by scipy.

    It is none of zero width where all are true, or none is.

    Args:
        balanced: booleans, shape (runs,), at least one.
    """
    from scipy.stats import binomtest

    count, runs = int(np.count_nonzero(balanced)), len(balanced)
    low, high = binomtest(count, runs).proportion_ci(LEVEL, method="wilson")
    return ShareBalanced(count, runs, float(low), float(high))


def quantile_of(values: np.ndarray, p: float) -> QuantileOfMerit:
    """A quantile, with the interval of order statistics (Conover 1999, 3.2), by scipy.

    It asks nothing of the distribution: so many values are below the quantile as a binomial
    distribution says.

    Args:
        values: finite, shape (n,), at least one.
        p: above 0, below 1.
    """
    from scipy.stats import quantile_test

    found: Any = quantile_test(values, p=p).confidence_interval(LEVEL)
    low, high = (float(x) if math.isfinite(x) else None for x in (found.low, found.high))
    return QuantileOfMerit(p, float(np.quantile(values, p)), low, high)


def paired_shares(first: np.ndarray, second: np.ndarray) -> PairedShares:
    """Which of two designs has the larger share, each draw having been run with both.

    The interval is method 10 of Newcombe, Statistics in Medicine 17 (1998) 2635.

    Args:
        first, second: booleans, shape (runs,), at least one.
    """
    from scipy.stats import binomtest

    both = int(np.count_nonzero(first & second))
    one, other = (int(np.count_nonzero(x & ~y)) for x, y in ((first, second), (second, first)))
    neither = len(first) - both - one - other
    a, b = share_of(first), share_of(second)
    phi = _correlation(both, one, other, neither)

    def reach(x: float, y: float) -> float:
        return math.sqrt(max(x * x - 2.0 * phi * x * y + y * y, 0.0))

    difference = a.value - b.value
    low = difference - reach(a.value - a.low, b.high - b.value)
    high = difference + reach(a.high - a.value, b.value - b.low)
    p_value = float(binomtest(one, one + other).pvalue) if one + other else 1.0
    return PairedShares(both, one, other, neither, difference, low, high, p_value)


def paired_difference(first: np.ndarray, second: np.ndarray) -> MeanInterval | None:
    """Of a merit of two designs, each draw having been run with both: first less second.

    Args:
        first, second: shape (runs,); NaN where a run has no value. Pairs with one are left out.

    Returns:
        None with fewer than two pairs.
    """
    from scipy.stats import t

    found = first - second
    found = found[np.isfinite(found)]
    if len(found) < 2:
        return None
    mean = float(np.mean(found))
    reach = float(t.ppf(0.5 + LEVEL / 2.0, len(found) - 1) * np.std(found, ddof=1))
    reach /= math.sqrt(len(found))
    return MeanInterval(len(found), mean, mean - reach, mean + reach, quantile_of(found, 0.5))


def _correlation(both: int, one: int, other: int, neither: int) -> float:
    """Of the two outcomes, with Newcombe's correction for their being counts."""
    product = (both + one) * (other + neither) * (both + other) * (one + neither)
    if product == 0:
        return 0.0
    runs, excess = both + one + other + neither, both * neither - one * other
    corrected = max(excess - runs / 2.0, 0.0) if excess > 0 else float(excess)
    return corrected / math.sqrt(product)
