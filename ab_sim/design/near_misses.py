"""Where a search finds nothing: how often each bound holds, and how near it was come to."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ab_sim.design.bounds import Bound
from ab_sim.design.judged import OUTCOME, has_settled
from ab_sim.design.tune import MEASURES, Tuning


class NearMiss(NamedTuple):
    """Of one bound."""

    bound: Bound
    holds: int
    """For how many of the runs that settled."""
    settled: int
    measure: str
    """The merit that says how near a run comes: its own, or what decides on one that is true or
    false."""
    nearest: float | None
    """Of that merit, in a run that settled; None: no such run has it, or it is true or false."""
    candidate: int
    """Whose run that is."""


def near_misses(found: Tuning) -> Iterator[NearMiss]:
    """One for each bound, in their order."""
    settled = has_settled(found.runs[OUTCOME])
    for bound in found.task.standard.bounds:
        measure = MEASURES.get(bound.merit, bound.merit)
        holds = int((bound.holds(found.runs[bound.merit]) & settled).sum())
        count = int(settled.sum())
        if measure == bound.merit and not bound.is_number:
            yield NearMiss(bound, holds, count, measure, None, 0)
            continue
        values = np.asarray(found.runs[measure], float)
        sense = 1.0 if bound.upper or measure != bound.merit else -1.0
        ranked = np.where(settled & np.isfinite(values), sense * values, np.inf)
        run = int(np.argmin(ranked))
        nearest = float(values[run]) if np.isfinite(ranked[run]) else None
        candidate = run // found.task.spreading.draws
        yield NearMiss(bound, holds, count, measure, nearest, candidate)
