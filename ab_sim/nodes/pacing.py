"""How many integration steps are due by the steady clock; no ROS, and no clock of its own."""

import math
from dataclasses import dataclass

from ab_sim.errors import InputError
from ab_sim.nodes.duration_histogram import DurationHistogram

WARM_UP = 25
"""Wake-ups after each start that say nothing of the usual lateness yet. What is lost counts from
the first."""


@dataclass
class Pacing:
    """How well pace has been kept."""

    overruns: int = 0
    """Wake-ups that came a whole period or more too late."""
    dropped: int = 0
    """Steps given up because the simulation had fallen too far behind."""
    worst_lateness: float = 0.0
    """Longest time by which a wake-up was late [s]."""

    def count(self, dropped: int, lateness: float, overrun: bool) -> None:
        """Add what has happened at a wake-up."""
        self.dropped += dropped
        self.worst_lateness = max(self.worst_lateness, lateness)
        self.overruns += overrun


class Pacer:
    """Keeps simulated time level with the steady clock.

    Steps become due as the clock goes on, ``factor`` times as fast as it does. A late wake-up finds
    more of them due; they are caught up with, at most ``budget`` of them at one wake-up. If the
    simulation has fallen more than ``patience`` behind, it does not chase: the steps in excess are
    dropped and counted, and the clock is taken as it is.

    Args:
        step: integration step [s].
        steps_per_wake: steps that one wake-up takes when it is on time, at factor 1.
        budget: most steps at one wake-up, at factors up to 1; above, so many times as many.
        patience: how late the simulation may be before steps are dropped [s], by the clock.

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
        """Of wake-ups [s], but for the first ones after each start."""
        self.total = Pacing()
        self._recent = Pacing()
        self._origin = 0.0
        self._begun = 0.0
        """How much of a step was over when time was last stopped: no pause loses it."""
        self._taken = 0
        self._wakes = 1

    @property
    def _deadline(self) -> float:
        return self._origin + self._wakes * self.period

    @property
    def factor(self) -> float:
        """How fast simulated time goes, by the clock."""
        return self._factor

    def start(self, now: float, factor: float | None = None) -> None:
        """Begin, or begin again where it was stopped: nothing is due at ``now``.

        Args:
            now: s.
            factor: how fast simulated time goes from now on; default: as before.
        """
        self._factor = self._factor if factor is None else factor
        self._origin, self._taken = now, 0
        self._wakes = 1

    def wait(self, now: float) -> float:
        """How long to sleep until the next wake-up [s]."""
        return max(self._deadline - now, 0.0)

    def due(self, now: float) -> int:
        """Steps to take at this wake-up; the next one is planned."""
        lateness = max(now - self._deadline, 0.0)
        self._count(0, lateness, lateness >= self.period)
        if self._wakes > WARM_UP:
            self.lateness.add(lateness)
        # Deadlines stay on their grid; those that have passed are skipped, their steps are not.
        self._wakes += math.floor(lateness / self.period) + 1
        due = self._untaken(now)
        usual = max(round(self._per_wake * self._factor), 1)
        behind = due - usual
        if behind * self._step > self._patience * self._factor:
            self._drop(behind)
            due = usual
        return self._take(due)

    def early(self, now: float) -> int:
        """Steps that are due between two wake-ups, for what is to happen just now."""
        return self._take(self._untaken(now))

    def stop(self, now: float) -> int:
        """Steps to take at this last wake-up before a pause; those still due then are dropped."""
        due = self.due(now)
        self._drop(max(self._untaken(now), 0))
        self._begun = min(max(self._over(now) - self._taken, 0.0), 1.0)
        return due

    def continue_counts(self, before: "Pacer") -> None:
        """Go on with another's counts: they are since the scene was configured."""
        self.total, self.lateness = before.total, before.lateness

    def recent(self) -> Pacing:
        """What has happened since the last call; ``total`` is since the beginning."""
        recent, self._recent = self._recent, Pacing()
        return recent

    def _over(self, now: float) -> float:
        return (now - self._origin) * self._factor / self._step + self._begun

    def _untaken(self, now: float) -> int:
        # Rounded up by a hair: a wake-up exactly on time has all its steps due.
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
