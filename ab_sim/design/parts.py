"""Finished rows, stored on disk in parts, so that an interrupted sweep continues.

A part is a file named by the hash of its content. Its folder is named by the hash of all inputs of
the rows. Files are written atomically and only once, so that parts are neither lost nor counted
twice.
"""

import contextlib
import errno
import hashlib
import logging
import os
from pathlib import Path
from typing import Any

import pyarrow
from pyarrow import parquet

from ab_sim.analysis.result_cache import ResultCache
from ab_sim.base.errors import InputError, visible
from ab_sim.base.files import lock, write_whole
from ab_sim.design.judged import RUN, Job, judged, modules_of

SUFFIX = ".parquet"


class Parts:
    """Finished rows of a sweep, a context manager.

    Args:
        job: common data of the runs.
        points: defining values of the points, JSON-able.

    Raises:
        InputError: another process is computing the same sweep.
    """

    def __init__(self, job: Job, points: dict[str, Any]) -> None:
        numbers = {"keys": list(job.keys), "metrics": list(job.metrics), "points": points}
        self._folder = ResultCache(judged).folder_of(job.scene, modules_of(job), **numbers)
        self._lock: int | None = None
        self._complained = False

    def __enter__(self) -> "Parts":
        if self._folder is not None:
            try:
                self._folder.mkdir(mode=0o700, exist_ok=True)
                self._lock = os.open(self._folder / "lock", os.O_RDWR | os.O_CREAT, 0o600)
            except OSError as error:
                self._complain(error)
                self._folder = None
        if self._lock is not None:
            try:
                lock(self._lock)
            except BlockingIOError:
                os.close(self._lock)
                raise InputError(
                    "another process is computing the same sweep; wait for it, or stop it: its "
                    "finished runs are kept"
                ) from None
        return self

    def __exit__(self, *_: object) -> None:
        if self._lock is not None:
            os.close(self._lock)

    def done(self, schema: pyarrow.Schema) -> pyarrow.Table:
        """Return all valid stored rows, one per run; damaged parts are left out."""
        files = sorted(self._folder.glob(f"*{SUFFIX}")) if self._folder is not None else []
        tables = [table_here for file in files if (table_here := _read(file, schema)) is not None]
        whole = pyarrow.concat_tables([schema.empty_table(), *tables])
        runs = whole[RUN].to_numpy()
        return whole if len(set(runs.tolist())) == len(runs) else _once(whole)

    def keep(self, rows: pyarrow.Table) -> None:
        """Store a part; log one line and continue if that is not possible."""
        if self._folder is None:
            return
        sink = pyarrow.BufferOutputStream()
        parquet.write_table(rows, sink, compression="zstd")
        content = sink.getvalue().to_pybytes()
        try:
            write_whole(self._folder / (_digest(content) + SUFFIX), content)
        except OSError as error:
            self._complain(error)

    def join(self, rows: pyarrow.Table) -> None:
        """Replace many parts by one with all rows."""
        if self._folder is None:
            return
        before = set(self._folder.glob(f"*{SUFFIX}"))
        if len(before) < 2:
            return
        self.keep(rows)
        if set(self._folder.glob(f"*{SUFFIX}")) - before:
            for file in before:
                with contextlib.suppress(OSError):
                    file.unlink()

    def _complain(self, error: OSError) -> None:
        if not self._complained:
            self._complained = True
            reason = error.strerror or errno.errorcode.get(error.errno or 0, "")
            message = f"{self._folder}: finished runs cannot be stored there: {reason}"
            logging.getLogger("ab_sim").warning(visible(message))


def _digest(content: bytes) -> str:
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


def _once(rows: pyarrow.Table) -> pyarrow.Table:
    first = {int(run): place for place, run in reversed(list(enumerate(rows[RUN].to_pylist())))}
    return rows.take(sorted(first.values()))
