"""Optimisation of a scene's keys by one metric, within bounds on others."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import pyarrow

from ab_sim.analysis.metrics.metric import Better
from ab_sim.base.errors import InputError
from ab_sim.base.presentation import Columns, Presented, Progress, number
from ab_sim.base.version import __version__
from ab_sim.base.workers import Workers
from ab_sim.base.yaml_files import yaml_text
from ab_sim.design.bounds import Bound
from ab_sim.design.judged import OUTCOME, Job, Point, has_settled, judged, metric_columns
from ab_sim.design.points import check_keys
from ab_sim.design.search import (
    MEASURES,
    Aim,
    Candidates,
    Scores,
    Task,
    best_of,
    joined,
    scored,
    search,
)
from ab_sim.design.sweep import Sweep, check_first, table_of
from ab_sim.design.work import Executor, StudyRuns
from ab_sim.drive.accuracy import resolve_accuracy
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene

RUNS = 1000
"""Default number of runs of a search."""
_FEWEST, MOST = 16, 1_000_000
"""Least number of candidates, and largest number of runs."""
DRAWS, SHARE = 32, 0.9
"""Defaults for random drives: number per candidate, and fraction that must satisfy the bounds."""
AS_IT_IS, NO_PERIOD = "as it is", "without its variable-speed period"
"""Names of the scenes with which the best candidate is compared."""
NEAR = 0.05
"""Relative change of a key for the values next to the optimum."""
_AT_A_BOUND = 0.01
"""Distance up to which a range's end, or a bound, counts as reached; as a fraction of either."""


@dataclass(frozen=True, repr=False)
class Tuning(Presented):
    """Result of a tuning; see ``ab_sim.tune``."""

    _picture = "tuning"

    task: Task
    """Definition of the tuning, with a resolved accuracy."""
    runs: Sweep
    """All runs: one per draw of each candidate, candidate after candidate."""
    candidates: np.ndarray
    """Values of the varied keys, shape (candidates, keys)."""
    scores: Scores
    """Scores of the candidates."""
    candidate: int | None
    """Index of the best candidate; None if nothing was found."""
    scene: Scene | None
    """Best scene, named ``NAME-tuned``; None if nothing was found."""
    nearby: tuple[tuple[str, float, float | None, bool], ...]
    """Results next to the optimum, with each key slightly below and above its best value.

    Each entry: key, value, the aim, and whether it is within all bounds.
    """
    before: tuple[tuple[str, float | None, bool], ...]
    """Results of the original scene, with and without its variable-speed period.

    Each entry: name, the aim, and whether it is within all bounds.
    """

    @property
    def values(self) -> dict[str, float]:
        """Best values by key; empty if nothing was found."""
        if self.candidate is None:
            return {}
        row = self.candidates[self.candidate].tolist()
        return {
            range_.key: int(value) if range_.whole else value
            for range_, value in zip(self.task.ranges, row, strict=True)
        }

    @property
    def keys(self) -> tuple[str, ...]:
        """Varied keys, dotted."""
        return tuple(range_.key for range_ in self.task.ranges)

    @property
    def best(self) -> float | None:
        """Value of the aim's metric for the best candidate; None if nothing was found.

        For random drives, the value that the required fraction of them reaches.
        """
        return None if self.candidate is None else float(self.scores.aims[self.candidate])

    @property
    def as_good(self) -> dict[str, float]:
        """Aims, by name, of scenes of ``before`` within bounds and at least as good as the best."""
        sign = 1.0 if self.task.aim.smallest else -1.0
        best = np.inf if self.best is None else sign * self.best
        return {
            name: metric
            for name, metric, inside in self.before
            if inside and metric is not None and sign * metric <= best
        }

    @property
    def left_out(self) -> dict[str, tuple[int, int]]:
        """Number of candidates left out as unsettled, by outcome.

        The second number counts those whose aim at the end of the run is better than the best.
        Empty for random drives, where a fraction of the runs decides.
        """
        if self.task.draws > 1:
            return {}
        sign = 1.0 if self.task.aim.smallest else -1.0
        values = sign * np.asarray(self.runs[self.task.aim.metric], float)
        better = values < (np.inf if self.best is None else sign * self.best)
        outcomes = self.runs[OUTCOME]
        return {
            name: (count, int(np.count_nonzero(better & (outcomes == name))))
            for name, count in self.runs.outcomes.items()
            if not has_settled([name])[0]
        }

    @property
    def is_better(self) -> bool:
        """True if the best candidate is better than the original scene, or alone within bounds."""
        return self.best is not None and AS_IT_IS not in self.as_good

    @property
    def active(self) -> list[str]:
        """Ends of ranges, and bounds, that limit the best candidate; beyond may be better ones."""
        if self.candidate is None:
            return []
        names = []
        for range_ in self.task.ranges:
            value = self.values[range_.key]
            for end in (range_.low, range_.high):
                if abs(value - end) <= _AT_A_BOUND * (range_.high - range_.low):
                    names.append(f"{range_.key}={end:g}")
        if self.task.draws > 1:
            return names
        for bound in self.task.bounds:
            value = float(self.runs[bound.metric][self.candidate])
            if bound.is_number and abs(value - bound.limit) <= _AT_A_BOUND * abs(bound.limit):
                names.append(str(bound))
        return names

    def scene_text(self) -> str:
        """Return the best scene's file with a header on its origin; empty without one."""
        if self.scene is None:
            return ""
        aim = f"{self.task.aim}: {number(self.best)}"
        lines = [f"made by ab-sim tune {__version__} of {self.runs.scene.name}, {aim}"]
        lines += [f"  with {bound}" for bound in self.task.bounds]
        head = "".join(f"# {line}\n" for line in lines)
        return head + yaml_text(self.scene.as_mapping())

    def in_units(self, units: str) -> "Tuning":
        """Return a copy shown in other units: see ``Sweep.in_units``."""
        return replace(self, runs=self.runs.in_units(units))

    def report(self) -> dict[str, object]:
        """Return all results as JSON-able values: see docs/reference/json.md."""
        return {
            **self.task.report(),
            "found": self.candidate is not None,
            "values": self.values,
            "best": self.best,
            "is_better": self.is_better,
            "left_out": {
                name: {"candidates": count, "better_at_their_end": better}
                for name, (count, better) in self.left_out.items()
            },
            "active": self.active,
            "nearby": [
                dict(zip(("key", "value", "metric", "within"), row, strict=True))
                for row in self.nearby
            ],
            "before": [
                dict(zip(("scene", "metric", "within"), row, strict=True)) for row in self.before
            ],
            "scene": None if self.scene is None else self.scene.as_mapping(),
            "runs": self.runs.report()["runs"],
            "version": __version__,
        }

    def _facts(self) -> dict[str, str]:
        facts = {"scene": self.runs.scene.name, "runs": str(len(self.runs.table))}
        if self.candidate is None:
            return facts | {"found": "nothing"}
        values = {key: number(value) for key, value in self.values.items()}
        return facts | {str(self.task.aim): number(self.best)} | values

    def _columns(self) -> Columns:
        return self.runs._columns()


def run_tuning(
    task: Task,
    executor: Executor | None = None,
    tell: Progress | None = None,
) -> Tuning:
    """Search for the values of the keys with the best aim within the bounds.

    Parameters
    ----------
    task
        Definition of the search; equal tasks evaluate equal candidates.
    executor
        Executor for the work; None for this process.
    tell
        See ``rows_of``.

    Raises
    ------
    InputError
        A metric is not a number, nothing varies, or another process is running the same tuning.
    SceneError
        The middle of the ranges is no valid scene; the message states why.
    """
    scene, _ = resolve_accuracy(task.scene)
    task = task._replace(scene=scene)
    _check(task)
    study: dict[str, object] = {"tune": task.report()}
    candidates = Candidates(task, study)
    job = Job(scene, candidates.keys, task.metrics)
    tables, scores = list[pyarrow.Table](), list[Scores]()
    with executor or Workers(1) as entered, StudyRuns(job, study, entered) as runs:

        def costs(values: np.ndarray) -> np.ndarray:
            table = runs.rows(candidates, candidates.add(values))
            tables.append(table)
            scores.append(scored(table, task))
            if tell is not None:
                done = min(len(candidates.values), task.candidates)
                tell(_best_yet(task.aim, joined(scores)), done, task.candidates)
            return scores[-1].costs

        search(task.ranges, costs, task.candidates, task.seed, _scene_values(task))
        whole = pyarrow.concat_tables(tables)
        runs.join(whole)
    scores_, values = joined(scores), np.array(candidates.values, float)
    best = best_of(scores_)
    return Tuning(
        task,
        Sweep(scene, job.keys, job.metrics, study, table_of(job, candidates, whole)),
        values,
        scores_,
        best,
        None if best is None else _tuned(candidates.scene_of(best)),
        () if best is None else _nearby(task, candidates.values[best]),
        _before(task),
    )


def _tuned(scene: Scene) -> Scene:
    """Return the scene with another name, to distinguish it from its origin."""
    return changed_scene(scene, {"name": f"{scene.name}-tuned"}, "tune")


def _check(task: Task) -> None:
    """Refuse a task that cannot be run, before any run; see ``run_tuning``."""
    if not task.ranges:
        raise InputError("nothing varies; name a key and its range, e.g. balls.mass=0.5g..3g")
    check_keys([range_.key for range_ in task.ranges])
    draws, runs = task.draws, task.candidates * task.draws
    if not _FEWEST <= task.candidates <= MOST // draws:
        raise InputError(f"runs = {runs}: must be from {_FEWEST * draws} to {MOST}")
    if not 0.0 < task.share <= 1.0:
        raise InputError(f"share = {task.share:g}: must be above 0, at most 1")
    metric_columns(task.metrics)
    nominal = task._replace(tolerances=(), draws=1)
    examples = _at_shares(nominal, (0.5, 0.0, 1.0 - 1e-9))
    check_first(Job(task.scene, examples.keys, task.metrics), examples)
    if task.tolerances:
        _at_shares(task, (0.5,)).at(0)  # raises if the spread is invalid


def _at_shares(task: Task, shares: Sequence[float]) -> Candidates:
    """Return candidates at fractions of all ranges."""
    candidates = Candidates(task, {})
    columns = [range_.at(np.array(shares)) for range_ in task.ranges]
    candidates.add(np.column_stack(columns))
    return candidates


def _scene_values(task: Task) -> list[float] | None:
    """Return the scene's values of the varied keys; None unless all are within their ranges.

    A search that starts from them finds no worse result than theirs.
    """
    values = []
    for range_ in task.ranges:
        here: Any = task.scene.as_mapping()
        for part in range_.key.split("."):
            here = here.get(part) if isinstance(here, dict) else None
        if not isinstance(here, int | float) or not range_.low <= here <= range_.high:
            return None
        values.append(float(here))
    return values


def _best_yet(aim: Aim, scores: Scores) -> str:
    """Return the progress text of a search."""
    best = best_of(scores)
    return f"{aim}: {number(scores.aims[best])}" if best is not None else "none within bounds yet"


def _judged(task: Task, values: Sequence[tuple[Any, ...]]) -> Scores:
    """Return the scores of candidates outside the search, given by values of the varied keys."""
    candidates = Candidates(task, {})
    candidates.values.extend(values)
    points = [Point(run, candidates.at(run)) for run in range(len(candidates))]
    return scored(judged(Job(task.scene, candidates.keys, task.metrics), points), task)


def _nearby(task: Task, best: tuple[Any, ...]) -> tuple[tuple[str, float, float | None, bool], ...]:
    """Return ``Tuning.nearby``: keys differ by ``NEAR`` of their values, whole numbers by one."""
    near = []
    for place, range_ in enumerate(task.ranges):
        for sign in (-1, 1):
            values = list(best)
            values[place] += sign * (1 if range_.whole else NEAR * abs(values[place]))
            near.append(tuple(values))
    scores = _judged(task, near)
    return tuple(
        (task.ranges[k // 2].key, near[k][k // 2], *_aim_and_within(scores, k))
        for k in range(len(near))
    )


def _before(task: Task) -> tuple[tuple[str, float | None, bool], ...]:
    """Return ``Tuning.before``, from runs of the unchanged scene."""
    scenes = {AS_IT_IS: task.scene}
    if getattr(task.scene.profile, "variable_speed_period", None) is not None:
        changes = {"profile.variable_speed_period": None}
        scenes[NO_PERIOD] = changed_scene(task.scene, changes, "tune")
    return tuple(
        (name, *_aim_and_within(_judged(task._replace(scene=scene, ranges=()), [()]), 0))
        for name, scene in scenes.items()
    )


def _aim_and_within(scores: Scores, candidate: int) -> tuple[float | None, bool]:
    """Return a candidate's aim, None without a value, and whether it is within all bounds."""
    aim = float(scores.aims[candidate])
    return (aim if math.isfinite(aim) else None), bool(scores.within[candidate])


def aim_of(minimise: str | None, maximise: str | None) -> Aim:
    """Return the aim for one of two metrics.

    Raises
    ------
    InputError
        None or both are given, or the metric is unknown or not a number.
    """
    if (minimise is None) == (maximise is None):
        raise InputError("aim: give a metric either to minimise or to maximise, and not both")
    metric = minimise if minimise is not None else maximise
    (column,) = metric_columns([str(metric)])
    wrong = Better.LARGER if minimise is not None else Better.SMALLER
    if column.better is wrong:
        verb = "maximise" if minimise is not None else "minimise"
        raise InputError(f"metric {column.key!r}: is better when {wrong.value}; {verb} it")
    return Aim(column.key, minimise is not None)


class NearMiss(NamedTuple):
    """Diagnosis of one bound in a tuning that found nothing."""

    bound: Bound
    """The bound."""
    holds: int
    """Number of settled runs that satisfy the bound."""
    settled: int
    """Number of settled runs."""
    measure: str
    """Metric that measures the distance: the bound's own, or the one that decides a truth value."""
    nearest: float | None
    """Nearest value of that metric among settled runs; None if there is no number."""
    candidate: int
    """Index of the candidate with that run."""


def near_misses(tuning: Tuning) -> Iterator[NearMiss]:
    """Yield a diagnosis for each bound, in the order of the bounds."""
    settled = has_settled(tuning.runs[OUTCOME])
    for bound in tuning.task.bounds:
        measure = MEASURES.get(bound.metric, bound.metric)
        holds = int((bound.holds(tuning.runs[bound.metric]) & settled).sum())
        count = int(settled.sum())
        if measure == bound.metric and not bound.is_number:
            yield NearMiss(bound, holds, count, measure, None, 0)
            continue
        values = np.asarray(tuning.runs[measure], float)
        sense = 1.0 if bound.upper or measure != bound.metric else -1.0
        ranked = np.where(settled & np.isfinite(values), sense * values, np.inf)
        run = int(np.argmin(ranked))
        nearest = float(values[run]) if np.isfinite(ranked[run]) else None
        candidate = run // tuning.task.draws
        yield NearMiss(bound, holds, count, measure, nearest, candidate)
