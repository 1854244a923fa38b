"""Staged least-squares fit: recordings without balls, start angles, then all parameters.

A direct fit of everything fails: the balls' start angles are unknown, and over a whole run the sum
of squares has many local minima in them. So the stages add unknowns one by one. Recordings without
balls determine rotor and suspension, which then stay fixed. The start angles follow from many
random starts (a Latin hypercube) on the beginning of a recording; the best of them continue on
longer parts. The last stage frees all parameters, with a robust loss.

Each minimisation is SciPy's trust-region method for bounds (Branch, Coleman and Li, 1999, SIAM J.
Sci. Comput. 21, 1-23), the robust loss that of Huber (1964, Ann. Math. Statist. 35, 73-101).
"""

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import qmc

from ab_sim.base.presentation import Progress
from ab_sim.base.workers import Workers
from ab_sim.identification.information import deviations_of, sum_of_squares, triangle
from ab_sim.identification.problem import Problem

Function = Callable[[np.ndarray], np.ndarray]
"""Function from the scaled free parameters to the values of all parameters [SI]."""
Seen = Callable[[np.ndarray, float], None]
"""Callback with values of all parameters [SI] and half the sum of squares."""
STARTS = 24
"""Number of random starts of each recording with balls."""
HORIZONS = ((0.2, 24), (0.4, 10), (0.7, 4), (1.0, 2))
"""Fractions of a recording, from its beginning, fitted in turn, and number of starts of each.

Over a whole run, the ball angles have many local minima; over its beginning they have few.
"""
_SCAN = 64
"""Number of points evaluated before the first fit of recordings without balls."""
NEAR = 2.0
"""Factor around the scene's values within which starts are drawn, subject to bounds."""
SETTLED = 0.1
"""Standard deviation, in units of a parameter's scale, below which the parameter is settled.

Settled parameters are fixed during the search for ball angles.
"""
DRAWS, _DRAW = 3, 1000
"""Largest number of draws of starts, and offset of the random stream between draws."""
_HORIZONS_WITHOUT_BALLS = (0.3, 0.5, 0.7)
"""Fractions of recordings without balls that every draw but the first fits before the whole."""
AT_NOISE = 1.5
"""Mean square of the residuals, in units of noise, up to which a minimum is accepted."""
AGREE = 1.01
"""Largest ratio of two results' sums of squares at which both may be the same minimum."""
_SAME = 4.0 * (AGREE - 1.0)
"""Largest sum of squares of the difference between two results' residuals, relative to theirs.

Near a minimum the sum of squares rises by the square of the distance from its residuals. Results on
opposite sides of a minimum, each at the limit ``AGREE``, are this far apart.
"""
_SEARCH_STEPS, LAST_STEPS = 12, 60
"""Largest number of iterations of a search, and of the last fit."""
_SOFT = 4.0
"""Residual, in standard deviations of the noise, above which it gets less weight (Huber)."""


class Fitted(NamedTuple):
    """Result of a minimisation."""

    values: np.ndarray
    """Values of all parameters [SI]."""
    cost: float
    """Half the sum of squares in units of noise; robust loss if requested."""


def minimise(
    problem: Problem,
    values: np.ndarray,
    free: Sequence[int],
    steps: int,
    last: bool = False,
    seen: Seen = lambda *_: None,
) -> Fitted:
    """Minimise the sum of squared residuals over the free parameters, within their bounds.

    Parameters
    ----------
    problem
        Problem with the residuals.
    values
        Start values [SI].
    free
        Indices of the free parameters.
    steps
        Largest number of iterations.
    last
        Whether to use a robust loss and central differences.
    seen
        Called with each point; an exception in it ends the minimisation.
    """
    free = list(free)
    if not free:
        return Fitted(values.copy(), problem.cost(values))
    scales = problem.scales[free]
    low = np.array([problem.parameters[j].low for j in free]) / scales
    high = np.array([problem.parameters[j].high for j in free]) / scales

    def whole(scaled: np.ndarray) -> np.ndarray:
        values_of_all = values.copy()
        values_of_all[free] = scaled * scales
        return values_of_all

    start = np.clip(values[free] / scales, low, high)
    inside = np.where(np.isfinite(high - low), 1e-9 * (high - low), 0.0)

    points = _Points(problem, whole, free, last, seen)
    result = least_squares(
        points.residuals if last else points.short,
        np.clip(start, low + inside, high - inside),
        jac=points.jacobian if last else points.short_jacobian,
        bounds=(low, high),
        x_scale="jac",
        loss="huber" if last else "linear",
        f_scale=_SOFT,
        max_nfev=steps,
        ftol=1e-10,
        xtol=1e-10,
        gtol=1e-10,
    )
    return Fitted(whole(result.x), float(result.cost))


class _Points:
    """Residuals and derivatives for a minimiser; the last two points are cached.

    Parameters
    ----------
    problem
        Problem with the residuals.
    whole
        Function from the scaled free parameters to the values of all parameters.
    free, central
        See ``Problem.both``.
    seen
        Called with each point.
    """

    def __init__(
        self, problem: Problem, whole: Function, free: Sequence[int], central: bool, seen: Seen
    ) -> None:
        self._problem, self._whole, self._free, self._seen = problem, whole, free, seen
        self._central = central
        self._at_once = problem.costs_no_more(free, central)
        self._known: dict[bytes, tuple[np.ndarray, np.ndarray | None]] = {}

    def residuals(self, scaled: np.ndarray) -> np.ndarray:
        """Return the residuals of all measured values at scaled free parameters."""
        return self._at(scaled, self._at_once)[0]

    def jacobian(self, scaled: np.ndarray) -> np.ndarray:
        """Return the derivatives of the residuals by the scaled free parameters."""
        derivatives = self._at(scaled, True)[1]
        assert derivatives is not None
        return derivatives

    def short(self, scaled: np.ndarray) -> np.ndarray:
        """Return a short vector with the same sum of squares as the residuals.

        It has one entry more than there are parameters. An orthogonal transformation puts the
        residuals on its last axis; otherwise the minimiser would decompose thousands of rows in
        each iteration.
        """
        return np.append(np.zeros(len(scaled)), math.sqrt(sum_of_squares(self.residuals(scaled))))

    def short_jacobian(self, scaled: np.ndarray) -> np.ndarray:
        """Return the derivatives of the short residual vector, with the same J^T J and gradient."""
        slopes, whole = self.jacobian(scaled), self.residuals(scaled)
        along = whole / max(math.sqrt(sum_of_squares(whole)), 1e-300)
        row = (along[:, None] * slopes).sum(axis=0)
        rest = triangle(slopes - np.outer(along, row))
        return np.vstack([rest, row])

    def _at(self, scaled: np.ndarray, both: bool) -> tuple[np.ndarray, np.ndarray | None]:
        """Return the residuals at a point, and also the derivatives if ``both``; cached.

        The minimiser evaluates the derivatives at the last or, after a rejected step, at the point
        before it.
        """
        key, values = scaled.tobytes(), self._whole(scaled)
        point = self._known.get(key)
        if point is None or (both and point[1] is None):
            point = (
                self._problem.both(values, self._free, self._central)
                if both
                else (self._problem.residuals(values), None)
            )
            self._known = {**dict(list(self._known.items())[-1:]), key: point}
            self._seen(values, 0.5 * sum_of_squares(point[0]))
        return point


class SearchSettings(NamedTuple):
    """Settings of staged fits."""

    seed: int
    """Seed of the random starts."""
    tell: Progress
    """Progress callback."""
    workers: Workers
    """Worker processes for the starts; results do not depend on their number."""


class StagedFit:
    """Staged search and fit.

    Parameters
    ----------
    problem
        Problem with all recordings.
    held
        Indices of the parameters that stay at their start.
    search
        Settings of the search.
    """

    def __init__(self, problem: Problem, held: Sequence[int], search: SearchSettings) -> None:
        self.problem, self._held = problem, set(held)
        self._seed, self._tell, self._workers = search
        self.best = problem.start
        """Best values found so far, for all parameters [SI]."""
        self._least = math.inf
        self.disagreements: list[str] = []
        """Recordings for which no two draws of starts agreed on a minimum."""

    def run(self) -> Fitted:
        """Run all stages."""
        problem = self.problem
        numbers = range(len(problem.recordings))
        bare = [k for k in numbers if not problem.recordings[k].with_balls]
        others = [k for k in numbers if problem.recordings[k].with_balls]
        settled: set[int] = set()
        if bare:
            settled = self._without_balls(bare)
        for k in others:
            self._with_balls(k, settled)
            settled |= {
                j for j, parameter in enumerate(problem.parameters) if parameter.belongs_to(k)
            }
        free = [j for j in range(len(problem.parameters)) if j not in self._held]
        fit = minimise(problem, self.best, free, LAST_STEPS, seen=self._keep)
        self.best = fit.values
        return fit

    def _keep(self, values: np.ndarray, cost: float) -> None:
        """Keep the best point, which is the result if the fit is interrupted."""
        if cost < self._least:
            self.best, self._least = values, cost
        self._tell("all recordings", 0, 1)

    def _without_balls(self, bare: Sequence[int]) -> set[int]:
        """Fit recordings without balls; return the indices of parameters that are settled."""
        whole, part = self.problem, self.problem.part(bare)
        places = _places(whole, part)
        self._tell("recordings without balls", 0, 1)
        jacobian = part.derivatives(part.start, range(len(part.parameters)))
        strength = np.linalg.norm(jacobian, axis=0)
        felt = [
            j for j in range(len(part.parameters))
            if strength[j] > 0 and places[j] not in self._held
        ]  # fmt: skip
        start = self.best[places]
        drawn = [
            j for j in felt
            if part.parameters[j].recording is None or part.parameters[j].is_own_angle
        ]  # fmt: skip
        bests: list[Fitted] = []
        for draw in range(DRAWS):
            ends: list[Fitted] = []
            tried = [start, *self._drawn(part, start, drawn, _SCAN, _DRAW * draw)]
            costs = [part.cost(values) for values in tried]
            order = np.argsort(costs, kind="stable")[:4]
            # The scene's own values are fitted in any case: they may be close to a deep but narrow
            # minimum.
            chosen = [0, *(k for k in order if k != 0)] if draw == 0 else list(order)
            for done, k in enumerate(chosen):
                self._tell("recordings without balls", done, len(chosen))
                begin = tried[k]
                # At the end of a recording, a lightly damped deck has a local minimum for each
                # revolution of phase error. The beginning has few, so later draws fit it first.
                for share in _HORIZONS_WITHOUT_BALLS if draw else ():
                    shorter = whole.part(bare, share)
                    begin = minimise(shorter, begin, felt, _SEARCH_STEPS).values
                    whole.runs += shorter.runs
                ends.append(minimise(part, begin, felt, _SEARCH_STEPS * 3))
            bests.append(min(ends, key=lambda end: end.cost))
            if at_noise_or_twice(part, bests):
                break
        else:
            self.disagreements.append("recordings without balls")
        best = min(bests, key=lambda fit: fit.cost)
        self.best[places] = best.values
        jacobian = part.derivatives(best.values, felt)
        whole.runs += part.runs
        settled = deviations_of(jacobian) < SETTLED
        return {places[j] for j, good in zip(felt, settled, strict=True) if good}

    def _with_balls(self, number: int, settled: set[int]) -> None:
        """Search a recording's start angles and the parameters that are not yet settled.

        Parameters
        ----------
        number
            Index of the recording.
        settled
            Indices of the parameters that stay fixed.
        """
        whole = self.problem
        alone = whole.part([number])
        places = _places(whole, alone)
        free = [
            j for j, place in enumerate(places)
            if place not in self._held and (place not in settled)
        ]  # fmt: skip
        begin, bests = self.best[places].copy(), list[Fitted]()
        for draw in range(DRAWS):
            tried = self._drawn(alone, begin, free, STARTS, number + 1 + _DRAW * draw)
            for horizon, keep in HORIZONS:
                part = whole.part([number], horizon)
                what = f"start angles of {part.recordings[0].name}, first {100 * horizon:.0f} %"
                starts, fits = tried[:keep], list[Fitted]()
                self._tell(what, 0, len(starts))
                for fit, runs in self._workers.each(partial(_searched, part, free), starts):
                    fits.append(fit)
                    whole.runs += runs
                    self._tell(what, len(fits), len(starts))
                fits.sort(key=lambda fit: fit.cost)
                tried = [fit.values for fit in _distinct(fits)]
                if not bests:
                    self.best[places] = tried[0]
            bests.append(fits[0])
            self.best[places] = min(bests, key=lambda fit: fit.cost).values
            before = part.runs
            is_settled = at_noise_or_twice(part, bests)
            whole.runs += part.runs - before
            if is_settled:
                return
        self.disagreements.append(part.recordings[0].name)

    def _drawn(
        self, part: Problem, start: np.ndarray, free: Sequence[int], count: int, stream: int
    ) -> list[np.ndarray]:
        """Return ``count`` starts from a Latin hypercube over the free parameters.

        Other parameters have their values of ``start``. ``stream`` selects the random numbers.
        """
        if not free:
            return [start.copy()] * count
        shares = qmc.LatinHypercube(len(free), rng=np.random.default_rng([self._seed, stream]))
        starts = []
        for row in shares.random(count):
            values = start.copy()
            for j, share in zip(free, row.tolist(), strict=True):
                values[j] = _between(part, j, float(start[j]), share)
            starts.append(values)
        return starts


def at_noise_or_twice(part: Problem, bests: Sequence[Fitted]) -> bool:
    """Return whether the best minimum is at noise level, or was found by two draws."""
    best, *others = sorted(bests, key=lambda fit: fit.cost)
    numbers = sum(measured.count for measured in part.recordings)
    if best.cost <= AT_NOISE * 0.5 * numbers:
        return True
    return any(
        other.cost <= AGREE * best.cost and _is_same_minimum(part, best, other) for other in others
    )


def _is_same_minimum(part: Problem, one: Fitted, other: Fitted) -> bool:
    """Return whether two results of nearly equal cost also have nearly equal residuals.

    Far above the noise, different minima may have equal costs by chance. Values are not compared:
    at the same minimum, equal balls may be exchanged, and open directions are arbitrary.
    """
    residuals = part.residuals(one.values)
    difference = part.residuals(other.values) - residuals
    return sum_of_squares(difference) <= _SAME * sum_of_squares(residuals)


def _searched(part: Problem, free: Sequence[int], values: np.ndarray) -> tuple[Fitted, int]:
    """Return the fit from start values, and the number of runs simulated for it."""
    before = part.runs
    fit = minimise(part, values, free, _SEARCH_STEPS)
    return fit, part.runs - before


def _between(part: Problem, j: int, now: float, share: float) -> float:
    """Return the value [SI] of parameter ``j`` at a fraction of its search range around ``now``.

    Angles of a recording range over a revolution, positive values over a factor on a logarithmic
    scale, both limited by the bounds. Other parameters of a recording stay.
    """
    parameter = part.parameters[j]
    if parameter.is_own_angle:
        return now + 2.0 * math.pi * share
    if parameter.recording is not None:
        return now
    low, high = parameter.low, parameter.high
    if now > 0.0:
        low, high = max(low, now / NEAR), min(high, now * NEAR)
        if low > 0.0:
            return low * (high / low) ** share
    return low + share * (high - low)


def _places(whole: Problem, part: Problem) -> list[int]:
    """Return the index in the whole problem of each parameter of a part."""
    return [whole.names.index(name) for name in part.names]


def _distinct(fits: Sequence[Fitted]) -> list[Fitted]:
    """Return results, in rising order of cost, without repeated ones.

    Repeated results are recognised by their cost, as angles are periodic and balls exchangeable.
    """
    kept: list[Fitted] = []
    for fit in fits:
        if all(abs(fit.cost - other.cost) > 1e-6 * max(other.cost, 1e-12) for other in kept):
            kept.append(fit)
    return kept
