"""Runs of a scene with other values, each to a row of merits."""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
import pyarrow

from ab_sim.analysis.merits.merit import Merit, MeritKind, merits_named
from ab_sim.analysis.merits.verdict import SETTLED, Verdict
from ab_sim.batch.judging import JudgedPart, judged_parts
from ab_sim.batch.prepared_run import PreparedRun
from ab_sim.batch.run_columns import split_of
from ab_sim.errors import InputError, SceneError
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene

RUN, OUTCOME, FAILURE = "run", "outcome", "failure"
"""Columns beside keys and merits."""
ABORTED, FAILED = "aborted", "failed"
"""Outcomes of runs without a verdict: the start-up was aborted, so that nothing whirls at
standstill; the run did not come to its end."""
OUTCOMES = (*(verdict.value for verdict in Verdict), ABORTED, FAILED)
PREPARED_AT_ONCE = 512
"""Runs that do not go in columns, of which there is a scene each in memory."""
_VERDICT = "verdict"


class Job(NamedTuple):
    """What all runs have in common."""

    scene: Scene
    """Its accuracy, if it asked for one, has become a solver."""
    keys: tuple[str, ...]
    """That vary; dotted."""
    merits: tuple[str, ...]
    """Keys of those that are wanted."""


class Point(NamedTuple):
    """One run of a job."""

    run: int
    values: tuple[Any, ...]
    """In the order of the job's keys."""


def modules_of(job: Job) -> set[str]:
    """What its rows follow from beside this module and the scene: modules of its merits."""
    return {merit.watch.__module__ for merit in merit_columns(job.merits)}


def has_settled(outcomes: Iterable[str]) -> np.ndarray:
    """Whether runs with these outcomes have a final whirl, or an upper bound of it."""
    return np.isin(np.asarray(outcomes, str), SETTLED)


def merit_columns(keys: Iterable[str]) -> list[Merit[Any]]:
    """Merits that can be columns.

    Raises:
        InputError: there is no such merit, or it is no number; names it.
    """
    found = merits_named(keys)
    for merit in found:
        if not merit.scalar:
            raise InputError(f"merit {merit.key!r}: {merit.not_a_number}")
    return found


def judged(job: Job, points: Sequence[Point]) -> pyarrow.Table:
    """Run points of a job.

    Args:
        job: what they have in common.
        points: any, in any order; what one gives does not depend on the others.

    Returns:
        A row for each in their order: run, merits, outcome, failure. Of a run that failed, which
        leaves the others alone, or whose start-up was aborted, merits are null.
    """
    values = zip(*(point.values for point in points), strict=True)
    split = split_of(job.scene, dict(zip(job.keys, values, strict=True)))
    in_columns = set() if split is None else set(split.rows.tolist())
    keys = list(dict.fromkeys((*job.merits, _VERDICT)))
    rows = _Rows(job, len(points))
    if split is not None:
        rows.add(judged_parts(split, {}, keys))
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
    columns = {RUN: [point.run for point in points], **rows.columns}
    return pyarrow.table([pyarrow.array(columns[f.name], f.type) for f in schema], schema=schema)


def schema_of(job: Job) -> pyarrow.Schema:
    """Of what ``judged`` gives."""
    kinds = {MeritKind.NUMBER: pyarrow.float64(), MeritKind.TRUTH: pyarrow.bool_()}
    return pyarrow.schema(
        [
            (RUN, pyarrow.int64()),
            *((merit.key, kinds[merit.kind]) for merit in merit_columns(job.merits)),
            (OUTCOME, pyarrow.string()),
            (FAILURE, pyarrow.string()),
        ]
    )


def varied_scene(job: Job, values: Sequence[Any]) -> Scene:
    """The scene of a point.

    Raises:
        SceneError: it is not valid; names key, value and what is allowed.
    """
    changes = dict(zip(job.keys, values, strict=True))
    said = ", ".join(f"{key}={value}" for key, value in changes.items())
    return changed_scene(job.scene, changes, said)


class _Rows:
    """What a job's runs have come to, in columns; of runs that are not in yet, null."""

    def __init__(self, job: Job, runs: int) -> None:
        names = (*job.merits, OUTCOME, FAILURE)
        self._merits = job.merits
        self.columns: dict[str, list[Any]] = {name: [None] * runs for name in names}

    def fail(self, place: int, failure: str) -> None:
        """A run that has failed."""
        self._without_merits(place, FAILED, failure)

    def _without_merits(self, place: int, outcome: str, why: str) -> None:
        self.columns[OUTCOME][place], self.columns[FAILURE][place] = outcome, why
        for key in self._merits:
            self.columns[key][place] = None

    def add(self, parts: Iterable[JudgedPart]) -> None:
        """Runs that are judged."""
        for part in parts:
            places = part.runs.tolist()
            kept = {OUTCOME: part.merits[_VERDICT]} | {
                key: part.merits[key] for key in self._merits
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
                    self._without_merits(place, ABORTED, aborted)
