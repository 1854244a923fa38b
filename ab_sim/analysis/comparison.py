"""Runs for comparison: scenes without balls or without the variable-speed period, and results."""

from typing import Any, NamedTuple

import numpy as np

from ab_sim.analysis.metrics.declared import Metrics
from ab_sim.analysis.metrics.metric import Metric, reported_metrics
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene


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
    """Runs without a part of the scene; each is None if the scene does not have this part."""

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
        """Return the compared runs' metrics, and ``metrics`` relative to those without balls."""
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


def without_period(scene: Scene) -> Scene:
    """Return the scene with constant acceleration, without its variable-speed period."""
    what = "without variable-speed period"
    changes = {"name": f"{scene.name}, {what}", "profile.variable_speed_period": None}
    return changed_scene(scene, changes, what)


def without_balls(scene: Scene) -> Scene:
    """Return the scene without balls and their mass; the unbalance M0 e remains.

    An adaptive start-up is replaced by its plan, because its controller would wait for balls to
    move.
    """
    what = "without balls"
    changes = {
        "name": f"{scene.name}, {what}",
        "balls": {"count": 0},
        "start.ball_angles": [],
        "start.ball_rates": [],
        "rotor.mass": scene.total_mass - scene.balls.total_mass,
        "rotor.eccentric_mass": scene.eccentric_mass,
    }
    if scene.rotor.total_mass is not None:
        changes["rotor.total_mass"] = None
    return changed_scene(scene.planned, changes, what)
