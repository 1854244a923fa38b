"""Runs of a study in chunks, over processes, with cached results."""

import functools
import math
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from typing import Any, Protocol, TypeVar, overload

import numpy as np
import pyarrow

from ab_sim.base.presentation import Progress
from ab_sim.base.workers import Workers
from ab_sim.design.cluster import Cluster
from ab_sim.design.judged import RUN, Job, Point, judged, modules_of, schema_of
from ab_sim.design.parts import Parts
from ab_sim.design.points import Points
from ab_sim.engine.stepping.side_by_side import LANES

CHUNK_SECONDS = 1.5
"""Duration of a chunk [s], long compared with the cost of sending and storing it."""
MOST_OF_A_CHUNK = 65_536
"""Largest number of runs in a chunk."""
FEWEST = 4
"""Least number of chunks, so that two processes have equal work if there is enough of it."""
ENOUGH = 0.2
"""Least duration of a chunk from which the time of a run is derived [s]."""
Thing = TypeVar("Thing")
Result = TypeVar("Result")


class Executor(Protocol):
    """Interface of executors; ``Workers`` and ``Cluster`` implement it."""

    def each(
        self,
        function: Callable[[Thing], Result],
        items: Sequence[Thing],
        chunk: int,
    ) -> Iterator[Result]:
        """Yield results in the order of the items."""


def rows_of(
    job: Job,
    points: Points,
    executor: AbstractContextManager[Executor] | None = None,
    tell: Progress | None = None,
) -> pyarrow.Table:
    """Return rows of all points in their order; see ``judged``.

    Rows do not depend on the distribution of the work or on restarts. Results of earlier calls with
    the same job and points are reused.

    Args:
        job: common data of the runs.
        points: values of the keys in each run.
        executor: executor for the work; None for this process.
        tell: progress callback; an exception in it ends the work, and finished rows are kept.

    Raises:
        InputError: another process is computing the same rows.
        WorkerLost: a worker process was lost.
        ClusterUnusable: see ``Cluster``.
    """
    with StudyRuns(job, points.report(), executor) as runs:
        whole = runs.rows(points, range(len(points)), tell)
        runs.join(whole)
    return whole


class StudyRuns:
    """Runs of a study, a context manager; see ``rows_of``.

    Args:
        job: common data of the runs.
        study: defining values of all points of the study, JSON-able.
        executor: executor for the work; None for this process.
    """

    def __init__(
        self,
        job: Job,
        study: dict[str, Any],
        executor: AbstractContextManager[Executor] | None = None,
    ) -> None:
        self._job, self._sharing = job, executor or Workers(1)
        self._parts = Parts(job, study)
        self._seconds: float | None = None
        """Duration of a run [s], once known."""

    def __enter__(self) -> "StudyRuns":
        self._parts.__enter__()
        try:
            self._executor = self._sharing.__enter__()
        except BaseException:
            self._parts.__exit__(None, None, None)
            raise
        if isinstance(self._executor, Cluster):
            self._executor.modules = modules_of(self._job)
        self._done = self._parts.done(schema_of(self._job)).sort_by(RUN)
        return self

    def __exit__(self, *raised: Any) -> None:
        try:
            self._sharing.__exit__(*raised)
        finally:
            self._parts.__exit__(*raised)

    def rows(self, points: Points, runs: range, tell: Progress | None = None) -> pyarrow.Table:
        """Return rows of some points in the order of their numbers; finished ones are reused.

        Args:
            points: points of the study; a number always denotes the same point.
            runs: range of their numbers.
            tell: see ``rows_of``.
        """
        first, end = np.searchsorted(self._done[RUN].to_numpy(), (runs.start, runs.stop))
        chosen = self._done.slice(first, end - first)
        missing = np.setdiff1d(np.arange(runs.start, runs.stop), chosen[RUN].to_numpy())
        progress = _Progress(len(runs), len(chosen), tell)
        if isinstance(self._executor, Cluster):
            self._executor.waiting = progress.wait
        tables = [chosen]
        for rows in self._chunks(points, missing):
            self._parts.keep(rows)
            tables.append(rows)
            progress.add(len(rows))
        return pyarrow.concat_tables(tables).sort_by(RUN).combine_chunks()

    def join(self, rows: pyarrow.Table) -> None:
        """Store rows as one part, if they include all known rows of the study."""
        if np.isin(self._done[RUN].to_numpy(), rows[RUN].to_numpy()).all():
            self._parts.join(rows)

    def _chunks(self, points: Points, missing: np.ndarray) -> Iterator[pyarrow.Table]:
        """Yield rows of a few timed runs, then of all others in chunks of suitable size."""
        taken, size = 0, LANES
        while taken < len(missing) and self._seconds is None:
            chunk = _Chunks(points, missing[taken : taken + size], size)[0]
            begin = time.perf_counter()
            yield judged(self._job, chunk)
            spent = time.perf_counter() - begin
            # The first chunk compiles kernels, so its time is not representative.
            if taken and spent >= ENOUGH:
                self._seconds = spent / len(chunk)
            taken += len(chunk)
            size = min(4 * size, MOST_OF_A_CHUNK)
        if taken < len(missing) and self._seconds is not None:
            long = int(CHUNK_SECONDS / self._seconds)
            size = min(long, math.ceil((len(missing) - taken) / FEWEST), MOST_OF_A_CHUNK)
            size = max(LANES, math.ceil(size / LANES) * LANES)
            chunks = _Chunks(points, missing[taken:], size)
            yield from self._executor.each(functools.partial(judged, self._job), chunks, chunk=1)


class _Chunks(Sequence[list[Point]]):
    """Points in chunks, created on access because there may be millions."""

    def __init__(self, points: Points, runs: np.ndarray, size: int) -> None:
        self._points, self._runs, self._size = points, runs, size

    def __len__(self) -> int:
        return math.ceil(len(self._runs) / self._size)

    @overload
    def __getitem__(self, index: int) -> list[Point]: ...

    @overload
    def __getitem__(self, index: slice) -> list[list[Point]]: ...

    def __getitem__(self, index: int | slice) -> list[Point] | list[list[Point]]:
        if isinstance(index, slice):
            return [self[k] for k in range(*index.indices(len(self)))]
        if not 0 <= index < len(self):
            raise IndexError(index)
        runs = self._runs[index * self._size : (index + 1) * self._size].tolist()
        return [Point(run, self._points.at(run)) for run in runs]


class _Progress:
    """Progress with rate and remaining time."""

    def __init__(self, runs: int, already_done: int, tell: Progress | None) -> None:
        self._runs, self._done, self._tell = runs, already_done, tell
        self._newest = [(time.monotonic(), already_done)]
        self._say("starting")

    def wait(self, what: str | None) -> None:
        """Report the reason of a wait; None repeats the last report."""
        self._say(what or self._said)

    def add(self, runs: int) -> None:
        self._done += runs
        self._newest = [*self._newest[-20:], (time.monotonic(), self._done)]
        (then, before), (now, done) = self._newest[0], self._newest[-1]
        rate = (done - before) / max(now - then, 1e-9)
        remaining = (self._runs - self._done) / rate
        self._say(f"{rate:.3g} runs/s, {_time_text(remaining)} left")

    def _say(self, what: str) -> None:
        self._said = what
        if self._tell is not None:
            self._tell(what, self._done, self._runs)


def _time_text(seconds: float) -> str:
    for unit, length in (("h", 3600.0), ("min", 60.0)):
        if seconds >= 1.5 * length:
            return f"{seconds / length:.1f} {unit}"
    return f"{seconds:.0f} s"
