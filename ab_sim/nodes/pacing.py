"""Number of steps and ticks that are due at a time, and statistics of durations.

The caller reads the clock of pacers and tickers. ROS is not needed.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ab_sim.base.errors import InputError

SHORTEST = 1e-6
"""Upper bound of the histogram's first class [s]; all shorter durations count in this class."""
_PER_DECADE = 40
"""Number of the histogram's classes per decade; a quantile is too long by at most 6 %."""
_DECADES = 9


class DurationHistogram:
    """Counts durations [s] in classes of equal ratio; the longest duration is exact."""

    def __init__(self) -> None:
        # A list, because its entries are incremented ten times as fast as those of an array.
        self._counts = [0] * (_PER_DECADE * _DECADES + 1)
        self.count = 0
        """Number of durations."""
        self.worst = 0.0
        """Longest duration [s]."""

    def add(self, duration: float) -> None:
        """Count a duration [s]."""
        ratio = max(duration, SHORTEST) / SHORTEST
        place = math.ceil(_PER_DECADE * math.log10(ratio) - 1e-9)
        self._counts[min(place, len(self._counts) - 1)] += 1
        self.count += 1
        self.worst = max(self.worst, duration)

    def quantile(self, share: float) -> float:
        """Return the quantile of the durations for a share from 0 to 1 [s]; 0 without durations."""
        if not self.count:
            return 0.0
        place = int(np.searchsorted(np.cumsum(self._counts), math.ceil(share * self.count)))
        if place == len(self._counts) - 1:
            return self.worst
        return min(SHORTEST * 10.0 ** (place / _PER_DECADE), self.worst)

    def values(self, what: str) -> dict[str, str]:
        """Return quantiles and maximum for the diagnostics; ``what`` begins their names."""
        if not self.count:
            return {}
        shares = {"p50": 0.5, "p99": 0.99, "p99.9": 0.999}
        figures = {name: self.quantile(share) for name, share in shares.items()}
        return {
            f"{what}, {name} [s]": f"{figure:.6f}"
            for name, figure in {**figures, "worst": self.worst}.items()
        }


class StageTimer:
    """Measures the durations of the stages of a wake-up.

    Parameters
    ----------
    names
        Names of the stages.
    clock
        Function that returns the time [ns].
    """

    def __init__(self, *names: str, clock: Callable[[], int] = time.perf_counter_ns) -> None:
        self._names, self._clock = names, clock
        self._mark = 0
        self._clear()

    def begin(self) -> None:
        """Start to measure the next stage now."""
        self._mark = self._clock()

    def end(self, name: str) -> None:
        """End a stage and start the next one."""
        now = self._clock()
        self._counts[name] += 1
        self._totals[name] += now - self._mark
        self._longest[name] = max(self._longest[name], now - self._mark)
        self._mark = now

    def values(self) -> dict[str, str]:
        """Return mean and longest duration of each stage since the last call."""
        values = {}
        for name in self._names:
            mean = 1e-9 * self._totals[name] / max(self._counts[name], 1)
            values[f"{name}, mean [s]"] = f"{mean:.7f}"
            values[f"{name}, longest [s]"] = f"{1e-9 * self._longest[name]:.7f}"
        self._clear()
        return values

    def _clear(self) -> None:
        self._counts = dict.fromkeys(self._names, 0)
        self._totals = dict.fromkeys(self._names, 0)
        self._longest = dict.fromkeys(self._names, 0)


_WARM_UP = 25
"""Number of wake-ups after each start that are not counted in the distribution of the lateness.
Dropped steps and the worst lateness count from the first wake-up on."""
STILL = 0.1
"""Longest time without a tick before a warning [s]."""


@dataclass
class Pacing:
    """Statistics of wake-ups."""

    overruns: int = 0
    """Number of wake-ups that were late by a period or more."""
    dropped: int = 0
    """Number of steps dropped because the simulation lagged too far behind."""
    worst_lateness: float = 0.0
    """Largest lateness of a wake-up [s]."""

    def count(self, dropped: int, lateness: float, overrun: bool) -> None:
        """Add a wake-up: its dropped steps, lateness [s], and whether it was an overrun."""
        self.dropped += dropped
        self.worst_lateness = max(self.worst_lateness, lateness)
        self.overruns += overrun


class Pacer:
    """Keeps simulated time in pace with the steady clock.

    Steps become due ``factor`` times as fast as the clock advances. After a late wake-up, more
    steps are due; they are caught up, at most ``budget`` at one wake-up. If the simulation lags by
    more than ``patience``, the excess steps are dropped and counted, and pacing continues from the
    present time.

    Parameters
    ----------
    step
        Integration step [s].
    steps_per_wake
        Steps of a wake-up that is on time, at factor 1.
    budget
        Largest number of steps at one wake-up at factors up to 1; multiplied by larger factors.
    patience
        Largest lag before steps are dropped [s], by the clock.

    Raises
    ------
    InputError
        The budget is less than one wake-up's steps, or patience less than a period.
    """

    def __init__(self, step: float, steps_per_wake: int, budget: int, patience: float) -> None:
        self.period = step * steps_per_wake
        if budget < steps_per_wake:
            raise InputError(f"budget = {budget} steps: must be at least {steps_per_wake}")
        if patience < self.period:
            raise InputError(f"patience = {patience} s: must be at least {self.period} s")
        self._step = step
        self._per_wake = steps_per_wake
        self._budget = budget
        self._patience = patience
        self._factor = 1.0
        self.lateness = DurationHistogram()
        """Lateness of wake-ups [s], without the first ``_WARM_UP`` ones after each start."""
        self.total = Pacing()
        self._recent = Pacing()
        self._origin = 0.0
        self._begun = 0.0
        """Fraction of a step that had elapsed when time last stopped; pauses thus lose no time."""
        self._taken = 0
        self._wakes = 1

    @property
    def _deadline(self) -> float:
        """Time of the next wake-up [s]."""
        return self._origin + self._wakes * self.period

    @property
    def factor(self) -> float:
        """Ratio of simulated time to clock time."""
        return self._factor

    def start(self, now: float, factor: float | None = None) -> None:
        """Start, or restart after a stop: no step is due at ``now``.

        Parameters
        ----------
        now
            Present time [s].
        factor
            New ratio of simulated time to clock time; default: unchanged.
        """
        self._factor = self._factor if factor is None else factor
        self._origin, self._taken = now, 0
        self._wakes = 1

    def wait(self, now: float) -> float:
        """Return the time to sleep until the next wake-up [s]."""
        return max(self._deadline - now, 0.0)

    def due(self, now: float) -> int:
        """Return the number of steps to take at this wake-up, and plan the next one."""
        lateness = max(now - self._deadline, 0.0)
        self._count(0, lateness, lateness >= self.period)
        if self._wakes > _WARM_UP:
            self.lateness.add(lateness)
        # Deadlines stay on their grid. Passed deadlines are skipped, but their steps are not.
        self._wakes += math.floor(lateness / self.period) + 1
        due = self._untaken(now)
        usual = max(round(self._per_wake * self._factor), 1)
        behind = due - usual
        if behind * self._step > self._patience * self._factor:
            self._drop(behind)
            due = usual
        return self._take(due)

    def early(self, now: float) -> int:
        """Return the number of steps that are due now, between two wake-ups."""
        return self._take(self._untaken(now))

    def stop(self, now: float) -> int:
        """Return the number of steps to take before a pause; further due steps are dropped."""
        due = self.due(now)
        self._drop(max(self._untaken(now), 0))
        self._begun = min(max(self._over(now) - self._taken, 0.0), 1.0)
        return due

    def continue_counts(self, before: "Pacer") -> None:
        """Continue the counts of the previous pacer, because counts last until cleanup."""
        self.total, self.lateness = before.total, before.lateness

    def recent(self) -> Pacing:
        """Return the statistics since the last call; ``total`` counts from the beginning."""
        recent, self._recent = self._recent, Pacing()
        return recent

    def _over(self, now: float) -> float:
        """Return the number of steps that have become due since the start."""
        return (now - self._origin) * self._factor / self._step + self._begun

    def _untaken(self, now: float) -> int:
        """Return the number of whole steps that are due and not yet taken."""
        # The small addition lets all steps be due at a wake-up that is exactly on time.
        return math.floor(self._over(now) + 1e-6) - self._taken

    def _take(self, due: int) -> int:
        """Return the number of steps to take now, ``due`` but within the budget, and count it."""
        due = max(min(due, round(self._budget * max(self._factor, 1.0))), 0)
        self._taken += due
        return due

    def _drop(self, steps: int) -> None:
        """Count steps as taken that never will be."""
        self._taken += steps
        self._count(steps)

    def _count(self, dropped: int, lateness: float = 0.0, overrun: bool = False) -> None:
        self.total.count(dropped, lateness, overrun)
        self._recent.count(dropped, lateness, overrun)


class Ticker:
    """Source of periodic ticks on a fixed grid of times; several overdue ticks count as one.

    Parameters
    ----------
    period
        Time between two ticks [s].
    now
        Present time [s].
    """

    def __init__(self, period: float, now: float) -> None:
        self.period = period
        self.lost = 0
        """Number of ticks that were replaced by a later one."""
        self._origin, self._next, self._last, self._gap = now, 1, now, 0.0

    def wait(self, now: float) -> float:
        """Return the time until the next tick [s]."""
        return max(self._origin + self._next * self.period - now, 0.0)

    def due(self, now: float) -> bool:
        """Return whether a tick is due now, and if so plan the next tick."""
        passed = math.floor((now - self._origin) / self.period + 1e-9)
        if passed < self._next:
            return False
        self.lost += passed - self._next
        self._next = passed + 1
        self._gap, self._last = max(self._gap, now - self._last), now
        return True

    def warning(self) -> str:
        """Return a warning of a long time without ticks since the last call; empty if none."""
        gap, self._gap = self._gap, 0.0
        if gap <= max(STILL, 2.0 * self.period):
            return ""
        return f"no tick for {gap:.3g} s: this process was not able to run"
