"""Derivatives of a run's metrics by values of its scene."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ab_sim.analysis.metrics.metric import Metric, MetricKind, metrics_named
from ab_sim.base.errors import InputError
from ab_sim.base.presentation import Column, Columns, Presented
from ab_sim.design.batch.judging import judged_parts
from ab_sim.design.batch.prepared_run import steps_of
from ab_sim.design.derivatives.differences import differentiated, prepared_runs, with_stepper
from ab_sim.design.derivatives.keys import RealKey, checked_keys, scale_of
from ab_sim.drive import Drive
from ab_sim.scene.load import SceneLike, as_scene
from ab_sim.scene.model import Scene

NOTHING = 1e-10
"""Relative change of a metric, for a change of the key by ``scale_of``, that is no influence."""
STILL = 1e-6
"""Uncertainty of this relative change up to which a derivative of 0 means no influence."""
UNCERTAIN = 0.01
"""Uncertainty of this relative change above which a derivative below its uncertainty is NaN."""


@dataclass(frozen=True, repr=False)
class MetricSensitivities(Presented):
    """Derivatives of metrics by values of a scene; see ``ab_sim.metric_sensitivities``."""

    _picture = "metric_sensitivities"

    scene: Scene
    metrics: tuple[str, ...]
    """Names of the metrics."""
    metric_units: tuple[str, ...]
    """Units of the metrics as in reports: e, mm/s, otherwise SI."""
    metric_values: np.ndarray
    """Values of the metrics, shape (metrics,)."""
    keys: tuple[str, ...]
    """Keys of the scene."""
    key_units: tuple[str, ...]
    """Units of the keys, SI."""
    values: np.ndarray
    """Values of the keys, shape (keys,)."""
    derivatives: np.ndarray
    """d metric / d key, shape (metrics, keys); NaN where the metric is not differentiable."""
    uncertainties: np.ndarray
    """Uncertainties of the derivatives, shape (metrics, keys)."""

    @property
    def elasticities(self) -> np.ndarray:
        """Elasticity [percent of the metric per percent of the key]; NaN where the metric is 0."""
        return self.derivatives * self._percents

    @property
    def elasticity_uncertainties(self) -> np.ndarray:
        """Uncertainties of the elasticities, shape (metrics, keys)."""
        return self.uncertainties * np.abs(self._percents)

    @property
    def has_no_influence(self) -> np.ndarray:
        """Flags of derivatives that are 0 or rounding, shape (metrics, keys)."""
        keys = zip(self.keys, self.values.tolist(), self.key_units, strict=True)
        scales = np.array([scale_of(RealKey(*key)) for key in keys])
        size, metrics = np.abs(self.derivatives), np.abs(self.metric_values[:, None])
        still = (size <= self.uncertainties) & (self.uncertainties * scales <= STILL * metrics)
        without_influence: np.ndarray = still | (size * scales <= NOTHING * metrics)
        return without_influence

    @property
    def _percents(self) -> np.ndarray:
        """Factors from derivatives to elasticities, shape (metrics, keys)."""
        metrics = np.where(self.metric_values == 0.0, np.nan, self.metric_values)
        percents: np.ndarray = self.values / metrics[:, None]
        return percents

    def unit(self, metric: int, key: int) -> str:
        """Return the unit of a derivative.

        Args:
            metric, key: indices of the metric and the key.
        """
        below = self.key_units[key]
        below = f"({below})" if "/" in below or " " in below else below
        return self.metric_units[metric] if below == "1" else f"{self.metric_units[metric]}/{below}"

    def report(self) -> dict[str, object]:
        """Return JSON-able values in SI units, metrics in the units of reports."""
        return {
            "scene": self.scene.name,
            "metrics": {
                name: {
                    "value": float(self.metric_values[i]),
                    "unit": self.metric_units[i],
                    "by": {
                        key: {
                            "value": float(self.values[k]),
                            "unit": self.key_units[k],
                            "derivative": _number(self.derivatives[i, k]),
                            "uncertainty": _number(self.uncertainties[i, k]),
                            "elasticity": _number(self.elasticities[i, k]),
                        }
                        for k, key in enumerate(self.keys)
                    },
                }
                for i, name in enumerate(self.metrics)
            },
        }

    def _facts(self) -> dict[str, str]:
        return {
            "scene": self.scene.name,
            "metrics": ", ".join(self.metrics),
            "keys": str(len(self.keys)),
        }

    def _columns(self) -> Columns:
        columns = {"key": Column(None, list(self.keys)), "value": Column(None, self.values)}
        for i, metric in enumerate(self.metrics):
            unit = f"{self.metric_units[i]} per unit of the key"
            columns[f"d {metric}"] = Column(unit, self.derivatives[i])
            columns[f"uncertainty of d {metric}"] = Column(unit, self.uncertainties[i])
            columns[f"elasticity of {metric}"] = Column("1", self.elasticities[i])
        return columns


def metric_sensitivities(
    scene: SceneLike,
    keys: Sequence[str],
    metrics: Sequence[str],
    *,
    progress: Callable[[int, int], None] | None = None,
) -> MetricSensitivities:
    """Differentiate metrics of a scene's run by values of the scene.

    Derivatives are differences of whole runs, side by side, with their uncertainty.

    Parameters
    ----------
    scene : Scene, str or Path
        Scene to run, with its own stepper.
    keys : sequence of str
        Dotted keys of real numbers in the sections rotor, deck, mounts, race, balls, effects, start
        and profile; entries of lists counted from 0: ``balls.mass``, ``balls.mass.0``,
        ``effects.suspension.stiffness``, ``start.ball_angles.1``.
    metrics : sequence of str
        Names of metrics that are numbers: `ab-sim metrics` lists them.
    progress : callable, optional
        Called with the numbers of finished and of all runs, for each batch of runs.

    Returns
    -------
    MetricSensitivities
        ``derivatives`` and their ``uncertainties``, shape (metrics, keys), NaN where a metric is
        not differentiable; ``elasticities``, percent per percent.

    Raises
    ------
    InputError
        There is no such key or metric; a key is not a real number; a metric has no value in this
        run, or is the time of a sample.
    SceneError
        The scene is not valid, or cannot be run with its solver.
    DivergedError
        The state went beyond all bounds.

    Notes
    -----
    Source: Moré and Wild (2011), SIAM J. Sci. Comput. 33, 1292, for the step; Richardson (1911),
    Phil. Trans. R. Soc. A 210, 307.

    Examples
    --------
    >>> import ab_sim
    >>> scene = ab_sim.load_scene("balanced-start-up")
    >>> found = ab_sim.metric_sensitivities(scene, ["balls.mass"], ["final_whirl_over_e"])
    >>> found.derivatives.shape
    (1, 1)
    >>> bool((found.elasticity_uncertainties < 1e-6).all())
    True
    """
    scene = as_scene(scene)
    wanted, real = differentiable_metrics(metrics), checked_keys(scene, keys)
    names = [metric.key for metric in wanted]
    scene = with_stepper(scene)

    def results(scenes: Sequence[Scene]) -> np.ndarray:
        results, done = np.full((len(scenes), len(names), 1), np.nan), 0
        for part in judged_parts(None, prepared_runs(scenes), names):
            for row, name in enumerate(names):
                results[part.runs, row, 0] = np.array(part.metrics[name], float)
            done += len(part.runs)
            if progress is not None:
                progress(done, len(scenes))
        return results

    (here,) = results([scene])
    values = here[:, 0]
    for name, value in zip(names, values, strict=True):
        if np.isnan(value):
            Drive(scene).advance(steps_of(scene))  # raises, if the run diverges
            raise InputError(
                f"metric {name!r}: has no value in this run, and no derivative "
                f"(`ab-sim metrics {name}` explains when)"
            )
    derivatives, uncertainties = (
        derivatives[..., 0] for derivatives in differentiated(scene, real, here, results)
    )
    unknown = _is_uncertain(real, values, derivatives, uncertainties)
    return MetricSensitivities(
        scene,
        tuple(names),
        tuple(metric.unit for metric in wanted),
        values,
        tuple(keys),
        tuple(key.unit for key in real),
        np.array([key.value for key in real]),
        np.where(unknown, np.nan, derivatives),
        uncertainties,
    )


def _is_uncertain(
    keys: Sequence[RealKey], values: np.ndarray, derivatives: np.ndarray, uncertainties: np.ndarray
) -> np.ndarray:
    """Return a mask of derivatives without meaning due to uncertainty, shape (metrics, keys)."""
    moves = uncertainties * [scale_of(key) for key in keys]
    large = moves > UNCERTAIN * np.abs(values[:, None])
    uncertain: np.ndarray = ~(uncertainties < np.abs(derivatives)) & large
    return uncertain


def differentiable_metrics(names: Sequence[str]) -> list[Metric[Any]]:
    """Return the metrics with these names.

    Raises:
        InputError: there is no such metric, it is not a number, or it jumps between samples.
    """
    metrics = metrics_named(names)
    for metric in metrics:
        if metric.kind is not MetricKind.NUMBER:
            raise InputError(f"metric {metric.key!r}: is not a number, and has no derivative")
        if metric.stepwise:
            raise InputError(
                f"metric {metric.key!r}: is the time of a sample, jumps from one to the next, and "
                "has no derivative"
            )
    return metrics


def _number(x: float) -> float | None:
    return float(x) if np.isfinite(x) else None
