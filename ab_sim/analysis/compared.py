"""Results of the runs with which a run is compared."""

from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.merits.declared import Merits
from ab_sim.analysis.merits.merit import Merit, reported_merits


class Compared(NamedTuple):
    """Run for comparison."""

    merits: Merits
    time: np.ndarray
    """Times [s], shape (samples,)."""
    whirl: np.ndarray
    """Whirl [m], shape (samples,)."""
    speed: np.ndarray
    """Spindle speed [rad/s], shape (samples,)."""


class Comparison(NamedTuple):
    """Runs for comparison; each is None if the scene has nothing to leave out."""

    without_period: Compared | str | None
    """Run without the variable-speed period, or the error message if it failed."""
    without_balls: Compared | str | None
    """Run without balls, or the error message if it failed.

    The balls and their mass are removed. The suspended mass is M - sum m_i, and the unbalance M0 e
    remains.
    """

    def by_name(self) -> dict[str, Compared | str]:
        """Return the available runs by their display names."""
        named = {
            "without variable-speed period": self.without_period,
            "without balls": self.without_balls,
        }
        return {name: run for name, run in named.items() if run is not None}

    def relative_whirl(self, merits: Merits) -> float | None:
        """Return a run's final whirl relative to the run without balls; None if unavailable."""
        return self.relative(Merits.final_whirl, merits)

    def relative(self, merit: Merit[float], merits: Merits) -> float | None:
        """Return a metric relative to the run without balls; None if unavailable."""
        alone = self.without_balls
        if not isinstance(alone, Compared) or alone.merits.of(merit) == 0:
            return None
        return merits.of(merit) / alone.merits.of(merit)

    def report(self, merits: Merits, eccentricity: float) -> dict[str, object]:
        """Return JSON-able values, to be added to those of the run with ``merits``."""
        runs: dict[str, Any] = {
            "without_variable_speed_period": self.without_period,
            "without_balls": self.without_balls,
        }
        for name, run in runs.items():
            if isinstance(run, Compared):
                runs[name] = {**run.merits.report(eccentricity), **self._shares(run.merits)}
            elif run is not None:
                runs[name] = {"failure": run}
        return {**self._shares(merits), **runs}

    def _shares(self, merits: Merits) -> dict[str, float | None]:
        """Return the metrics relative to the run without balls, by key."""
        return {
            merit.relative.key: self.relative(merit, merits)
            for merit in reported_merits()
            if merit.relative is not None
        }
