"""A search for the best values of keys: globally on whole populations, then near the best."""

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import Bounds, differential_evolution, minimize

from ab_sim.design.variables import Range

POLISH = 0.15
"""Of all runs, those that are left for the neighbourhood of the best."""
BESIDE = 0.02
"""Of a range: size of the simplex that the polish begins with."""
PRECISION = 1e-4
"""Of a range, to which the polish finds the best."""

Costs = Callable[[np.ndarray], np.ndarray]
"""From values, shape (candidates, keys), to what is to be small, shape (candidates,)."""


class Effort(NamedTuple):
    """How much a search may do."""

    candidates: int
    """At most; a population more may be begun."""
    seed: int


def search(
    ranges: Sequence[Range],
    costs: Costs,
    effort: Effort,
    known: Sequence[float] | None = None,
) -> None:
    """Ask for the costs of candidates, each time nearer to the best.

    By scipy's ``differential_evolution`` (Storn and Price 1997), whose generations are asked for
    together, and then by its ``minimize`` (Nelder and Mead 1965) from the best on, whole numbers
    held. The caller notes what was best: nothing comes back.

    Args:
        ranges: of the keys.
        costs: the same for the same values.
        effort: the same effort asks for the same candidates.
        known: values to begin with, beside those that fill the ranges.
    """
    best = _Best(ranges, costs)
    low = np.array([each.low if each.whole else 0.0 for each in ranges])
    high = np.array([each.high if each.whole else 1.0 for each in ranges])
    # A power of two, as a Sobol sequence likes it and lanes do.
    population = 2 ** max(4, math.ceil(math.log2(8 * len(ranges))))
    generations = int(effort.candidates * (1.0 - POLISH)) // population - 1
    first = _first(low, high, population, effort.seed)
    if known is not None:
        first[0] = [each.share(value) for each, value in zip(ranges, known, strict=True)]

    def of_population(places: np.ndarray, /) -> Any:
        return best.of(np.atleast_2d(places.T))

    differential_evolution(
        of_population,
        Bounds(low, high),
        maxiter=max(1, generations),
        popsize=math.ceil(population / len(ranges)),
        init=first,
        rng=np.random.default_rng(effort.seed),
        integrality=[each.whole for each in ranges],
        vectorized=True,
        updating="deferred",
        tol=0.0,  # runs are given; costs say by their order only what is better
        polish=False,
    )
    free = [k for k, each in enumerate(ranges) if not each.whole]
    if free and math.isfinite(best.cost):
        _polish(best, free, max(1, effort.candidates - best.asked))


class _Best:
    """Counts what is asked for, and remembers the best.

    Places are shares of the ranges, or whole numbers.
    """

    def __init__(self, ranges: Sequence[Range], costs: Costs) -> None:
        self._ranges, self._costs = ranges, costs
        self.asked, self.cost = 0, math.inf
        self.place = np.zeros(len(ranges))

    def of(self, places: np.ndarray) -> np.ndarray:
        """Costs of places, shape (candidates, keys)."""
        columns = [_value(each, places[:, k]) for k, each in enumerate(self._ranges)]
        costs = self._costs(np.column_stack(columns))
        self.asked += len(costs)
        least = int(np.argmin(costs))
        if costs[least] < self.cost:
            self.cost, self.place = float(costs[least]), places[least].copy()
        return costs


def _value(range_: Range, places: np.ndarray) -> np.ndarray:
    return np.round(places) if range_.whole else range_.at(np.clip(places, 0.0, 1.0))


def _first(low: np.ndarray, high: np.ndarray, count: int, seed: int) -> np.ndarray:
    """Places that fill the bounds."""
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
