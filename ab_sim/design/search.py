"""Search for the best values of keys: global by populations, then local."""

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import Bounds, differential_evolution, minimize

from ab_sim.design.variables import Range

POLISH = 0.15
"""Fraction of all runs for the local search."""
BESIDE = 0.02
"""Initial size of the local simplex, as a fraction of a range."""
PRECISION = 1e-4
"""Tolerance of the local search, as a fraction of a range."""

Costs = Callable[[np.ndarray], np.ndarray]
"""Function from values, shape (candidates, keys), to costs, shape (candidates,)."""


class Effort(NamedTuple):
    """Budget of a search."""

    candidates: int
    """Largest number of candidates; the last population may exceed it."""
    seed: int


def search(
    ranges: Sequence[Range],
    costs: Costs,
    effort: Effort,
    scene_values: Sequence[float] | None = None,
) -> None:
    """Evaluate the costs of candidates, approaching the best.

    SciPy's ``differential_evolution`` (Storn and Price 1997) evaluates whole generations at once.
    ``minimize`` (Nelder and Mead 1965) then continues from the best candidate, with whole numbers
    fixed. Nothing is returned: the caller records the best.

    Args:
        ranges: ranges of the keys.
        costs: deterministic cost function.
        effort: budget and seed; they determine the candidates.
        scene_values: values of an additional first candidate; None for none.
    """
    best = _Best(ranges, costs)
    low = np.array([range_.low if range_.whole else 0.0 for range_ in ranges])
    high = np.array([range_.high if range_.whole else 1.0 for range_ in ranges])
    # A power of two, as required for a balanced Sobol sequence and for full lanes.
    population = 2 ** max(4, math.ceil(math.log2(8 * len(ranges))))
    generations = int(effort.candidates * (1.0 - POLISH)) // population - 1
    first = _first(low, high, population, effort.seed)
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
        rng=np.random.default_rng(effort.seed),
        integrality=[range_.whole for range_ in ranges],
        vectorized=True,
        updating="deferred",
        tol=0.0,  # the budget ends the search; only the order of costs matters
        polish=False,
    )
    free = [k for k, range_ in enumerate(ranges) if not range_.whole]
    if free and math.isfinite(best.cost):
        _polish(best, free, max(1, effort.candidates - best.evaluated))


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
    return np.round(places) if range_.whole else range_.at(np.clip(places, 0.0, 1.0))


def _first(low: np.ndarray, high: np.ndarray, count: int, seed: int) -> np.ndarray:
    """Return places that fill the bounds."""
    from scipy.stats import qmc

    shares = qmc.Sobol(len(low), rng=np.random.default_rng(seed)).random(count)
    return np.asarray(low + shares * (high - low))


def _polish(best: _Best, free: Sequence[int], candidates: int) -> None:
    begin = best.place.copy()
    corner = begin[free]
    inwards = np.where(corner + BESIDE > 1.0, -BESIDE, BESIDE)
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
            "xatol": PRECISION,
            "fatol": 0.0,
        },
    )
