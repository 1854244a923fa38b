"""Runs of a scene with other values, each to a row of merits."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import pyarrow

from ab_sim.analysis.merits import merits_of
from ab_sim.analysis.merits.merit import Merit, MeritKind, merits_named
from ab_sim.batch.prepared_run import BatchRun, PreparedRun, steps_of
from ab_sim.batch.simulate import run_prepared
from ab_sim.errors import InputError, SceneError
from ab_sim.scene.load import changed_scene
from ab_sim.scene.model import Scene

RUN, OUTCOME, FAILURE = "run", "outcome", "failure"
"""Columns beside keys and merits."""
FAILED, CIRCULATES, CHANGING, SETTLED = "failed", "circulates", "still changing", "settled"
"""How a run ended: it did not; with balls that go round the race; with a whirl that still rises or
falls, and matters; else."""
OUTCOMES = (SETTLED, CHANGING, CIRCULATES, FAILED)
SAMPLES_AT_ONCE = 300_000
"""Of all runs that are in memory at a time: some 50 MB."""
_SAY_HOW_IT_ENDED = ("settled", "circulating_balls")


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


def merit_columns(keys: Iterable[str]) -> list[Merit[Any]]:
    """Merits that can be columns.

    Raises:
        InputError: there is no such merit, or it is no number; names it.
    """
    found = merits_named(keys)
    for merit in found:
        if merit.kind is MeritKind.STRUCTURE:
            raise InputError(
                f"merit {merit.key!r}: is a list, not a number; `ab-sim merits` says which are"
            )
    return found


def judged(job: Job, points: Sequence[Point]) -> pyarrow.Table:
    """Run points of a job.

    Args:
        job: what they have in common.
        points: any, in any order; what one gives does not depend on the others.

    Returns:
        A row for each in their order: run, merits, outcome, failure. Of a run that failed, which
        leaves the others alone, merits are null.
    """
    rows: list[dict[str, Any]] = []
    for group in _groups(job, points):
        rows += _rows(job, group)
    return pyarrow.Table.from_pylist(rows, schema_of(job))


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


def _groups(job: Job, points: Sequence[Point]) -> Iterator[Sequence[Point]]:
    """As many at a time as their samples have room."""
    most = max(8, SAMPLES_AT_ONCE // steps_of(job.scene) // 8 * 8)
    for first in range(0, len(points), most):
        yield points[first : first + most]


def _rows(job: Job, points: Sequence[Point]) -> list[dict[str, Any]]:
    prepared: dict[int, PreparedRun] = {}
    failures: dict[int, str] = {}
    for point in points:
        try:
            prepared[point.run] = PreparedRun(varied_scene(job, point.values))
        except SceneError as error:
            failures[point.run] = str(error)
    done = run_prepared(list(prepared.values()), every=1).runs if prepared else ()
    found = {run: _row(job, each) for run, each in zip(prepared, done, strict=True)}
    failed = {run: {OUTCOME: FAILED, FAILURE: said} for run, said in failures.items()}
    return [{RUN: point.run, **(found | failed)[point.run]} for point in points]


def _row(job: Job, run: BatchRun) -> Mapping[str, Any]:
    if run.failure:
        return {OUTCOME: FAILED, FAILURE: run.failure}
    merits = merits_of(run.trajectory, run.scene, {*job.merits, *_SAY_HOW_IT_ENDED})
    settled, circulating = (merits[key] for key in _SAY_HOW_IT_ENDED)
    ended = CIRCULATES if circulating is not None else SETTLED if settled else CHANGING
    return {**{key: merits[key] for key in job.merits}, OUTCOME: ended}
