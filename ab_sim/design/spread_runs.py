"""Runs of random drives and their statistics."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
import pyarrow

from ab_sim.analysis.metrics.metric import MetricKind
from ab_sim.base.errors import InputError, exact
from ab_sim.base.presentation import Progress
from ab_sim.base.workers import Workers
from ab_sim.design.bounds import Bound, bound_of
from ab_sim.design.draws import DrawnPoints, ExchangedPoints
from ab_sim.design.judged import OUTCOME, Job, has_settled, metric_columns, metric_values
from ab_sim.design.points import MOST_RUNS
from ab_sim.design.spread import BALANCED, DesignDifference, SobolIndices, Spread, WorstRun
from ab_sim.design.statistics import (
    MeanInterval,
    QuantileOfMetric,
    SobolIndex,
    paired_difference,
    paired_shares,
    quantile_of,
    share_of,
    sobol_of,
)
from ab_sim.design.sweep import DEFAULT_METRICS, Sweep, check_first, sweep_of
from ab_sim.design.tolerances import Tolerance
from ab_sim.design.work import Executor, StudyRuns
from ab_sim.drive.accuracy import resolve_accuracy
from ab_sim.scene.model import Scene

DEFAULT_CRITERION = (bound_of("balanced"),)
"""Default bounds that a run must satisfy to count as balanced."""
_RANKED_BY = "residual_unbalance"
"""Metric that ranks the runs if the criterion has no numerical bound."""
QUANTILES = (0.05, 0.5, 0.95)
"""Probabilities of the reported quantiles."""
WORST = 10
"""Number of worst runs that are listed."""

FEW_PAIRS = 128
"""Least number of pairs for reliable bootstrap intervals, in a linear model of normal factors."""


class SpreadQuestion(NamedTuple):
    """Settings of a study of random drives."""

    runs: int
    """Number of drives; with ``until``, the least number."""
    metrics: tuple[str, ...] = DEFAULT_METRICS
    """Metrics of which quantiles are reported."""
    criterion: tuple[Bound, ...] = DEFAULT_CRITERION
    """Bounds that a settled run must satisfy to count as balanced."""
    seed: int = 0
    """Seed of the draws."""
    pairs: int | None = None
    """Number of pairs of drives for Sobol indices, a power of 2; 0 for none.

    None uses up to half the runs, and no pairs if that gives fewer than ``FEW_PAIRS``.
    """
    until: float | None = None
    """Half-width of the share's interval, 0 to 1, at which the study stops."""
    against: Scene | None = None
    """Scene for comparison, run with the draws of this one; None: no comparison."""


def run_spread(
    scene: Scene,
    tolerances: Sequence[Tolerance],
    question: SpreadQuestion,
    executor: Executor | None = None,
    tell: Progress | None = None,
) -> Spread:
    """Run random drives and compute their statistics.

    Results are cached: a study with more runs or a smaller ``until`` continues from them.

    Parameters
    ----------
    scene
        Nominal scene.
    tolerances
        Tolerances of the drives.
    question
        Settings of the study.
    executor
        Executor for the work; None for this process.
    tell
        See ``rows_of``.

    Raises
    ------
    InputError
        The settings are invalid, or another process is computing the same runs.
    SceneError
        None of the first draws is a valid scene; the message states why.
    WorkerLost
        A worker process was lost.
    """
    drawn, ranked_by = _checked(scene, tolerances, question)
    pairs, none = _pairs(drawn, question)
    job = _job(scene, drawn, question, ranked_by)
    check_first(job, drawn)
    if question.against is not None:
        other = DrawnPoints(question.against, tolerances, question.runs, question.seed)
        other_job = _job(question.against, other, question, ranked_by)
        check_first(other_job, other)
    difference = None
    indices = SobolIndices(0, 0, {}, {}, none)
    with executor or Workers(1) as entered:
        study = _Study(question, entered, tell)
        runs, balanced = study.drives(job, drawn, question.until)
        if question.against is not None:
            results = study.drives(other_job, other.of(len(balanced)), None)
            difference = _difference(runs, balanced, *results)
        if pairs:
            indices = study.indices(job, drawn, pairs, runs, balanced)
    return Spread(
        runs,
        drawn.tolerances,
        question.criterion,
        question.seed,
        balanced,
        share_of(balanced),
        {name: _quantiles(runs[name]) for name in _numbers(job.metrics)},
        indices,
        ranked_by,
        _worst(runs, balanced, drawn, (ranked_by, _wants_small(ranked_by, question))),
        difference,
    )


def _checked(
    scene: Scene, tolerances: Sequence[Tolerance], question: SpreadQuestion
) -> tuple[DrawnPoints, str]:
    """Check the settings of a study.

    Returns
    -------
    tuple[DrawnPoints, str]
        The random drives, and the metric by which runs are ranked.

    Raises
    ------
    InputError
        See ``run_spread``.
    """
    until = question.until
    if until is not None and not 1e-5 <= until < 0.5:
        raise InputError(f"until {exact(until)}: must be a share from 0.00001 to below 0.5")
    if not question.criterion:
        raise InputError("criterion: is empty; name a condition, e.g. residual_unbalance<=0.1")
    if question.seed < 0:
        raise InputError(f"seed {question.seed}: must be at least 0")
    metric_columns(question.metrics)
    drawn = DrawnPoints(scene, tolerances, question.runs, question.seed)
    bounded = _numbers(bound.metric for bound in question.criterion)
    return drawn, bounded[0] if bounded else _RANKED_BY


def _pairs(drawn: DrawnPoints, question: SpreadQuestion) -> tuple[int, str]:
    """Return the number of pairs for Sobol indices, and the reason if there are none."""
    factors, pairs = len(drawn.factors), question.pairs
    if factors < 2:
        return 0, "there is one factor only"
    if pairs is None:
        most = question.runs // (2 * factors)
        if most >= FEW_PAIRS:
            return 1 << (most.bit_length() - 1), ""
        return 0, (
            f"runs = {question.runs} are too few: reliable indices need {FEW_PAIRS} pairs, which "
            f"take {2 * FEW_PAIRS * factors} runs; fewer pairs may be requested (sobol)"
        )
    if pairs and (pairs < 2 or pairs.bit_count() != 1):
        raise InputError(f"sobol {pairs}: must be 0, for none, or a power of 2, e.g. 1024")
    if 2 * pairs > question.runs:
        raise InputError(
            f"sobol {pairs}: takes pairs from the {question.runs} runs; must be at most "
            f"{question.runs // 2}, or request more runs"
        )
    return pairs, "" if pairs else "none were requested"


def _job(scene: Scene, drawn: DrawnPoints, question: SpreadQuestion, ranked_by: str) -> Job:
    """Return the job of a scene's runs, with all metrics that the study needs."""
    resolved, _ = resolve_accuracy(scene)
    bounded = (bound.metric for bound in question.criterion)
    return Job(resolved, drawn.keys, tuple(dict.fromkeys((*question.metrics, *bounded, ranked_by))))


class _Study:
    """Runner and evaluator of a study.

    Parameters
    ----------
    question
        Settings of the study.
    executor
        Executor for the work, entered by the caller.
    tell
        See ``rows_of``.
    """

    def __init__(self, question: SpreadQuestion, executor: Executor, tell: Progress | None) -> None:
        self._question, self._executor, self._tell = question, executor, tell

    def drives(self, job: Job, drawn: DrawnPoints, until: float | None) -> tuple[Sweep, np.ndarray]:
        """Run the drives of one scene.

        Parameters
        ----------
        job
            Common data of the runs.
        drawn
            Random drives.
        until
            Half-width of the share's interval up to which runs are added; None for none.

        Returns
        -------
        tuple[Sweep, np.ndarray]
            The runs, and a mask of the balanced ones, shape (runs,).
        """
        with StudyRuns(job, drawn.report(), self._executor) as study:
            rows = study.rows(drawn, range(len(drawn)), self._tell)
            while until is not None and len(rows) < MOST_RUNS:
                share = share_of(self._balanced(rows))
                if share.half_width <= until:
                    break
                # The share is only an estimate: add at least 5 % more runs, so that few rounds
                # suffice.
                more = max(share.runs_for(until), len(rows) + len(rows) // 20 + 1)
                drawn = drawn.of(min(more, MOST_RUNS))
                new = study.rows(drawn, range(len(rows), len(drawn)), self._tell)
                rows = pyarrow.concat_tables([rows, new]).combine_chunks()
            study.join(rows)
        return sweep_of(job, drawn, rows), self._balanced(rows)

    def indices(
        self, job: Job, drawn: DrawnPoints, pairs: int, runs: Sweep, balanced: np.ndarray
    ) -> SobolIndices:
        """Return Sobol indices from pairs of existing runs and from additional runs.

        Parameters
        ----------
        job
            Common data of the runs.
        drawn
            Random drives; the first 2 ``pairs`` form the pairs.
        pairs
            Number of pairs, a power of 2.
        runs
            Runs of ``drawn``.
        balanced
            Mask of balanced ones, shape (runs,).
        """
        points = ExchangedPoints(drawn, pairs)
        with StudyRuns(job, points.report(), self._executor) as study:
            rows = study.rows(points, range(len(points)), self._tell)
            study.join(rows)
        by_metric: dict[str, tuple[SobolIndex, ...]] = {}
        missing: dict[str, str] = {}
        numbers = {BALANCED: (balanced.astype(float), self._balanced(rows).astype(float))}
        numbers |= {name: (runs[name], metric_values(rows, name)) for name in _numbers(job.metrics)}
        for name, (paired, mixed) in numbers.items():
            whole = np.concatenate([paired[: 2 * pairs], mixed])
            without = int(np.count_nonzero(~np.isfinite(whole)))
            if without:
                missing[name] = f"{without} of {len(whole)} runs have no value"
            else:
                exchanged = mixed.reshape(pairs, -1).T
                by_metric[name] = sobol_of(
                    paired[: 2 * pairs : 2], paired[1 : 2 * pairs : 2], exchanged, drawn.factors
                )
                if not by_metric[name]:
                    del by_metric[name]
                    missing[name] = "it does not vary"
        return SobolIndices(pairs, len(points), by_metric, missing)

    def _balanced(self, rows: pyarrow.Table) -> np.ndarray:
        """Return a mask of rows that have settled and satisfy the criterion."""
        settled = has_settled(rows[OUTCOME].to_pylist())
        for bound in self._question.criterion:
            settled &= bound.holds(metric_values(rows, bound.metric))
        return settled


def _numbers(metrics: Iterable[str]) -> list[str]:
    """Return the keys of those metrics that are numbers."""
    return [column.key for column in metric_columns(metrics) if column.kind is MetricKind.NUMBER]


def _quantiles(values: np.ndarray) -> tuple[QuantileOfMetric, ...]:
    """Return the quantiles of a metric over the runs with a value; empty if there is none."""
    finite = values[np.isfinite(values)]
    return tuple(quantile_of(finite, p) for p in QUANTILES) if len(finite) else ()


def _wants_small(metric: str, question: SpreadQuestion) -> bool:
    """Return whether small values of a metric are good: by its bound in the criterion, if any."""
    return next((bound.upper for bound in question.criterion if bound.metric == metric), True)


def _worst(
    runs: Sweep, balanced: np.ndarray, drawn: DrawnPoints, ranked: tuple[str, bool]
) -> tuple[WorstRun, ...]:
    """Return the worst runs: unbalanced ones first, then by the ranking metric.

    Parameters
    ----------
    runs
        Runs of all drives.
    balanced
        Mask of balanced ones, shape (runs,).
    drawn
        Drives, for their drawn values.
    ranked
        Ranking metric, and whether small values are good. Runs without a value are worst.
    """
    name, wants_small = ranked
    values = runs[name].astype(float)
    badness = np.where(np.isfinite(values), values if wants_small else -values, np.inf)
    order = np.lexsort((-badness, balanced))[:WORST]
    return tuple(
        WorstRun(
            int(run),
            str(runs[OUTCOME][run]),
            float(values[run]) if np.isfinite(values[run]) else None,
            dict(zip(drawn.keys, drawn.at(int(run)), strict=True)),
        )
        for run in order
    )


def _difference(
    runs: Sweep, balanced: np.ndarray, others: Sweep, also: np.ndarray
) -> DesignDifference:
    """Compare a scene with another one, run with the same draws.

    Parameters
    ----------
    runs
        Runs of the scene.
    balanced
        Mask of the balanced runs of the scene, shape (runs,).
    others
        Runs of the other scene.
    also
        Mask of the balanced runs of the other scene, shape (runs,).
    """
    differences: dict[str, MeanInterval] = {}
    for name in _numbers(runs.metrics):
        difference = paired_difference(runs[name], others[name])
        if difference is not None:
            differences[name] = difference
    return DesignDifference(
        others, also, share_of(also), paired_shares(balanced, also), differences
    )
