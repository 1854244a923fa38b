"""The best values of a scene's keys, by one merit, within bounds on others."""

import math
from collections.abc import Iterable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pyarrow

import ab_sim
from ab_sim.accuracy import resolve_accuracy
from ab_sim.analysis.merits.merit import Better
from ab_sim.design.bounds import Bound
from ab_sim.design.judged import OUTCOME, SETTLED, Job, Point, judged, merit_columns, varied_scene
from ab_sim.design.search import Effort, search
from ab_sim.design.sweep import Sweep, table_of
from ab_sim.design.variables import Range
from ab_sim.design.work import Executor, StudyRuns, Tell
from ab_sim.errors import InputError, SceneError
from ab_sim.presentation import Column, Columns, Presented, number
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene

RUNS = 1000
"""Of a search, unless told."""
MOST = 1_000_000
NEAR = 0.05
"""Share of its own value by which a key is changed, to see what happens beside the optimum."""
AT_A_BOUND = 0.01
"""Of a range or a limit: what is nearer to its end is said to be there."""
_BEYOND, _NOTHING = 1.0, 3.0
"""Costs of what is out of bounds, by how much; and of a run that says nothing."""


class Aim(NamedTuple):
    """What is to be small, or large."""

    merit: str
    smallest: bool

    def __str__(self) -> str:
        return f"{'smallest' if self.smallest else 'largest'} {self.merit}"


class Task(NamedTuple):
    """What is looked for."""

    scene: Scene
    ranges: tuple[Range, ...]
    aim: Aim
    bounds: tuple[Bound, ...]
    effort: Effort

    @property
    def merits(self) -> tuple[str, ...]:
        """That decide."""
        return tuple(dict.fromkeys([self.aim.merit, *(each.merit for each in self.bounds)]))

    def report(self) -> dict[str, Any]:
        """JSON-able."""
        return {
            "ranges": {each.key: [*each[1:]] for each in self.ranges},
            "aim": str(self.aim),
            "bounds": [str(each) for each in self.bounds],
            "effort": list(self.effort),
        }


class Candidates:
    """Points that are asked for one after the other.

    Args:
        ranges: of the keys.
        study: what they follow from, JSON-able.
    """

    def __init__(self, ranges: Sequence[Range], study: dict[str, Any]) -> None:
        self._study = study
        self._whole = [each.whole for each in ranges]
        self.keys = tuple(each.key for each in ranges)
        self._values: list[tuple[Any, ...]] = []

    def __len__(self) -> int:
        return len(self._values)

    def add(self, values: np.ndarray) -> range:
        """More of them, shape (candidates, keys); their numbers."""
        first = len(self)
        for row in values.tolist():
            self._values.append(
                tuple(int(v) if whole else v for v, whole in zip(row, self._whole, strict=True))
            )
        return range(first, len(self))

    def at(self, run: int) -> tuple[Any, ...]:
        """See ``Points``."""
        return self._values[run]

    def report(self) -> dict[str, Any]:
        """See ``Points``."""
        return self._study


@dataclass(frozen=True, repr=False)
class Tuning(Presented):
    """The best values of a scene's keys; see ``ab_sim.tune``."""

    _picture = "tuning"

    task: Task
    runs: Sweep
    """All that were looked at, in their order."""
    run: int | None
    """Number of the best one that settled within all bounds; None: nothing was found."""
    beside: tuple[tuple[str, float, float | None, bool], ...]
    """Of each key a little less and a little more than at the best: key, value, the aim's merit,
    and whether that settled within all bounds."""
    before: tuple[tuple[str, float | None, bool], ...]
    """The scene as it is, and without its variable-speed period: name, the aim's merit, and whether
    that settled within all bounds."""

    @property
    def scene(self) -> Scene | None:
        """The best scene; None where nothing was found."""
        return None if self.run is None else self.runs.scene_of(self.run)

    @property
    def values(self) -> dict[str, float]:
        """By key, of the best; empty where nothing was found."""
        return {} if self.run is None else {k: self.runs[k][self.run].item() for k in self.keys}

    @property
    def keys(self) -> tuple[str, ...]:
        """That vary; dotted."""
        return self.runs.keys

    @property
    def best(self) -> float | None:
        """The aim's merit at the best; None where nothing was found."""
        return None if self.run is None else float(self.runs[self.task.aim.merit][self.run])

    @property
    def is_better(self) -> bool:
        """Whether the best is better than the scene as it is, or that does not count."""
        (_, merit, inside), *_ = self.before
        if self.best is None or merit is None or not inside:
            return self.best is not None
        return self.best < merit if self.task.aim.smallest else self.best > merit

    @property
    def within(self) -> np.ndarray:
        """Which runs settled within all bounds, shape (runs,)."""
        return _within(self.runs.table, self.task)

    @property
    def active(self) -> list[str]:
        """Ends of ranges, and bounds, that the best is at: it may be better beyond."""
        if self.run is None:
            return []
        found = []
        for each in self.task.ranges:
            value = self.values[each.key]
            for end in (each.low, each.high):
                if abs(value - end) <= AT_A_BOUND * (each.high - each.low):
                    found.append(f"{each.key}={end:g}")
        for bound in self.task.bounds:
            value = float(self.runs[bound.merit][self.run])
            if bound.is_number and abs(value - bound.limit) <= AT_A_BOUND * abs(bound.limit):
                found.append(str(bound))
        return found

    def report(self) -> dict[str, object]:
        """Everything as JSON-able values: see ``ab-sim tune --help``."""
        return {
            **self.task.report(),
            "found": self.run is not None,
            "values": self.values,
            "best": self.best,
            "is_better": self.is_better,
            "active": self.active,
            "beside": [
                dict(zip(("key", "value", "merit", "within"), each, strict=True))
                for each in self.beside
            ],
            "before": [
                dict(zip(("scene", "merit", "within"), each, strict=True)) for each in self.before
            ],
            "scene": None if self.scene is None else self.scene.as_mapping(),
            "runs": self.runs.report()["runs"],
            "version": ab_sim.__version__,
        }

    def _facts(self) -> dict[str, str]:
        said = {"scene": self.runs.scene.name, "runs": str(len(self.runs.table))}
        if self.run is None:
            return said | {"found": "nothing"}
        values = {key: number(value) for key, value in self.values.items()}
        return said | {str(self.task.aim): number(self.best)} | values

    def _columns(self) -> Columns:
        return {
            name: Column(self.runs.unit(name), self.runs.table[name].to_pylist())
            for name in self.runs.table.column_names
        }


def run_tuning(
    task: Task,
    executor: AbstractContextManager[Executor] | None = None,
    tell: Tell | None = None,
) -> Tuning:
    """Look for the best.

    Args:
        task: what is looked for; the same task looks at the same candidates.
        executor, tell: see ``rows_of``.

    Raises:
        InputError: a merit is no number, nothing varies, or the same is tuned by another process.
        SceneError: in the middle of the ranges there is no scene; says why.
    """
    scene = task.scene if task.scene.accuracy is None else resolve_accuracy(task.scene)[0]
    task = task._replace(scene=scene)
    _check(task)
    job = Job(scene, tuple(each.key for each in task.ranges), task.merits)
    study: dict[str, object] = {"tune": task.report()}
    candidates, tables = Candidates(task.ranges, study), list[pyarrow.Table]()
    with StudyRuns(job, study, executor) as runs:

        def costs(values: np.ndarray) -> np.ndarray:
            table = runs.rows(candidates, candidates.add(values))
            tables.append(table)
            if tell is not None:
                said = _said(task, tables)
                tell(said, min(len(candidates), task.effort.candidates), task.effort.candidates)
            return _costs(table, task)

        search(task.ranges, costs, task.effort, _own_values(task))
        whole = pyarrow.concat_tables(tables)
        runs.join(whole)
    found = Sweep(scene, job.keys, job.merits, study, table_of(job, candidates, whole))
    run = _best(whole, task)
    beside = () if run is None else _beside(job, task, candidates.at(run))
    return Tuning(task, found, run, beside, _before(task))


def _check(task: Task) -> None:
    if not task.ranges:
        raise InputError("nothing varies; name a key and its range, e.g. balls.mass=0.5g..3g")
    keys = [each.key for each in task.ranges]
    for key in keys:
        if keys.count(key) > 1:
            raise InputError(f"{key}: varies twice; name it once")
    if not 16 <= task.effort.candidates <= MOST:
        raise InputError(f"runs = {task.effort.candidates}: must be from 16 to {MOST}")
    merit_columns(task.merits)
    job = Job(task.scene, tuple(keys), task.merits)
    error: SceneError | None = None
    for share in (0.5, 0.0, 1.0 - 1e-9):
        try:
            varied_scene(job, [each.at(np.array([share]))[0].item() for each in task.ranges])
            return
        except SceneError as raised:
            error = error or raised
    if error is not None:
        raise error


def _own_values(task: Task) -> list[float] | None:
    """The scene's own, if it has numbers for all keys, within their ranges.

    What is found is then no worse than they are.
    """
    values = []
    for each in task.ranges:
        here: Any = task.scene.as_mapping()
        for part in each.key.split("."):
            here = here.get(part) if isinstance(here, dict) else None
        if not isinstance(here, int | float) or not each.low <= here <= each.high:
            return None
        values.append(float(here))
    return values


def _values(table: pyarrow.Table, merit: str) -> np.ndarray:
    return np.array(
        [math.nan if value is None else float(value) for value in table[merit].to_pylist()]
    )


def _within(table: pyarrow.Table, task: Task) -> np.ndarray:
    found = np.array([each == SETTLED for each in table[OUTCOME].to_pylist()], bool)
    found &= np.isfinite(_values(table, task.aim.merit))
    for bound in task.bounds:
        found &= bound.holds(_values(table, bound.merit))
    return found


def _costs(table: pyarrow.Table, task: Task) -> np.ndarray:
    """What the search makes small: any run within bounds is better than any other.

    Of runs within bounds it grows with the aim, between -0.5 and 0.5; of others, with how far they
    are from the bounds; runs that did not settle, or have no value, come last.
    """
    aim = _values(table, task.aim.merit) * (1.0 if task.aim.smallest else -1.0)
    settled = np.array([each == SETTLED for each in table[OUTCOME].to_pylist()], bool)
    beyond = np.zeros(len(aim))
    for bound in task.bounds:
        values = _values(table, bound.merit)
        settled &= np.isfinite(values)
        distance = np.abs(values - bound.limit) / max(abs(bound.limit), 1e-12)
        beyond += np.where(bound.holds(values), 0.0, distance + 1e-9)
    costs = np.where(beyond > 0.0, _BEYOND + beyond / (1.0 + beyond), np.arctan(aim) / math.pi)
    return np.where(settled & np.isfinite(aim), costs, _NOTHING)


def _best(table: pyarrow.Table, task: Task) -> int | None:
    within = _within(table, task)
    if not within.any():
        return None
    return int(np.argmin(np.where(within, _costs(table, task), math.inf)))


def _said(task: Task, tables: Iterable[pyarrow.Table]) -> str:
    whole = pyarrow.concat_tables(tables)
    run = _best(whole, task)
    if run is None:
        return "none within bounds yet"
    return f"{task.aim}: {number(float(_values(whole, task.aim.merit)[run]))}"


def _beside(
    job: Job, task: Task, best: tuple[Any, ...]
) -> tuple[tuple[str, float, float | None, bool], ...]:
    """Each key a little less and a little more; whole numbers by one."""
    points = list[Point]()
    for place, each in enumerate(task.ranges):
        for sign in (-1, 1):
            values = list(best)
            values[place] += sign * (1 if each.whole else NEAR * abs(values[place]))
            points.append(Point(len(points), tuple(values)))
    table = judged(job, points)
    aims, within = table[task.aim.merit].to_pylist(), _within(table, task)
    return tuple(
        (task.ranges[k // 2].key, point.values[k // 2], aims[k], bool(within[k]))
        for k, point in enumerate(points)
    )


def _before(task: Task) -> tuple[tuple[str, float | None, bool], ...]:
    scenes = {"as it is": task.scene}
    if getattr(task.scene.profile, "variable_speed_period", None) is not None:
        changes = {"profile.variable_speed_period": None}
        scenes["without its variable-speed period"] = changed_scene(task.scene, changes, "tune")
    found = []
    for name, scene in scenes.items():
        table = judged(Job(scene, (), task.merits), [Point(0, ())])
        aim = table[task.aim.merit].to_pylist()[0]
        found.append((name, aim, bool(_within(table, task)[0])))
    return tuple(found)


def aim_of(minimise: str | None, maximise: str | None) -> Aim:
    """One of two merits.

    Raises:
        InputError: none or both, no such merit, or it is no number.
    """
    if (minimise is None) == (maximise is None):
        raise InputError("say what is to be best: either minimise or maximise a merit, one of them")
    merit = minimise if minimise is not None else maximise
    (found,) = merit_columns([str(merit)])
    wrong = Better.LARGER if minimise is not None else Better.SMALLER
    if found.better is wrong:
        verb = "maximise" if minimise is not None else "minimise"
        raise InputError(f"merit {found.key!r}: is better when {wrong.value}; {verb} it")
    return Aim(found.key, minimise is not None)
