"""Results of runs for comparison: without balls, or without the variable-speed period."""

from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.metrics.declared import Metrics
from ab_sim.analysis.metrics.metric import Metric, reported_metrics


class Compared(NamedTuple):
    """Results of one run for comparison."""

    metrics: Metrics
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

    def relative_whirl(self, metrics: Metrics) -> float | None:
        """Return a run's final whirl relative to the run without balls; None if unavailable."""
        return self.relative(Metrics.final_whirl, metrics)

    def relative(self, metric: Metric[float], metrics: Metrics) -> float | None:
        """Return a metric relative to the run without balls; None if unavailable."""
        alone = self.without_balls
        if not isinstance(alone, Compared) or alone.metrics.of(metric) == 0:
            return None
        return metrics.of(metric) / alone.metrics.of(metric)

    def report(self, metrics: Metrics, eccentricity: float) -> dict[str, object]:
        """Return JSON-able values to add to the report of the run with ``metrics``."""
        runs: dict[str, Any] = {
            "without_variable_speed_period": self.without_period,
            "without_balls": self.without_balls,
        }
        for name, run in runs.items():
            if isinstance(run, Compared):
                runs[name] = {**run.metrics.report(eccentricity), **self._shares(run.metrics)}
            elif run is not None:
                runs[name] = {"failure": run}
        return {**self._shares(metrics), **runs}

    def _shares(self, metrics: Metrics) -> dict[str, float | None]:
        """Return the metrics relative to the run without balls, by key."""
        return {
            metric.relative.key: self.relative(metric, metrics)
            for metric in reported_metrics()
            if metric.relative is not None
        }
