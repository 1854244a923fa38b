"""A function of many things, over several processes where that is worth their start."""

import concurrent.futures
import contextlib
import multiprocessing
import os
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import resource_tracker
from types import TracebackType
from typing import TypeVar

from ab_sim.errors import AbSimError
from ab_sim.interruption import kept_from_children

AT_A_TIME = 16
"""Things that a process is given, unless told."""
TRIAL = 0.5
"""For so long this process works alone, to see how long it would take [s]."""
WORTH_IT = 20.0
"""Work that is longer is shared [s]: processes take some seconds to start."""

Thing = TypeVar("Thing")
Result = TypeVar("Result")


class WorkerLost(AbSimError):
    """A process that shared the work is gone."""

    exit_code = 1


class Workers:
    """Processes that are there until the end of a ``with``; started where work takes long.

    Threads would wait for each other: a point of a map is mostly Python. Processes are spawned, for
    kernels hold locks and threads that a fork would break, so a program that uses more than one
    needs the usual ``if __name__ == "__main__":``.

    Args:
        count: how many; 1 for none but this one.
    """

    def __init__(self, count: int) -> None:
        self._count, self._warm = count, False
        self._pool: concurrent.futures.ProcessPoolExecutor | None = None

    def __enter__(self) -> "Workers":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)

    def each(
        self,
        function: Callable[[Thing], Result],
        things: Sequence[Thing],
        at_a_time: int = AT_A_TIME,
    ) -> Iterator[Result]:
        """Results in the things' order, as they come.

        Args:
            function: of a module, or partial of such a one.
            things: what it is called with.
            at_a_time: how many of them a process is given.
        """
        done, begin = 0, time.perf_counter()
        while self._pool is None and done < len(things):
            yield function(things[done])
            done += 1
            if not self._warm:  # the first of all loads kernels
                self._warm, begin = True, time.perf_counter()
            elif self._count > 1:
                spent = time.perf_counter() - begin
                if spent > TRIAL and spent * (len(things) - done) > WORTH_IT * done:
                    with kept_from_children():  # before the pool, which would start it
                        resource_tracker.ensure_running()
                    self._pool = concurrent.futures.ProcessPoolExecutor(
                        self._count, multiprocessing.get_context("spawn"), _begin
                    )
        if self._pool is not None and done < len(things):
            chunk = max(1, min(at_a_time, (len(things) - done) // self._count))
            try:
                with kept_from_children():  # this is where processes start
                    results = self._pool.map(function, things[done:], chunksize=chunk)
                yield from results
            except BrokenProcessPool as error:
                raise WorkerLost(
                    "a process that shared the work was ended, by a signal or for want of memory; "
                    "what is done is kept, the same command goes on"
                ) from error


def _begin() -> None:
    """Where the parent is gone nobody waits for results."""
    threading.Thread(target=_leave_with_the_parent, daemon=True).start()


def _leave_with_the_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        with contextlib.suppress(OSError):
            parent.join()
        os._exit(1)
