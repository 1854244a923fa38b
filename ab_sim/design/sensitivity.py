"""Sobol indices of tolerances, with bootstrap intervals."""

from typing import Any, NamedTuple

import numpy as np

from ab_sim.design.intervals import LEVEL

RESAMPLES = 999
AT_A_TIME = 4_000_000
"""Number of values in a batch of resamples: 32 MB."""


class SobolIndex(NamedTuple):
    """Share of a variance that is due to a factor."""

    factor: str
    first: float
    """Share of the factor alone."""
    first_interval: tuple[float, float]
    total: float
    """Share of the factor and all its interactions."""
    total_interval: tuple[float, float]


def sobol_of(
    a: np.ndarray, b: np.ndarray, exchanged: np.ndarray, factors: tuple[str, ...]
) -> tuple[SobolIndex, ...]:
    """Return the Sobol indices of a metric, by scipy.stats.sobol_indices.

    The estimators are those of Saltelli and others, Computer Physics Communications 181 (2010) 259,
    table 2 (b) and (f). Intervals are percentiles of a bootstrap over the pairs, which are
    independent draws.

    Args:
        a, b: values of independently drawn drives, shape (n,), n a power of 2.
        exchanged: values of drives of ``a`` with one factor of ``b``, shape (factors, n).
        factors: names of the factors.

    Returns:
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
    """Return the limits of the intervals, each of shape (2, factors): first, total.

    ``SobolResult.bootstrap`` computes them as well, but with n^2 numbers: 2 GB at 4096 pairs.
    Batches of percentile bootstrap have no such limit.
    """
    from scipy.stats import bootstrap

    def statistic(pairs: np.ndarray, axis: int) -> np.ndarray:
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
        n_resamples=RESAMPLES,
        batch=max(1, AT_A_TIME // size),
        vectorized=True,
        method="percentile",
        confidence_level=LEVEL,
        rng=np.random.default_rng(0),
    ).confidence_interval
    return np.asarray(intervals.low), np.asarray(intervals.high)
