"""Runs of a study in chunks, over processes; an interrupted study continues from finished chunks.

A part is a file with finished rows, named by the hash of its content. Its folder is named by the
hash of all inputs of the rows. Files are written atomically and only once, so that parts are
neither lost nor counted twice.
"""

import contextlib
import errno
import functools
import hashlib
import math
import os
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow
from pyarrow import parquet

from ab_sim.analysis.result_cache import ResultCache, warn_once
from ab_sim.base.errors import InputError
from ab_sim.base.files import lock, write_whole
from ab_sim.base.presentation import Progress
from ab_sim.base.workers import Workers
from ab_sim.design.cluster import Cluster
from ab_sim.design.judged import RUN, Job, Point, judged, modules_of, schema_of
from ab_sim.design.points import Points
from ab_sim.engine.stepping.side_by_side import LANES

CHUNK_SECONDS = 1.5
"""Duration of a chunk of runs [s], long compared with the time to send and store the results."""
_MOST_OF_A_CHUNK = 65_536
"""Largest number of runs in a chunk."""
_FEWEST = 4
"""Number of chunks into which the remaining runs are divided at least, to share work evenly."""
ENOUGH = 0.2
"""Least duration of a chunk from which the time of a run is derived [s]."""
Executor = Workers | Cluster
"""Executor of calls: processes on this machine, or workers of a Dask cluster."""
_SUFFIX = ".parquet"
"""Ending of the files of parts."""


class Parts:
    """Finished rows of a sweep, a context manager.

    Parameters
    ----------
    job
        Common data of the runs.
    points
        Defining values of the points, JSON-able.

    Raises
    ------
    InputError
        Another process is computing the same sweep.
    """

    def __init__(self, job: Job, points: dict[str, Any]) -> None:
        numbers = {"keys": list(job.keys), "metrics": list(job.metrics), "points": points}
        self._folder = ResultCache(judged).folder_of(job.scene, modules_of(job), **numbers)
        self._lock: int | None = None

    def __enter__(self) -> "Parts":
        if self._folder is not None:
            try:
                self._folder.mkdir(mode=0o700, exist_ok=True)
                self._lock = os.open(self._folder / "lock", os.O_RDWR | os.O_CREAT, 0o600)
                is_locked = lock(self._lock)
            except OSError as error:
                self._warn(error)
                self._folder, is_locked = None, True
            if not is_locked:
                self.__exit__()
                raise InputError(
                    "another process is computing the same sweep; wait for it, or stop it: its "
                    "finished runs are kept"
                )
        return self

    def __exit__(self, *_: object) -> None:
        if self._lock is not None:
            os.close(self._lock)

    def done(self, schema: pyarrow.Schema) -> pyarrow.Table:
        """Return all valid stored rows, one per run, by run; damaged parts are left out."""
        files = sorted(self._folder.glob(f"*{_SUFFIX}")) if self._folder is not None else []
        tables = [table_here for file in files if (table_here := _read(file, schema)) is not None]
        whole = pyarrow.concat_tables([schema.empty_table(), *tables])
        return whole.take(np.unique(whole[RUN].to_numpy(), return_index=True)[1])

    def keep(self, rows: pyarrow.Table) -> None:
        """Store a part; log one line and continue if that is not possible."""
        if self._folder is None:
            return
        sink = pyarrow.BufferOutputStream()
        parquet.write_table(rows, sink, compression="zstd")
        content = sink.getvalue().to_pybytes()
        try:
            write_whole(self._folder / (_digest(content) + _SUFFIX), content)
        except OSError as error:
            self._warn(error)

    def join(self, rows: pyarrow.Table) -> None:
        """Replace many part files by one with ``rows``: a later start reads a single file."""
        if self._folder is None:
            return
        before = set(self._folder.glob(f"*{_SUFFIX}"))
        if len(before) < 2:
            return
        self.keep(rows)
        # Remove the old parts only if the new one has been written: a disk may be full.
        if set(self._folder.glob(f"*{_SUFFIX}")) - before:
            for file in before:
                with contextlib.suppress(OSError):
                    file.unlink()

    def _warn(self, error: OSError) -> None:
        """Log once that parts cannot be stored."""
        reason = error.strerror or errno.errorcode.get(error.errno or 0, "")
        warn_once(f"{self._folder}: finished runs cannot be stored there: {reason}")


def _digest(content: bytes) -> str:
    """Return the hash of a part's content, which is its file name."""
    return hashlib.sha256(content).hexdigest()[:32]


def _read(file: Path, schema: pyarrow.Schema) -> pyarrow.Table | None:
    """Return the rows of a file; None if its content does not match its name."""
    try:
        content = file.read_bytes()
        if _digest(content) != file.stem:
            return None
        table = parquet.read_table(pyarrow.BufferReader(content))
    except (OSError, pyarrow.ArrowException):
        return None
    return table if table.schema.equals(schema) else None


def rows_of(
    job: Job,
    points: Points,
    executor: Executor,
    tell: Progress | None = None,
) -> pyarrow.Table:
    """Return rows of all points in their order; see ``judged``.

    Rows do not depend on the distribution of the work or on restarts. Results of earlier calls with
    the same job and points are reused.

    Parameters
    ----------
    job
        Common data of the runs.
    points
        Values of the keys in each run.
    executor
        Executor for the work, entered by the caller.
    tell
        Progress callback; an exception in it ends the work, and finished rows are kept.

    Raises
    ------
    InputError
        Another process is computing the same rows.
    WorkerLost
        A worker process was lost.
    ClusterUnusable
        See ``Cluster``.
    """
    with StudyRuns(job, points.report(), executor) as runs:
        whole = runs.rows(points, range(len(points)), tell)
        runs.join(whole)
    return whole


class StudyRuns:
    """Runs of a study, a context manager; see ``rows_of``.

    Parameters
    ----------
    job
        Common data of the runs.
    study
        Defining values of all points of the study, JSON-able.
    executor
        Executor for the work, entered by the caller.
    """

    def __init__(self, job: Job, study: dict[str, Any], executor: Executor) -> None:
        self._job, self._executor = job, executor
        self._parts = Parts(job, study)
        self._seconds: float | None = None
        """Duration of a run [s], once known."""

    def __enter__(self) -> "StudyRuns":
        self._parts.__enter__()
        if isinstance(self._executor, Cluster):
            self._executor.modules = modules_of(self._job)
        self._done = self._parts.done(schema_of(self._job))
        return self

    def __exit__(self, *raised: Any) -> None:
        self._parts.__exit__(*raised)

    def rows(self, points: Points, runs: range, tell: Progress | None = None) -> pyarrow.Table:
        """Return the rows of some runs, ordered by number; finished runs are reused.

        Parameters
        ----------
        points
            Points of the study; a number always denotes the same point.
        runs
            Range of their numbers.
        tell
            See ``rows_of``.
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
        """Yield rows of a few timed runs, then of all others in chunks of suitable size.

        The first runs are computed here, in growing chunks, until the time of a run is known. Quick
        studies thus need no other process. The rest is divided among the workers.
        """
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
            size = min(4 * size, _MOST_OF_A_CHUNK)
        if taken < len(missing) and self._seconds is not None:
            most = int(CHUNK_SECONDS / self._seconds)
            size = min(most, math.ceil((len(missing) - taken) / _FEWEST), _MOST_OF_A_CHUNK)
            size = max(LANES, math.ceil(size / LANES) * LANES)
            chunks = _Chunks(points, missing[taken:], size)
            yield from self._executor.each(functools.partial(judged, self._job), chunks)


class _Chunks(Sequence[list[Point]]):
    """Points in chunks, created on access because there may be millions.

    Parameters
    ----------
    points
        Values of the keys in each run.
    runs
        Numbers of the runs, shape (n,).
    size
        Number of runs in a chunk.
    """

    def __init__(self, points: Points, runs: np.ndarray, size: int) -> None:
        self._points, self._runs, self._size = points, runs, size

    def __len__(self) -> int:
        return math.ceil(len(self._runs) / self._size)

    def __getitem__(self, index: int | slice) -> Any:
        if isinstance(index, slice):
            return [self[k] for k in range(*index.indices(len(self)))]
        if not 0 <= index < len(self):
            raise IndexError(index)
        runs = self._runs[index * self._size : (index + 1) * self._size].tolist()
        return [Point(run, self._points.at(run)) for run in runs]


class _Progress:
    """Progress of a study, with rate and remaining time.

    Parameters
    ----------
    runs
        Number of all runs.
    already_done
        Number of runs that are finished at the start.
    tell
        Progress callback; None for none.
    """

    def __init__(self, runs: int, already_done: int, tell: Progress | None) -> None:
        self._runs, self._done, self._tell = runs, already_done, tell
        self._newest = [(time.monotonic(), already_done)]
        self._report("starting")

    def wait(self, what: str | None) -> None:
        """Report the reason of a wait; None repeats the last report."""
        self._report(what or self._text)

    def add(self, runs: int) -> None:
        """Report that further runs are finished; the rate is that of the newest 20 reports."""
        self._done += runs
        self._newest = [*self._newest[-20:], (time.monotonic(), self._done)]
        (then, before), (now, done) = self._newest[0], self._newest[-1]
        rate = (done - before) / max(now - then, 1e-9)
        remaining = (self._runs - self._done) / rate
        self._report(f"{rate:.3g} runs/s, {_time_text(remaining)} left")

    def _report(self, text: str) -> None:
        """Pass a text and the number of finished runs to the callback, and keep the text."""
        self._text = text
        if self._tell is not None:
            self._tell(text, self._done, self._runs)


def _time_text(seconds: float) -> str:
    """Return a duration as text in h, min or s."""
    for unit, length in (("h", 3600.0), ("min", 60.0)):
        if seconds >= 1.5 * length:
            return f"{seconds / length:.1f} {unit}"
    return f"{seconds:.0f} s"
