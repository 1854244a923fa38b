"""The runs of a sweep: in chunks, over processes, with what is done kept."""

import functools
import math
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from typing import Protocol, TypeVar, overload

import numpy as np
import pyarrow

from ab_sim.design.cluster import Cluster
from ab_sim.design.judged import RUN, Job, Point, judged, modules_of, schema_of
from ab_sim.design.parts import Parts
from ab_sim.design.points import Points
from ab_sim.integrate.side_by_side import LANES
from ab_sim.workers import Workers

CHUNK_SECONDS = 1.5
"""Work of a chunk: what one costs to be sent and kept is small beside it."""
MOST_OF_A_CHUNK = 65_536
"""Runs."""
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
        things: Sequence[Thing],
        at_a_time: int,
    ) -> Iterator[Result]:
        """Results in the things' order, as they come."""


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
    with Parts(job, points.report()) as parts, executor or Workers(1) as sharing:
        done = parts.done(schema_of(job))
        missing = np.setdiff1d(np.arange(len(points)), done[RUN].to_numpy())
        progress = _Progress(len(points), len(points) - len(missing), tell)
        if isinstance(sharing, Cluster):
            sharing.modules, sharing.waiting = modules_of(job), progress.wait
        tables = [done]
        for rows in _chunks(job, points, missing, sharing):
            parts.keep(rows)
            tables.append(rows)
            progress.add(len(rows))
        whole = pyarrow.concat_tables(tables).sort_by(RUN).combine_chunks()
        parts.join(whole)
    return whole


def _chunks(
    job: Job, points: Points, missing: np.ndarray, sharing: Executor
) -> Iterator[pyarrow.Table]:
    """Some runs here, to see how long they take; then all others in chunks of that size."""
    taken, size, spent = 0, LANES, 0.0
    while taken < len(missing) and spent < ENOUGH:
        chunk = _Chunks(points, missing[taken : taken + size], size)[0]
        begin = time.perf_counter()
        yield judged(job, chunk)
        # The first ones make kernels, which the others find.
        spent = time.perf_counter() - begin if taken else 0.0
        taken += len(chunk)
        size = len(chunk) if spent >= ENOUGH else min(4 * size, MOST_OF_A_CHUNK)
    if taken < len(missing):
        whole = int(size * CHUNK_SECONDS / spent) // LANES * LANES
        size = min(max(LANES, whole), MOST_OF_A_CHUNK)
        chunks = _Chunks(points, missing[taken:], size)
        yield from sharing.each(functools.partial(judged, job), chunks, at_a_time=1)


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
