"""Scores of candidates: from their runs to the objective of a search.

With spread, every candidate is run with the same draws (common random numbers), so that differences
between candidates are not due to chance.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pyarrow

from ab_sim.design.bounds import Bound
from ab_sim.design.judged import OUTCOME, has_settled

_BEYOND, _NOTHING = 1.0, 3.0
"""Costs of candidates outside bounds (plus the violation), and of candidates without a value."""


class Aim(NamedTuple):
    """Objective: a metric to be minimised or maximised."""

    metric: str
    smallest: bool

    def __str__(self) -> str:
        return f"{'smallest' if self.smallest else 'largest'} {self.metric}"


class Standard(NamedTuple):
    """Criteria for candidates."""

    aim: Aim
    bounds: tuple[Bound, ...]
    draws: int = 1
    """Number of runs per candidate."""
    share: float = 1.0
    """Fraction of a candidate's drives that must settle within all bounds and reach the aim."""


class Scores(NamedTuple):
    """Scores of candidates, each of shape (candidates,)."""

    aims: np.ndarray
    """Value that the required fraction of a candidate's drives reaches; NaN if too few settle."""
    within: np.ndarray
    """True for each candidate whose required fraction of drives settles within all bounds."""
    costs: np.ndarray
    """Costs to be minimised.

    Candidates within bounds come first, by their aim. The others follow by their distance from the
    bounds, and last come those without a value.
    """


def scored(table: pyarrow.Table, standard: Standard) -> Scores:
    """Score candidates by their runs.

    Args:
        table: table of ``judged``; the runs of a candidate are contiguous.
        standard: criteria.
    """
    sign = 1.0 if standard.aim.smallest else -1.0
    shape = (-1, standard.draws)
    values = metric_values(table, standard.aim.metric).reshape(shape)
    settled = has_settled(table[OUTCOME].to_pylist()).reshape(shape) & np.isfinite(values)
    inside, beyond = settled.copy(), np.zeros(values.shape)
    for bound in standard.bounds:
        metrics = metric_values(table, bound.metric).reshape(shape)
        settled &= np.isfinite(metrics)
        holds = bound.holds(metrics)
        inside &= holds
        distance = np.abs(metrics - bound.limit) / max(abs(bound.limit), 1e-12)
        beyond += np.where(holds, 0.0, distance / (1.0 + distance))
    aims = _reached(np.where(settled, sign * values, math.inf), standard.share)
    needed = _count(standard.share, standard.draws)
    within = inside.sum(axis=1) >= needed
    # Mean violation of the best drives, as many as the required fraction.
    worst = np.sort(np.where(settled, beyond, math.inf), axis=1)[:, :needed]
    costs = np.where(within, np.arctan(aims) / math.pi, _BEYOND + _mean(worst))
    costs = np.where(np.isfinite(aims), costs, _NOTHING)
    return Scores(np.where(np.isfinite(aims), sign * aims, math.nan), within, costs)


def best_of(scores: Scores) -> int | None:
    """Return the index of the best candidate within bounds; None if there is none."""
    if not scores.within.any():
        return None
    return int(np.argmin(np.where(scores.within, scores.costs, math.inf)))


def metric_values(table: pyarrow.Table, metric: str) -> np.ndarray:
    """Return the values of a column, NaN for null."""
    values: np.ndarray = table[metric].cast(pyarrow.float64()).to_numpy(zero_copy_only=False)
    return values


def joined(scores: Sequence[Scores]) -> Scores:
    """Concatenate scores of all candidates in order."""
    return Scores(*(np.concatenate(columns) for columns in zip(*scores, strict=True)))


def _count(share: float, draws: int) -> int:
    return max(1, math.ceil(share * draws - 1e-9))


def _reached(values: np.ndarray, share: float) -> np.ndarray:
    """Return the largest value among the best ``share`` of each row."""
    quantiles: np.ndarray = np.sort(values, axis=1)[:, _count(share, values.shape[1]) - 1]
    return quantiles


def _mean(worst: np.ndarray) -> np.ndarray:
    """Return the mean constraint violation, at most about 1.

    A required drive without a value counts as 1.
    """
    means: np.ndarray = np.where(np.isfinite(worst), worst, 1.0).mean(axis=1)
    return np.minimum(means, 1.0) + 1e-9
