"""Search for the best candidate of a tuning: global by populations, then local.

With spread, every candidate is run with the same draws (common random numbers), so that differences
between candidates are not due to chance.
"""

import functools
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
import pyarrow
from scipy.optimize import Bounds, differential_evolution, minimize

from ab_sim.base.errors import SceneError
from ab_sim.design.bounds import Bound
from ab_sim.design.draws import DrawnPoints
from ab_sim.design.judged import OUTCOME, Job, has_settled, metric_values, varied_scene
from ab_sim.design.points import Range
from ab_sim.design.tolerances import Tolerance
from ab_sim.scene.model import Scene

MEASURES = {"balanced": "residual_unbalance"}
"""Number that measures the distance of a truth-valued metric from being true."""
_POLISH = 0.15
"""Fraction of all runs for the local search."""
_BESIDE = 0.02
"""Initial size of the local simplex, as a fraction of a range."""
_PRECISION = 1e-4
"""Tolerance of the local search, as a fraction of a range."""
Costs = Callable[[np.ndarray], np.ndarray]
"""Function from values, shape (candidates, keys), to costs, shape (candidates,)."""
_BEYOND, _NOTHING = 1.0, 3.0
"""Costs of candidates outside bounds (plus the violation), and of candidates without a value."""


class Aim(NamedTuple):
    """Objective: a metric to be minimised or maximised."""

    metric: str
    """Key of the metric."""
    smallest: bool
    """True if the metric is to be minimised."""

    def __str__(self) -> str:
        return f"{'smallest' if self.smallest else 'largest'} {self.metric}"


class Task(NamedTuple):
    """Definition of a tuning."""

    scene: Scene
    """Scene whose keys vary."""
    ranges: tuple[Range, ...]
    """Ranges of the varied keys."""
    aim: Aim
    """Metric to be minimised or maximised."""
    bounds: tuple[Bound, ...]
    """Bounds on metrics."""
    candidates: int
    """Largest number of candidates; the last population may exceed it."""
    seed: int = 0
    """Seed of the search, and of the drives of each candidate."""
    tolerances: tuple[Tolerance, ...] = ()
    """Tolerances of the drives of a design; empty for identical drives."""
    draws: int = 1
    """Number of drives per candidate; 1 without tolerances."""
    share: float = 1.0
    """Fraction of a candidate's drives that must settle within all bounds and reach the aim."""

    @property
    def metrics(self) -> tuple[str, ...]:
        """Metrics of the aim and the bounds, and numbers that measure truth-valued ones."""
        decide = [self.aim.metric, *(bound.metric for bound in self.bounds)]
        return tuple(dict.fromkeys([*decide, *(MEASURES[m] for m in decide if m in MEASURES)]))

    def report(self) -> dict[str, Any]:
        """Return the defining values, JSON-able."""
        return {
            "ranges": {range_.key: [*range_[1:]] for range_ in self.ranges},
            "aim": str(self.aim),
            "bounds": [str(bound) for bound in self.bounds],
            "share": self.share,
            "effort": [self.candidates, self.seed],
            "spread": [tolerance.report() for tolerance in self.tolerances],
            "draws": self.draws,
            "seed": self.seed,
        }


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


def scored(table: pyarrow.Table, task: Task) -> Scores:
    """Score candidates by their runs.

    Parameters
    ----------
    table
        Table of ``judged``; the runs of a candidate are contiguous.
    task
        Task with the criteria.
    """
    sign = 1.0 if task.aim.smallest else -1.0
    shape = (-1, task.draws)
    values = metric_values(table, task.aim.metric).reshape(shape)
    settled = has_settled(table[OUTCOME].to_pylist()).reshape(shape) & np.isfinite(values)
    inside, beyond = settled.copy(), np.zeros(values.shape)
    for bound in task.bounds:
        metrics = metric_values(table, bound.metric).reshape(shape)
        settled &= np.isfinite(metrics)
        holds = bound.holds(metrics)
        inside &= holds
        # d / (1 + d) is below 1, so that one bound that is violated by far does not hide others.
        distance = np.abs(metrics - bound.limit) / max(abs(bound.limit), 1e-12)
        beyond += np.where(holds, 0.0, distance / (1.0 + distance))
    aims = _reached(np.where(settled, sign * values, math.inf), task.share)
    needed = _count(task.share, task.draws)
    within = inside.sum(axis=1) >= needed
    # Three ranges of costs that do not overlap: within bounds -0.5 to 0.5 (arctan keeps the order
    # of all aims), outside from _BEYOND, without a value _NOTHING. The search thus first reaches
    # the bounds, then improves the aim. Outside, the mean violation of the best drives counts, as
    # many as the required fraction.
    worst = np.sort(np.where(settled, beyond, math.inf), axis=1)[:, :needed]
    costs = np.where(within, np.arctan(aims) / math.pi, _BEYOND + _mean(worst))
    costs = np.where(np.isfinite(aims), costs, _NOTHING)
    return Scores(np.where(np.isfinite(aims), sign * aims, math.nan), within, costs)


def best_of(scores: Scores) -> int | None:
    """Return the index of the best candidate within bounds; None if there is none."""
    if not scores.within.any():
        return None
    return int(np.argmin(np.where(scores.within, scores.costs, math.inf)))


def joined(scores: Sequence[Scores]) -> Scores:
    """Return the scores of all candidates from those of successive populations."""
    return Scores(*(np.concatenate(columns) for columns in zip(*scores, strict=True)))


def _count(share: float, draws: int) -> int:
    """Return the least number of drives that is a fraction ``share`` of ``draws``, at least 1."""
    return max(1, math.ceil(share * draws - 1e-9))


def _reached(values: np.ndarray, share: float) -> np.ndarray:
    """Return the largest value among the smallest fraction ``share`` of each row.

    Parameters
    ----------
    values
        Shape (candidates, draws).
    share
        Fraction, 0 to 1.
    """
    quantiles: np.ndarray = np.sort(values, axis=1)[:, _count(share, values.shape[1]) - 1]
    return quantiles


def _mean(worst: np.ndarray) -> np.ndarray:
    """Return the mean constraint violation of each candidate, above 0 and at most about 1.

    Parameters
    ----------
    worst
        Violations of the required drives, shape (candidates, drives); infinite for a drive without
        a value, which counts as 1.
    """
    means: np.ndarray = np.where(np.isfinite(worst), worst, 1.0).mean(axis=1)
    return np.minimum(means, 1.0) + 1e-9


class Candidates:
    """Points that grow during a search: a run for each draw of each candidate.

    Parameters
    ----------
    task
        Definition of the tuning.
    study
        Defining values of the study, JSON-able.
    """

    def __init__(self, task: Task, study: dict[str, Any]) -> None:
        self._task, self._study = task, study
        self._varied = tuple(range_.key for range_ in task.ranges)
        self.keys = tuple(dict.fromkeys([*self._varied, *(t.key for t in task.tolerances)]))
        self.values: list[tuple[Any, ...]] = []
        """Values of each candidate, in the order of the ranges."""

    def __len__(self) -> int:
        return len(self.values) * self._task.draws

    def add(self, values: np.ndarray) -> range:
        """Add candidates, shape (candidates, keys), and return the indices of the added runs."""
        first = len(self)
        for row in values.tolist():
            pairs = zip(row, self._task.ranges, strict=True)
            self.values.append(tuple(int(v) if range_.whole else v for v, range_ in pairs))
        return range(first, len(self))

    def at(self, run: int) -> tuple[Any, ...]:
        """Return the values of a run, see ``Points``."""
        candidate, draw = divmod(run, self._task.draws)
        candidate_values = self.values[candidate]
        drawn = self._drawn(candidate)
        if drawn is None:
            return candidate_values + (None,) * (len(self.keys) - len(candidate_values))
        spread = dict(zip(drawn.keys, drawn.at(draw), strict=True))
        values = dict(zip(self._varied, candidate_values, strict=True)) | spread
        return tuple(values[key] for key in self.keys)

    def report(self) -> dict[str, Any]:
        """Return the study, see ``Points``."""
        return self._study

    def scene_of(self, candidate: int) -> Scene:
        """Return the nominal scene of a candidate.

        Raises
        ------
        SceneError
            The values give no valid scene; the message states why.
        """
        return varied_scene(Job(self._task.scene, self._varied, ()), self.values[candidate])

    @functools.lru_cache(maxsize=4)  # noqa: B019  # runs of a candidate are requested together
    def _drawn(self, candidate: int) -> DrawnPoints | None:
        """Return the drives of a candidate; None without spread or without a valid scene."""
        task = self._task
        if not task.tolerances:
            return None
        try:
            scene = self.scene_of(candidate)
        except SceneError:
            return None
        return DrawnPoints(scene, task.tolerances, task.draws, task.seed)


def search(
    ranges: Sequence[Range],
    costs: Costs,
    candidates: int,
    seed: int,
    scene_values: Sequence[float] | None = None,
) -> None:
    """Evaluate the costs of candidates, approaching the best.

    SciPy's ``differential_evolution`` (Storn and Price 1997) evaluates whole generations at once.
    ``minimize`` (Nelder and Mead 1965) then continues from the best candidate, with whole numbers
    fixed. Nothing is returned: the caller records the best.

    Parameters
    ----------
    ranges
        Ranges of the keys.
    costs
        Deterministic cost function.
    candidates, seed
        See ``Task``; they determine the candidates.
    scene_values
        Values of an additional first candidate; None for none.
    """
    best = _Best(ranges, costs)
    low = np.array([range_.low if range_.whole else 0.0 for range_ in ranges])
    high = np.array([range_.high if range_.whole else 1.0 for range_ in ranges])
    # A power of two, as required for a balanced Sobol sequence and for full lanes.
    population = 2 ** max(4, math.ceil(math.log2(8 * len(ranges))))
    generations = int(candidates * (1.0 - _POLISH)) // population - 1
    first = _first(low, high, population, seed)
    if scene_values is not None:
        first[0] = [range_.share(value) for range_, value in zip(ranges, scene_values, strict=True)]

    def of_population(places: np.ndarray, /) -> Any:
        return best.of(np.atleast_2d(places.T))

    differential_evolution(
        of_population,
        Bounds(low, high),
        maxiter=max(1, generations),
        popsize=math.ceil(population / len(ranges)),
        init=first,
        rng=np.random.default_rng(seed),
        integrality=[range_.whole for range_ in ranges],
        vectorized=True,
        updating="deferred",
        tol=0.0,  # the budget ends the search; only the order of costs matters
        polish=False,
    )
    free = [k for k, range_ in enumerate(ranges) if not range_.whole]
    if free and math.isfinite(best.cost):
        _polish(best, free, max(1, candidates - best.evaluated))


class _Best:
    """Cost function that counts candidates and records the best.

    Places are fractions of the ranges, or whole numbers.
    """

    def __init__(self, ranges: Sequence[Range], costs: Costs) -> None:
        self._ranges, self._costs = ranges, costs
        self.evaluated, self.cost = 0, math.inf
        self.place = np.zeros(len(ranges))

    def of(self, places: np.ndarray) -> np.ndarray:
        """Return the costs of places, shape (candidates, keys)."""
        columns = [_value(range_, places[:, k]) for k, range_ in enumerate(self._ranges)]
        costs = self._costs(np.column_stack(columns))
        self.evaluated += len(costs)
        least = int(np.argmin(costs))
        if costs[least] < self.cost:
            self.cost, self.place = float(costs[least]), places[least].copy()
        return costs


def _value(range_: Range, places: np.ndarray) -> np.ndarray:
    """Return the values of a key at places, shape (candidates,); see ``_Best``."""
    return np.round(places) if range_.whole else range_.at(np.clip(places, 0.0, 1.0))


def _first(low: np.ndarray, high: np.ndarray, count: int, seed: int) -> np.ndarray:
    """Return the first population: a Sobol sequence between the bounds, shape (count, keys)."""
    from scipy.stats import qmc

    shares = qmc.Sobol(len(low), rng=np.random.default_rng(seed)).random(count)
    return np.asarray(low + shares * (high - low))


def _polish(best: _Best, free: Sequence[int], candidates: int) -> None:
    """Continue from the best candidate by Nelder and Mead's method, with whole numbers fixed.

    Parameters
    ----------
    best
        Cost function with the best candidate so far.
    free
        Indices of the keys that are not whole numbers.
    candidates
        Largest number of further candidates.
    """
    begin = best.place.copy()
    corner = begin[free]
    inwards = np.where(corner + _BESIDE > 1.0, -_BESIDE, _BESIDE)
    simplex = np.vstack([corner, corner + np.diag(inwards)])

    def cost(place: np.ndarray) -> float:
        whole = begin.copy()
        whole[free] = place
        return float(best.of(whole[None])[0])

    minimize(
        cost,
        corner,
        method="Nelder-Mead",
        bounds=[(0.0, 1.0)] * len(free),
        options={
            "initial_simplex": simplex,
            "maxfev": candidates,
            "xatol": _PRECISION,
            "fatol": 0.0,
        },
    )
