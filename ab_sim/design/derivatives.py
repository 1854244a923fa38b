"""Derivatives of a run's channels and metrics by values of its scene."""

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ab_sim.analysis.metrics.metric import Metric, MetricKind, metrics_named
from ab_sim.base.errors import InputError, exact, nearest
from ab_sim.base.presentation import Column, Columns, CountProgress, Presented, ends
from ab_sim.base.sample_columns import ANGLE
from ab_sim.design.batch.judging import judged_parts
from ab_sim.design.batch.prepared_run import steps_of
from ab_sim.design.batch.run_prepared import run_prepared
from ab_sim.design.differences import (
    RealKey,
    checked_keys,
    differentiated,
    prepared_runs,
    scale_of,
    with_stepper,
)
from ab_sim.drive import Drive
from ab_sim.drive.trajectory import Trajectory, check_room, column_of, unit_of
from ab_sim.scene.load import SceneLike, as_scene
from ab_sim.scene.model import Scene

_RUNS_PER_KEY = 4
"""Number of runs with a moved key: up and down, by h and by h / 2."""


@dataclass(frozen=True, repr=False)
class Sensitivities(Presented):
    """Derivatives of a run's channels by values of its scene; see ``ab_sim.sensitivities``."""

    _rows = 0

    scene: Scene
    """Scene as it was run."""
    trajectory: Trajectory
    """Run of the scene: every integration step, the start included."""
    keys: tuple[str, ...]
    """Keys of the scene."""
    values: np.ndarray
    """Values of the keys, shape (keys,)."""
    key_units: tuple[str, ...]
    """Units of the keys, SI."""
    channels: tuple[str, ...]
    """Channels of the trajectory."""
    steps: np.ndarray
    """Numbers of the samples, shape (samples,)."""
    derivatives: np.ndarray
    """d channel / d key at each sample, SI, shape (channels, keys, samples)."""
    uncertainties: np.ndarray
    """Uncertainties of the derivatives, same shape."""

    @property
    def times(self) -> np.ndarray:
        """Times of the samples [s]."""
        return np.asarray(self.trajectory["time"][self.steps])

    def of(self, channel: str, key: str) -> np.ndarray:
        """Return d channel / d key, shape (samples,).

        Raises
        ------
        InputError
            The channel or the key is unknown; the message lists the known ones.
        """
        if channel not in self.channels:
            raise _not_among("channel", channel, self.channels)
        if key not in self.keys:
            raise _not_among("key", key, self.keys)
        derivative: np.ndarray = self.derivatives[
            self.channels.index(channel), self.keys.index(key)
        ]
        return derivative

    def _facts(self) -> dict[str, str]:
        return {
            "scene": self.scene.name,
            "keys": ", ".join(self.keys),
            "channels": str(len(self.channels)),
            "samples": str(len(self.steps)),
            "time": ends(self.times[0], self.times[-1], "s"),
        }

    def _columns(self) -> Columns:
        columns = {"time": Column("s", self.times)}
        for i, channel in enumerate(self.channels):
            for k, key in enumerate(self.keys):
                unit = f"({unit_of(channel)})/({self.key_units[k]})"
                name = f"{channel} by {key}"
                columns[name] = Column(unit, self.derivatives[i, k])
                columns[f"uncertainty of {name}"] = Column(unit, self.uncertainties[i, k])
        return columns


def sensitivities(
    scene: SceneLike,
    keys: Sequence[str],
    *,
    channels: Sequence[str] | None = None,
    times: Sequence[float] | np.ndarray | None = None,
    progress: CountProgress | None = None,
) -> Sensitivities:
    """Differentiate channels of a scene's run by values of the scene.

    Derivatives are differences of whole runs, side by side, with their uncertainty.

    Parameters
    ----------
    scene, keys
        See ``metric_sensitivities``.
    channels : sequence of str, optional
        Channels of the trajectory; default: all except ``step``, ``time`` and the sensors'.
    times : sequence of float, optional
        Times [s], increasing and on steps. The run lasts to the last of them. Default: all steps
        until ``scene.duration``.
    progress : callable, optional
        Called with the numbers of finished and of all runs, for each batch of runs.

    Returns
    -------
    Sensitivities
        ``derivatives`` and their ``uncertainties``, shape (channels, keys, samples), SI;
        ``trajectory``, the run with every step; ``times``, ``keys``, ``values``, ``channels``;
        ``of(channel, key)`` returns one derivative.

    Raises
    ------
    InputError
        A key or channel does not exist, a key is not a real number, or a time is not on a step.
    SceneError
        The scene is not valid, or cannot be run with its solver.
    DivergedError
        The state went beyond all bounds.

    Examples
    --------
    >>> import ab_sim
    >>> scene = ab_sim.load_scene("thesis-hold", ["duration=0.1"])
    >>> found = ab_sim.sensitivities(scene, ["balls.mass", "rotor.eccentricity"])
    >>> found.derivatives.shape
    (13, 2, 101)
    >>> found.of("x", "rotor.eccentricity").shape
    (101,)
    """
    scene = as_scene(scene)
    real = checked_keys(scene, keys)
    # An automatic choice could differ between moved scenes, which would add a jump to differences.
    scene = with_stepper(scene)
    drive = Drive(scene)
    named = _named(scene, drive.channels, channels)
    wanted, steps = _wanted(drive, times)
    try:
        check_room((steps + 1) * (_RUNS_PER_KEY * len(keys) + 1), 1, drive.channels)
    except ValueError:
        raise InputError(
            f"{steps} steps are too many to keep for derivatives by {len(keys)} keys: end the run "
            "earlier (duration, times), or request fewer keys"
        ) from None
    run = Trajectory.join([drive.present(), drive.advance(steps)])
    columns = [column_of(name, drive.channels) for name in named]
    here = run.samples[wanted][:, columns].T
    angles = [name == "angle" or name.endswith("_angle") for name in named]
    # Take at least one step, because a scene's duration must be above 0.
    shorter = scene.model_copy(update={"duration": max(steps, 1) * drive.step})

    def results(scenes: Sequence[Scene]) -> np.ndarray:
        prepared = prepared_runs(scenes)
        done = run_prepared(list(prepared.values()), 1, progress)
        results = np.full((len(scenes), *here.shape), np.nan)
        for number, run in zip(prepared, done.runs, strict=True):
            if not run.failure:
                start = Drive(run.scene).present().samples
                samples = np.vstack([start, run.trajectory.samples])
                results[number] = samples[wanted][:, columns].T
        # A start angle moved across pi is wrapped to -pi: undo whole turns in all its samples.
        turns = np.round((results[:, angles, :1] - here[angles, :1]) / (2.0 * math.pi))
        results[:, angles] -= 2.0 * math.pi * turns
        return results

    estimate = differentiated(shorter, real, here, results)
    return Sensitivities(
        scene,
        run,
        tuple(keys),
        np.array([value.value for value in real]),
        tuple(value.unit for value in real),
        tuple(named),
        np.array(wanted),
        estimate.derivatives,
        estimate.uncertainties,
    )


def _named(scene: Scene, all_channels: Sequence[str], channels: Sequence[str] | None) -> list[str]:
    """Return the requested channels after a check; for None all except the sensors' and times.

    Raises
    ------
    InputError
        A channel does not exist; the message lists the known ones.
    """
    if channels is None:
        axes = 2 if scene.deck is None else 3
        return list(all_channels[ANGLE : len(all_channels) - axes * len(scene.pickups)])
    for name in channels:
        if name not in all_channels[ANGLE:]:
            raise _not_among("channel", name, all_channels[ANGLE:])
    return list(channels)


def _wanted(drive: Drive, times: Sequence[float] | np.ndarray | None) -> tuple[Sequence[int], int]:
    """Return the indices of the samples at requested times [s], and the number of steps to run.

    Raises
    ------
    InputError
        A time is not on a step, or times do not rise.
    """
    if times is None:
        steps = math.ceil(drive.scene.duration / drive.step - 1e-9)
        return range(steps + 1), steps
    indices = []
    for time in times:
        number = round(time / drive.step) if abs(time) <= sys.float_info.max else -1
        if number < 0 or abs(number * drive.step - time) > 1e-6 * drive.step:
            raise InputError(
                f"times: {exact(time)} s: must be a whole number of steps of {drive.step:g} s, "
                "from 0 on"
            )
        indices.append(number)
    if not indices or any(b <= a for a, b in zip(indices, indices[1:], strict=False)):
        raise InputError("times: must be at least one, and rising")
    return indices, indices[-1]


def _not_among(what: str, name: str, all_names: Sequence[str]) -> InputError:
    """Return the error for an unknown name of a channel or key (``what``)."""
    return InputError(
        f"{what} {name!r}: there is none{nearest(name, all_names)}; there are: "
        + ", ".join(all_names)
    )


NOTHING = 1e-10
"""Relative change of a metric, for a change of the key by ``scale_of``, that is no influence."""
STILL = 1e-6
"""Uncertainty of the change per ``scale_of``, over the metric, up to which 0 means no influence."""
_UNCERTAIN = 0.01
"""Uncertainty, scaled as for ``STILL``, above which a derivative below its uncertainty is NaN."""


@dataclass(frozen=True, repr=False)
class MetricSensitivities(Presented):
    """Derivatives of metrics by values of a scene; see ``ab_sim.metric_sensitivities``."""

    _picture = "metric_sensitivities"

    scene: Scene
    """Scene as it was run."""
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

        Parameters
        ----------
        metric, key
            Indices of the metric and the key.
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
    progress: CountProgress | None = None,
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
    large = moves > _UNCERTAIN * np.abs(values[:, None])
    uncertain: np.ndarray = ~(uncertainties < np.abs(derivatives)) & large
    return uncertain


def differentiable_metrics(names: Sequence[str]) -> list[Metric[Any]]:
    """Return the metrics with these names.

    Raises
    ------
    InputError
        There is no such metric, it is not a number, or it jumps between samples.
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
    """Return a number for JSON: None for NaN and infinity, which JSON cannot represent."""
    return float(x) if np.isfinite(x) else None
