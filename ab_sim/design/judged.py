"""Evaluation of runs with varied values, a row of metrics each."""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
import pyarrow

from ab_sim.analysis.metrics.metric import Metric, MetricKind, metrics_named
from ab_sim.analysis.metrics.verdict import SETTLED, Verdict
from ab_sim.base.errors import InputError, SceneError
from ab_sim.design.batch.judging import JudgedPart, judged_parts
from ab_sim.design.batch.prepared_run import PreparedRun
from ab_sim.design.batch.run_columns import columns_of
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene

RUN, OUTCOME, FAILURE = "run", "outcome", "failure"
"""Columns in addition to keys and metrics."""
ABORTED, FAILED = "aborted", "failed"
"""Outcomes of runs without a verdict.

``ABORTED``: the start-up was aborted, so that there is no whirl at standstill. ``FAILED``: the run
did not finish.
"""
OUTCOMES = (*(verdict.value for verdict in Verdict), ABORTED, FAILED)
"""All outcomes of a run."""
PREPARED_AT_ONCE = 512
"""Number of runs outside columns whose scenes are in memory at a time."""
_VERDICT = "verdict"


class Job(NamedTuple):
    """Common data of all runs."""

    scene: Scene
    """Scene; a requested accuracy has been resolved to a solver."""
    keys: tuple[str, ...]
    """Varied keys, dotted."""
    metrics: tuple[str, ...]
    """Keys of the metrics."""


class Point(NamedTuple):
    """One run of a job."""

    run: int
    """Number of the run."""
    values: tuple[Any, ...]
    """Values in the order of the job's keys."""


def modules_of(job: Job) -> set[str]:
    """Return the modules of a job's metrics and effects, on whose sources its rows depend."""
    metrics = {metric.accumulator.__module__ for metric in metric_columns(job.metrics)}
    return metrics | {type(effect).__module__ for effect in job.scene.effects.values()}


def has_settled(outcomes: Iterable[str]) -> np.ndarray:
    """Return a mask of runs whose outcomes say that the final whirl, or a bound of it, is known."""
    return np.isin(np.asarray(outcomes, str), SETTLED)


def metric_columns(keys: Iterable[str]) -> list[Metric[Any]]:
    """Return metrics that can be columns.

    Raises
    ------
    InputError
        A metric is unknown or not a number; the message names it.
    """
    metrics = metrics_named(keys)
    for metric in metrics:
        if not metric.scalar:
            raise InputError(f"metric {metric.key!r}: {metric.not_a_number}")
    return metrics


def judged(job: Job, points: Sequence[Point]) -> pyarrow.Table:
    """Run points of a job and evaluate them.

    Parameters
    ----------
    job
        Common data of the runs.
    points
        Points in any order; their results are independent of each other.

    Returns
    -------
    pyarrow.Table
        A row per point in their order: run, metrics, outcome, failure. Metrics of failed and
        aborted runs are null.
    """
    # Runs that differ in a few numbers are checked and prepared together, in columns. The others
    # need a scene each, so only some of them are in memory at a time.
    values = zip(*(point.values for point in points), strict=True)
    columns = columns_of(job.scene, dict(zip(job.keys, values, strict=True)))
    in_columns = set() if columns is None else set(columns.valid.tolist())
    keys = list(dict.fromkeys((*job.metrics, _VERDICT)))
    rows = _Rows(job, len(points))
    if columns is not None:
        rows.add(judged_parts(columns, {}, keys))
    others = [place for place in range(len(points)) if place not in in_columns]
    for first in range(0, len(others), PREPARED_AT_ONCE):
        prepared: dict[int, PreparedRun] = {}
        for place in others[first : first + PREPARED_AT_ONCE]:
            try:
                prepared[place] = PreparedRun(varied_scene(job, points[place].values))
            except SceneError as error:
                rows.fail(place, str(error))
        rows.add(judged_parts(None, prepared, keys))
    schema = schema_of(job)
    results = {RUN: [point.run for point in points], **rows.columns}
    return pyarrow.table([pyarrow.array(results[f.name], f.type) for f in schema], schema=schema)


def schema_of(job: Job) -> pyarrow.Schema:
    """Return the schema of the result of ``judged``."""
    kinds = {MetricKind.NUMBER: pyarrow.float64(), MetricKind.TRUTH: pyarrow.bool_()}
    return pyarrow.schema(
        [
            (RUN, pyarrow.int64()),
            *((metric.key, kinds[metric.kind]) for metric in metric_columns(job.metrics)),
            (OUTCOME, pyarrow.string()),
            (FAILURE, pyarrow.string()),
        ]
    )


def varied_scene(job: Job, values: Sequence[Any]) -> Scene:
    """Return the scene of a point.

    Raises
    ------
    SceneError
        The scene is invalid; the message names key, value and allowed range.
    """
    changes = dict(zip(job.keys, values, strict=True))
    changed = ", ".join(f"{key}={value}" for key, value in changes.items())
    return changed_scene(job.scene, changes, changed)


def metric_values(table: pyarrow.Table, metric: str) -> np.ndarray:
    """Return the numbers of a metric in a table of ``judged``; NaN for null."""
    values: np.ndarray = table[metric].cast(pyarrow.float64()).to_numpy(zero_copy_only=False)
    return values


class _Rows:
    """Results of a job's runs in columns; null until a run has finished."""

    def __init__(self, job: Job, runs: int) -> None:
        names = (*job.metrics, OUTCOME, FAILURE)
        self._metrics = job.metrics
        self.columns: dict[str, list[Any]] = {name: [None] * runs for name in names}

    def fail(self, place: int, failure: str) -> None:
        """Record the failed run at an index, with its error message."""
        self._without_metrics(place, FAILED, failure)

    def _without_metrics(self, place: int, outcome: str, reason: str) -> None:
        """Record outcome and reason of the run at an index; all metrics of the run become null."""
        self.columns[OUTCOME][place], self.columns[FAILURE][place] = outcome, reason
        for key in self._metrics:
            self.columns[key][place] = None

    def add(self, parts: Iterable[JudgedPart]) -> None:
        """Record evaluated runs."""
        for part in parts:
            places = part.runs.tolist()
            kept = {OUTCOME: part.metrics[_VERDICT]} | {
                key: part.metrics[key] for key in self._metrics
            }
            for key, values in kept.items():
                column = self.columns[key]
                for place, value in zip(places, values, strict=True):
                    column[place] = value
            ends = zip(places, part.failures, part.aborts, strict=True)
            for place, failure, aborted in ends:
                if failure:
                    self.fail(place, failure)
                elif aborted:
                    self._without_metrics(place, ABORTED, aborted)
