"""A function of many things, over several processes where that is worth their start."""

import contextlib
import functools
import multiprocessing
import os
import queue
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from types import TracebackType
from typing import TypeVar, cast

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

    ``concurrent.futures.ProcessPoolExecutor`` starts its processes while it watches those that it
    has; where one is killed meanwhile, it fails or hangs. Here each process has a pipe of its own,
    at which its end is seen at any time.

    Args:
        count: how many; 1 for none but this one.
    """

    def __init__(self, count: int) -> None:
        self._count, self._warm = count, False
        self._processes: list[BaseProcess] = []
        self._idle: queue.SimpleQueue[Connection] = queue.SimpleQueue()
        self._asking: ThreadPoolExecutor | None = None

    def __enter__(self) -> "Workers":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        for process in self._processes:
            process.terminate()
        if self._asking is not None:
            self._asking.shutdown(cancel_futures=True)
        for process in self._processes:
            process.join()

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

        Raises:
            WorkerLost: a process has ended.
        """
        done, begin = 0, time.perf_counter()
        while self._asking is None and done < len(things):
            yield function(things[done])
            done += 1
            if not self._warm:  # the first of all loads kernels
                self._warm, begin = True, time.perf_counter()
            elif self._count > 1:
                spent = time.perf_counter() - begin
                if spent > TRIAL and spent * (len(things) - done) > WORTH_IT * done:
                    self._start()
        if self._asking is not None and done < len(things):
            size = max(1, min(at_a_time, (len(things) - done) // self._count))
            parts = (things[first : first + size] for first in range(done, len(things), size))
            for results in self._asking.map(functools.partial(self._ask, function), parts):
                yield from results

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        with kept_from_children():
            resource_tracker.ensure_running()  # which the first process would start otherwise
            for _ in range(self._count):
                here, there = context.Pipe()
                process = context.Process(target=_work, args=(there,), daemon=True)
                process.start()
                self._processes.append(process)
                there.close()  # so that the end of the process is the end of the pipe
                self._idle.put(here)
        self._asking = ThreadPoolExecutor(self._count)  # a thread waits for each process

    def _ask(
        self, function: Callable[[Thing], Result], things: Sequence[Thing]
    ) -> Sequence[Result]:
        connection = self._idle.get()
        try:
            connection.send((function, things))
            results, error = connection.recv()
        except (EOFError, OSError) as ended:
            raise WorkerLost(
                "a process that shared the work was ended, by a signal or for want of memory; "
                "what is done is kept, the same command goes on"
            ) from ended
        finally:
            self._idle.put(connection)
        if error is not None:
            raise error
        return cast(Sequence[Result], results)


def _work(connection: Connection) -> None:
    threading.Thread(target=_leave_with_the_parent, daemon=True).start()
    while True:
        try:
            function, things = connection.recv()
        except EOFError:
            return
        results, raised = [], None
        try:
            results = [function(thing) for thing in things]
        except Exception as error:
            raised = error
        connection.send((results, raised))


def _leave_with_the_parent() -> None:
    """Where the parent is gone nobody waits for results."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        with contextlib.suppress(OSError):
            parent.join()
        os._exit(1)
