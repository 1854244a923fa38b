"""The runs of a study: in chunks, over processes, with what is done kept."""

import functools
import math
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from types import TracebackType
from typing import Any, Protocol, TypeVar, overload

import numpy as np
import pyarrow

from ab_sim.design.cluster import Cluster
from ab_sim.design.judged import RUN, Job, Point, judged, modules_of, schema_of
from ab_sim.design.parts import Parts
from ab_sim.design.points import Points
from ab_sim.stepping.side_by_side import LANES
from ab_sim.workers import Workers

CHUNK_SECONDS = 1.5
"""Work of a chunk: what one costs to be sent and kept is small beside it."""
MOST_OF_A_CHUNK = 65_536
"""Runs."""
FEWEST = 4
"""Chunks, so that two processes have as much to do, where there is work for so many."""
ENOUGH = 0.2
"""s of work from which a run's time is known."""
Tell = Callable[[str, int, int], None]
"""Called with what is done now, how many runs are done, and of how many."""
Thing = TypeVar("Thing")
Result = TypeVar("Result")


class Executor(Protocol):
    """Where chunks are worked on; ``Workers`` is one, ``Cluster`` another."""

    def each(
        self,
        function: Callable[[Thing], Result],
        items: Sequence[Thing],
        chunk: int,
    ) -> Iterator[Result]:
        """Results in the order of the items, as they are computed."""


def rows_of(
    job: Job,
    points: Points,
    executor: AbstractContextManager[Executor] | None = None,
    tell: Tell | None = None,
) -> pyarrow.Table:
    """Rows of all points, in their order; see ``judged``.

    They do not depend on how the work is shared, or on how often it was begun again: what another
    call with the same job and points has done is taken over.

    Args:
        job: what the runs have in common.
        points: of the runs.
        executor: shares the work; None: this process does it.
        tell: what it raises ends the work; what is done is kept.

    Raises:
        InputError: another process computes the same rows.
        WorkerLost: a process that shared the work is gone.
        ClusterUnusable: see ``Cluster``.
    """
    with StudyRuns(job, points.report(), executor) as runs:
        whole = runs.rows(points, range(len(points)), tell)
        runs.join(whole)
    return whole


class StudyRuns:
    """The runs of a study, to be used in a ``with``; see ``rows_of``.

    Args:
        job: what the runs have in common.
        study: what all its points follow from, JSON-able.
        executor: shares the work; None: this process does it.
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
        """Of a run, when it is known."""

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

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            self._sharing.__exit__(kind, error, trace)
        finally:
            self._parts.__exit__(kind, error, trace)

    def rows(self, points: Points, runs: range, tell: Tell | None = None) -> pyarrow.Table:
        """Rows of some points in the order of their numbers; those that are done, as they were.

        Args:
            points: of the study; a number is always the same point.
            runs: their numbers, one after the other.
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
        """Keep rows as one part, if they are all that is known of the study."""
        if np.isin(self._done[RUN].to_numpy(), rows[RUN].to_numpy()).all():
            self._parts.join(rows)

    def _chunks(self, points: Points, missing: np.ndarray) -> Iterator[pyarrow.Table]:
        """Some runs here, to see how long they take; then all others in chunks of that size."""
        taken, size = 0, LANES
        while taken < len(missing) and self._seconds is None:
            chunk = _Chunks(points, missing[taken : taken + size], size)[0]
            begin = time.perf_counter()
            yield judged(self._job, chunk)
            spent = time.perf_counter() - begin
            # The first ones make kernels, which the others find.
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
    """Points in chunks, each made when it is asked for: of all there may be millions."""

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
    """Says how fast it goes, and how long it will take."""

    def __init__(self, runs: int, known: int, tell: Tell | None) -> None:
        self._runs, self._done, self._tell = runs, known, tell
        self._newest = [(time.monotonic(), known)]
        self._say("starting")

    def wait(self, what: str | None) -> None:
        """Say what is waited for; None: what was said."""
        self._say(what or self._said)

    def add(self, runs: int) -> None:
        self._done += runs
        self._newest = [*self._newest[-20:], (time.monotonic(), self._done)]
        (then, before), (now, done) = self._newest[0], self._newest[-1]
        rate = (done - before) / max(now - then, 1e-9)
        left = (self._runs - self._done) / rate
        self._say(f"{rate:.3g} runs/s, {_time_text(left)} left")

    def _say(self, what: str) -> None:
        self._said = what
        if self._tell is not None:
            self._tell(what, self._done, self._runs)


def _time_text(seconds: float) -> str:
    for unit, length in (("h", 3600.0), ("min", 60.0)):
        if seconds >= 1.5 * length:
            return f"{seconds / length:.1f} {unit}"
    return f"{seconds:.0f} s"
