"""Number of steps and ticks that are due at a time; no ROS, and the caller reads the clock."""

import math
from dataclasses import dataclass

from ab_sim.base.errors import InputError
from ab_sim.nodes.durations import DurationHistogram

WARM_UP = 25
"""Number of wake-ups after each start that are not counted in the distribution of the lateness.
Dropped steps and the worst lateness count from the first wake-up on."""
STILL = 0.1
"""Time without a tick beyond which there is a warning [s]."""


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

    Args:
        step: integration step [s].
        steps_per_wake: steps of a wake-up that is on time, at factor 1.
        budget: largest number of steps at one wake-up at factors up to 1; multiplied by larger
            factors.
        patience: largest lag before steps are dropped [s], by the clock.

    Raises:
        InputError: the budget is less than one wake-up's steps, or patience less than a period.
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
        """Lateness of wake-ups [s], without the first ``WARM_UP`` ones after each start."""
        self.total = Pacing()
        self._recent = Pacing()
        self._origin = 0.0
        self._begun = 0.0
        """Elapsed fraction of a step when time was last stopped, so that pauses lose no time."""
        self._taken = 0
        self._wakes = 1

    @property
    def _deadline(self) -> float:
        return self._origin + self._wakes * self.period

    @property
    def factor(self) -> float:
        """Ratio of simulated time to clock time."""
        return self._factor

    def start(self, now: float, factor: float | None = None) -> None:
        """Start, or restart after a stop: no step is due at ``now``.

        Args:
            now: present time [s].
            factor: new ratio of simulated time to clock time; default: unchanged.
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
        if self._wakes > WARM_UP:
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
        """Take over the counts of another pacer, so that they last from configure to cleanup."""
        self.total, self.lateness = before.total, before.lateness

    def recent(self) -> Pacing:
        """Return the statistics since the last call; ``total`` counts from the beginning."""
        recent, self._recent = self._recent, Pacing()
        return recent

    def _over(self, now: float) -> float:
        return (now - self._origin) * self._factor / self._step + self._begun

    def _untaken(self, now: float) -> int:
        # The small addition lets all steps be due at a wake-up that is exactly on time.
        return math.floor(self._over(now) + 1e-6) - self._taken

    def _take(self, due: int) -> int:
        due = max(min(due, round(self._budget * max(self._factor, 1.0))), 0)
        self._taken += due
        return due

    def _drop(self, steps: int) -> None:
        self._taken += steps
        self._count(steps)

    def _count(self, dropped: int, lateness: float = 0.0, overrun: bool = False) -> None:
        self.total.count(dropped, lateness, overrun)
        self._recent.count(dropped, lateness, overrun)


class Ticker:
    """Source of periodic ticks on a fixed grid of times; several overdue ticks count as one.

    Args:
        period: time between two ticks [s].
        now: present time [s].
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
        """Return whether a tick is due now, and if so advance to the next one."""
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
