"""How good candidates are: from their runs to what a search makes small.

Where drives are spread, a candidate has a run for each draw, the same draws for all candidates
(common random numbers): differences of candidates are then not those of luck.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pyarrow

from ab_sim.design.bounds import Bound
from ab_sim.design.judged import OUTCOME, has_settled

_BEYOND, _NOTHING = 1.0, 3.0
"""Costs of what is out of bounds, by how much; and of what says nothing."""


class Aim(NamedTuple):
    """What is to be small, or large."""

    merit: str
    smallest: bool

    def __str__(self) -> str:
        return f"{'smallest' if self.smallest else 'largest'} {self.merit}"


class Standard(NamedTuple):
    """By what candidates are judged."""

    aim: Aim
    bounds: tuple[Bound, ...]
    draws: int = 1
    """Runs of a candidate."""
    share: float = 1.0
    """Of a candidate's drives, that have to settle within all bounds with at least its aim."""


class Scores(NamedTuple):
    """Of candidates, each of shape (candidates,)."""

    aims: np.ndarray
    """The merit that so large a share of a candidate's drives reaches; NaN where fewer settle."""
    within: np.ndarray
    """Whether so large a share settles within all bounds."""
    costs: np.ndarray
    """What is to be small: candidates within bounds before all others, by their aims; the others
    by how far they are from the bounds; last those that say nothing."""


def scored(table: pyarrow.Table, standard: Standard) -> Scores:
    """Judge candidates by their runs.

    Args:
        table: as of ``judged``; the runs of a candidate stand together.
        standard: by what.
    """
    sign = 1.0 if standard.aim.smallest else -1.0
    shape = (-1, standard.draws)
    values = merit_values(table, standard.aim.merit).reshape(shape)
    settled = has_settled(table[OUTCOME].to_pylist()).reshape(shape) & np.isfinite(values)
    inside, beyond = settled.copy(), np.zeros(values.shape)
    for bound in standard.bounds:
        merits = merit_values(table, bound.merit).reshape(shape)
        settled &= np.isfinite(merits)
        holds = bound.holds(merits)
        inside &= holds
        distance = np.abs(merits - bound.limit) / max(abs(bound.limit), 1e-12)
        beyond += np.where(holds, 0.0, distance / (1.0 + distance))
    aims = _reached(np.where(settled, sign * values, math.inf), standard.share)
    needed = _count(standard.share, standard.draws)
    within = inside.sum(axis=1) >= needed
    # How far the drives are from the bounds, the best that are needed of them.
    worst = np.sort(np.where(settled, beyond, math.inf), axis=1)[:, :needed]
    costs = np.where(within, np.arctan(aims) / math.pi, _BEYOND + _mean(worst))
    costs = np.where(np.isfinite(aims), costs, _NOTHING)
    return Scores(np.where(np.isfinite(aims), sign * aims, math.nan), within, costs)


def best_of(scores: Scores) -> int | None:
    """Number of the best candidate within bounds; None if there is none."""
    if not scores.within.any():
        return None
    return int(np.argmin(np.where(scores.within, scores.costs, math.inf)))


def merit_values(table: pyarrow.Table, merit: str) -> np.ndarray:
    """Of a column, NaN where it is null."""
    found: np.ndarray = table[merit].cast(pyarrow.float64()).to_numpy(zero_copy_only=False)
    return found


def joined(scores: Sequence[Scores]) -> Scores:
    """Of all candidates in their order."""
    return Scores(*(np.concatenate(columns) for columns in zip(*scores, strict=True)))


def _count(share: float, draws: int) -> int:
    return max(1, math.ceil(share * draws - 1e-9))


def _reached(values: np.ndarray, share: float) -> np.ndarray:
    """What so large a share of each row is at most."""
    found: np.ndarray = np.sort(values, axis=1)[:, _count(share, values.shape[1]) - 1]
    return found


def _mean(worst: np.ndarray) -> np.ndarray:
    """Of what is out of bounds, below 1; 1 where a drive that is needed says nothing."""
    means: np.ndarray = np.where(np.isfinite(worst), worst, 1.0).mean(axis=1)
    return np.minimum(means, 1.0) + 1e-9
