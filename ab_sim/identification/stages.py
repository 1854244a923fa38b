"""The fit: from recordings without balls over many start angles to all that is free at once."""

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import qmc

from ab_sim.identification.information import deviations_of, sum_of_squares, triangle
from ab_sim.identification.problem import Problem
from ab_sim.workers import Workers

Function = Callable[[np.ndarray], np.ndarray]
Tell = Callable[[str, int, int], None]
"""Called with what is done now, done, of all; what it raises ends the work."""
Seen = Callable[[np.ndarray, float], None]
"""Called with values of all parameters [SI], and half the sum of squares there."""
STARTS = 24
"""Random starts of each recording with balls."""
HORIZONS = ((0.2, 24), (0.4, 10), (0.7, 4), (1.0, 2))
"""Parts of a recording that are fitted one after the other, and how many starts each begins with:
over a whole run the ball angles have many wrong minima, over its beginning few."""
SCAN = 64
"""Points looked at before the first fit of what the recordings without balls tell."""
NEAR = 2.0
"""Starts lie within this factor of the scene's values, as far as bounds allow."""
SETTLED = 0.1
"""Of a parameter's scale: known better than this after the recordings without balls, it is held
while ball angles are looked for."""
DRAWS, DRAW = 3, 1000
"""Draws of starts until a minimum is settled; number of the random stream between draws."""
HORIZONS_WITHOUT_BALLS = (0.3, 0.5, 0.7)
"""Parts of recordings without balls that later draws fit first."""
AT_NOISE = 1.5
"""Mean square of the residuals, in units of the noise's, up to which a minimum is the right one."""
AGREE = 1.01
"""Ratio of the sums of squares of two ends up to which they are the same minimum."""
SEARCH_STEPS, LAST_STEPS = 12, 60
"""Iterations of a search, and of the last fit, at most."""
SOFT = 4.0
"""Residuals beyond this many standard deviations count less (Huber's loss)."""


class Fitted(NamedTuple):
    """Where a minimisation has ended."""

    values: np.ndarray
    """Of all parameters [SI]."""
    cost: float
    """Half the sum of squares, in units of noise; of a robust loss where one was asked for."""


def minimise(
    problem: Problem,
    values: np.ndarray,
    free: Sequence[int],
    steps: int,
    last: bool = False,
    seen: Seen = lambda *_: None,
) -> Fitted:
    """Least squares over some parameters, within their bounds.

    Args:
        problem: has the residuals.
        values: where to begin [SI].
        free: numbers of the parameters that vary.
        steps: iterations at most.
        last: whether outliers count less, and differences are taken to both sides.
        seen: called with each point; what it raises ends the work.
    """
    free = list(free)
    if not free:
        return Fitted(values.copy(), problem.cost(values))
    scales = problem.scales[free]
    low = np.array([problem.parameters[j].low for j in free]) / scales
    high = np.array([problem.parameters[j].high for j in free]) / scales

    def whole(scaled: np.ndarray) -> np.ndarray:
        found = values.copy()
        found[free] = scaled * scales
        return found

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
        f_scale=SOFT,
        max_nfev=steps,
        ftol=1e-10,
        xtol=1e-10,
        gtol=1e-10,
    )
    return Fitted(whole(result.x), float(result.cost))


class _Points:
    """What a minimisation asks at its points, of which the last two are remembered.

    Args:
        problem: has the residuals.
        whole: makes values of all parameters of those that vary, in units of scales.
        free, central: see ``Problem.both``.
        seen: called with each point.
    """

    def __init__(
        self, problem: Problem, whole: Function, free: Sequence[int], central: bool, seen: Seen
    ) -> None:
        self._problem, self._whole, self._free, self._seen = problem, whole, free, seen
        self._central = central
        self._at_once = problem.costs_no_more(free, central)
        self._known: dict[bytes, tuple[np.ndarray, np.ndarray | None]] = {}

    def residuals(self, scaled: np.ndarray) -> np.ndarray:
        """Of all that was measured."""
        return self._at(scaled, self._at_once)[0]

    def jacobian(self, scaled: np.ndarray) -> np.ndarray:
        """Their derivatives."""
        found = self._at(scaled, True)[1]
        assert found is not None
        return found

    def short(self, scaled: np.ndarray) -> np.ndarray:
        """The same sum of squares with as few numbers as there are parameters, and one more.

        An orthogonal transformation, of which the last axis lies along the residuals: thousands
        of numbers would be decomposed in each iteration otherwise.
        """
        return np.append(np.zeros(len(scaled)), math.sqrt(sum_of_squares(self.residuals(scaled))))

    def short_jacobian(self, scaled: np.ndarray) -> np.ndarray:
        """Derivatives, on these axes."""
        slopes, whole = self.jacobian(scaled), self.residuals(scaled)
        along = whole / max(math.sqrt(sum_of_squares(whole)), 1e-300)
        row = (along[:, None] * slopes).sum(axis=0)
        rest = triangle(slopes - np.outer(along, row))
        return np.vstack([rest, row])

    def _at(self, scaled: np.ndarray, both: bool) -> tuple[np.ndarray, np.ndarray | None]:
        key, values = scaled.tobytes(), self._whole(scaled)
        found = self._known.get(key)
        if found is None or (both and found[1] is None):
            found = (
                self._problem.both(values, self._free, self._central)
                if both
                else (self._problem.residuals(values), None)
            )
            self._known = {**dict(list(self._known.items())[-1:]), key: found}
            self._seen(values, 0.5 * sum_of_squares(found[0]))
        return found


class StagedFit:
    """Finds where to begin, and fits.

    Args:
        problem: all recordings.
        held: numbers of the parameters that stay at their start.
        seed: of the random starts.
        tell: see ``Tell``.
        workers: share the starts; whoever does them, they give the same to the bit.
    """

    def __init__(
        self, problem: Problem, held: Sequence[int], seed: int, tell: Tell, workers: Workers
    ) -> None:
        self.problem, self._held, self._tell = problem, set(held), tell
        self._seed, self._workers = seed, workers
        self.best = problem.start
        """Values of all parameters [SI], the best so far."""
        self._least = math.inf
        self.disagreements: list[str] = []
        """Recordings of which no two draws of starts have ended in the same minimum."""

    def run(self) -> Fitted:
        """All stages."""
        problem = self.problem
        numbers = range(len(problem.recordings))
        bare = [k for k in numbers if not problem.recordings[k].with_balls]
        others = [k for k in numbers if problem.recordings[k].with_balls]
        settled: set[int] = set()
        if bare:
            settled = self._without_balls(bare)
        for k in others:
            self._with_balls(k, settled)
            settled |= {j for j, each in enumerate(problem.parameters) if each.belongs_to(k)}
        free = [j for j in range(len(problem.parameters)) if j not in self._held]
        found = minimise(problem, self.best, free, LAST_STEPS, seen=self._keep)
        self.best = found.values
        return found

    def _keep(self, values: np.ndarray, cost: float) -> None:
        if cost < self._least:
            self.best, self._least = values, cost
        self._tell("all recordings", 0, 1)

    def _without_balls(self, bare: Sequence[int]) -> set[int]:
        """Fit what recordings without balls tell; which parameters these settle."""
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
            tried = [start, *self._drawn(part, start, drawn, SCAN, DRAW * draw)]
            costs = [part.cost(values) for values in tried]
            order = np.argsort(costs, kind="stable")[:4]
            chosen = [0, *(k for k in order if k != 0)] if draw == 0 else list(order)
            for done, k in enumerate(chosen):
                self._tell("recordings without balls", done, len(chosen))
                begin = tried[k]
                # A lightly damped deck has a wrong minimum for each turn that its phase is off at
                # the end of the recording, and few over the beginning.
                for share in HORIZONS_WITHOUT_BALLS if draw else ():
                    shorter = whole.part(bare, share)
                    begin = minimise(shorter, begin, felt, SEARCH_STEPS).values
                    whole.runs += shorter.runs
                ends.append(minimise(part, begin, felt, SEARCH_STEPS * 3))
            bests.append(min(ends, key=lambda each: each.cost))
            if _settled(part, bests):
                break
        else:
            self.disagreements.append("recordings without balls")
        best = min(bests, key=lambda each: each.cost)
        self.best[places] = best.values
        jacobian = part.derivatives(best.values, felt)
        whole.runs += part.runs
        known = deviations_of(jacobian) < SETTLED
        return {places[j] for j, good in zip(felt, known, strict=True) if good}

    def _with_balls(self, number: int, settled: set[int]) -> None:
        """Find a recording's start angles, and what of the balls is not known yet."""
        whole = self.problem
        alone = whole.part([number])
        places = _places(whole, alone)
        free = [
            j for j, place in enumerate(places)
            if place not in self._held and (place not in settled)
        ]  # fmt: skip
        begin, bests = self.best[places].copy(), list[Fitted]()
        for draw in range(DRAWS):
            tried = self._drawn(alone, begin, free, STARTS, number + 1 + DRAW * draw)
            for horizon, keep in HORIZONS:
                part = whole.part([number], horizon)
                what = f"start angles of {part.recordings[0].name}, first {100 * horizon:.0f} %"
                starts, found = tried[:keep], list[Fitted]()
                self._tell(what, 0, len(starts))
                for each, runs in self._workers.each(partial(_searched, part, free), starts, 1):
                    found.append(each)
                    whole.runs += runs
                    self._tell(what, len(found), len(starts))
                found.sort(key=lambda each: each.cost)
                tried = [each.values for each in _distinct(found)]
                if not bests:
                    self.best[places] = tried[0]
            bests.append(found[0])
            self.best[places] = min(bests, key=lambda each: each.cost).values
            if _settled(part, bests):
                return
        self.disagreements.append(part.recordings[0].name)

    def _drawn(
        self, part: Problem, start: np.ndarray, free: Sequence[int], count: int, stream: int
    ) -> list[np.ndarray]:
        """Starts spread evenly over what is free."""
        if not free:
            return [start.copy()] * count
        shares = qmc.LatinHypercube(len(free), rng=np.random.default_rng([self._seed, stream]))
        found = []
        for row in shares.random(count):
            values = start.copy()
            for j, share in zip(free, row.tolist(), strict=True):
                values[j] = _between(part, j, float(start[j]), share)
            found.append(values)
        return found


def _settled(part: Problem, bests: Sequence[Fitted]) -> bool:
    """Whether the best minimum leaves noise alone, or another draw of starts has found it, too."""
    costs = sorted(each.cost for each in bests)
    numbers = sum(measured.count for measured in part.recordings)
    if costs[0] <= AT_NOISE * 0.5 * numbers:
        return True
    return len(costs) > 1 and costs[1] <= AGREE * costs[0]


def _searched(part: Problem, free: Sequence[int], values: np.ndarray) -> tuple[Fitted, int]:
    """Where the search from a start ends, and how many runs it has made."""
    before = part.runs
    found = minimise(part, values, free, SEARCH_STEPS)
    return found, part.runs - before


def _between(part: Problem, j: int, now: float, share: float) -> float:
    """A start of a parameter, at a share of the way over where it is looked for."""
    each = part.parameters[j]
    if each.is_own_angle:
        return now + 2.0 * math.pi * share
    if each.recording is not None:
        return now
    low, high = each.low, each.high
    if now > 0.0:
        low, high = max(low, now / NEAR), min(high, now * NEAR)
        if low > 0.0:
            return low * (high / low) ** share
    return low + share * (high - low)


def _places(whole: Problem, part: Problem) -> list[int]:
    """Which parameters of the whole those of a part are."""
    return [whole.names.index(name) for name in part.names]


def _distinct(found: Sequence[Fitted]) -> list[Fitted]:
    """Without those that have ended where a better one has."""
    kept: list[Fitted] = []
    for each in found:
        if all(abs(each.cost - other.cost) > 1e-6 * max(other.cost, 1e-12) for other in kept):
            kept.append(each)
    return kept
