"""Diagnosis of a search without a result: how often each bound holds, and the nearest values."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ab_sim.design.bounds import Bound
from ab_sim.design.judged import OUTCOME, has_settled
from ab_sim.design.tune import MEASURES, Tuning


class NearMiss(NamedTuple):
    """Diagnosis of one bound."""

    bound: Bound
    holds: int
    """Number of settled runs that satisfy the bound."""
    settled: int
    measure: str
    """Metric that measures the distance: the bound's own, or the one that decides a truth value."""
    nearest: float | None
    """Nearest value of that metric among settled runs; None if there is no number."""
    candidate: int
    """Index of the candidate with that run."""


def near_misses(tuning: Tuning) -> Iterator[NearMiss]:
    """Yield a diagnosis per bound, in their order."""
    settled = has_settled(tuning.runs[OUTCOME])
    for bound in tuning.task.standard.bounds:
        measure = MEASURES.get(bound.metric, bound.metric)
        holds = int((bound.holds(tuning.runs[bound.metric]) & settled).sum())
        count = int(settled.sum())
        if measure == bound.metric and not bound.is_number:
            yield NearMiss(bound, holds, count, measure, None, 0)
            continue
        values = np.asarray(tuning.runs[measure], float)
        sense = 1.0 if bound.upper or measure != bound.metric else -1.0
        ranked = np.where(settled & np.isfinite(values), sense * values, np.inf)
        run = int(np.argmin(ranked))
        nearest = float(values[run]) if np.isfinite(ranked[run]) else None
        candidate = run // tuning.task.spreading.draws
        yield NearMiss(bound, holds, count, measure, nearest, candidate)
