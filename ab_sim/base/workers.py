"""Worker processes that apply a function to many items, started only if the work takes long."""

import contextlib
import multiprocessing
import os
import queue
import signal
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any, TypeVar, cast

from ab_sim.base.errors import AbSimError
from ab_sim.base.interruption import kept_from_children
from ab_sim.base.plug_ins import load_files, loaded_files

TRIAL = 0.5
"""Time for which this process works alone before it estimates the total time [s]."""
_AHEAD = 3
"""Number of parts that each process gets in advance, before results are awaited."""
WORTH_IT = 20.0
"""Estimated time above which processes are started, which takes some seconds [s]."""

KEPT = "finished work is kept, the same command continues it"
"""Message for work that ends early; finished work is on disk."""

Item = TypeVar("Item")
Result = TypeVar("Result")


class WorkerLost(AbSimError):
    """A worker process has ended."""

    exit_code = 1


class Workers:
    """Context manager with worker processes, which are started when the work takes long.

    Threads are not used, because they would compete for Python's lock. Processes are spawned,
    because a fork would break locks and threads of the machine code. Therefore a program that uses
    several processes needs ``if __name__ == "__main__":``.

    ``concurrent.futures.ProcessPoolExecutor`` is not used, because it fails or hangs if a process
    is killed while it starts another. Here each process has its own pipe, whose end shows that the
    process has ended.

    Parameters
    ----------
    count
        Number of processes; 1: work in this process only.
    """

    def __init__(self, count: int) -> None:
        self._count, self._warm, self._spent = count, False, 0.0
        self._processes: list[BaseProcess] = []
        self._idle: queue.SimpleQueue[Any] = queue.SimpleQueue()  # connections to processes
        self._threads: ThreadPoolExecutor | None = None

    def __enter__(self) -> "Workers":
        return self

    def __exit__(self, *_: object) -> None:
        for process in self._processes:
            process.terminate()
        if self._threads is not None:
            self._threads.shutdown(cancel_futures=True)
        for process in self._processes:
            process.join()

    def each(
        self,
        function: Callable[[Item], Result],
        items: Sequence[Item],
        chunk: int = 1,
    ) -> Iterator[Result]:
        """Yield the results of items as they are computed, in the order of the items.

        Parameters
        ----------
        function
            Function of a module, or a ``partial`` of one.
        items
            Arguments of the function, one for each call.
        chunk
            Number of items that a process gets at a time.

        Raises
        ------
        WorkerLost
            A worker process has ended.
        """
        done, spent = 0, 0.0
        while self._threads is None and done < len(items):
            begin = time.perf_counter()
            result = function(items[done])
            took, done = time.perf_counter() - begin, done + 1
            yield result
            if not self._warm:  # the first item loads the kernels
                self._warm = True
                continue
            spent, self._spent = spent + took, self._spent + took
            ahead = spent * (len(items) - done) / done
            # If earlier calls have taken long, it is likely that more will follow.
            if self._count > 1 and spent > TRIAL and max(ahead, self._spent) > WORTH_IT:
                self._start()
        if self._threads is not None and done < len(items):
            size = max(1, min(chunk, (len(items) - done) // self._count))
            parts = (items[first : first + size] for first in range(done, len(items), size))
            yield from self._shared(function, parts)

    def _shared(
        self, function: Callable[[Item], Result], parts: Iterator[Sequence[Item]]
    ) -> Iterator[Result]:
        """Yield results of parts; only some parts are sent in advance, as there may be millions."""
        assert self._threads is not None
        sent: deque[Future[Sequence[Result]]] = deque()
        for part in parts:
            sent.append(self._threads.submit(self._request, function, part))
            if len(sent) >= _AHEAD * self._count:
                yield from sent.popleft().result()
        while sent:
            yield from sent.popleft().result()

    def _start(self) -> None:
        """Start the processes, each with a pipe, and a thread per process that waits for it."""
        context = multiprocessing.get_context("spawn")
        if sys.platform != "win32":
            with kept_from_children():
                resource_tracker.ensure_running()  # otherwise the first process would start it
        with kept_from_children():  # again, because starting the tracker unblocks the signals
            for _ in range(self._count):
                here, there = context.Pipe()
                process = context.Process(target=_work, args=(there, loaded_files()), daemon=True)
                process.start()
                self._processes.append(process)
                there.close()  # so that the end of the process is the end of the pipe
                self._idle.put(here)
        self._threads = ThreadPoolExecutor(self._count)  # a thread waits for each process

    def _request(
        self, function: Callable[[Item], Result], items: Sequence[Item]
    ) -> Sequence[Result]:
        """Let an idle process apply a function to items, and wait for the results."""
        connection = self._idle.get()
        try:
            connection.send((function, items))
            results, error = connection.recv()
        except (EOFError, OSError) as ended:
            raise WorkerLost(
                f"a worker process was ended, by a signal or because memory was exhausted; {KEPT}"
            ) from ended
        finally:
            self._idle.put(connection)
        if error is not None:
            raise error
        return cast(Sequence[Result], results)


def _work(connection: Connection, files: Sequence[str]) -> None:
    """Apply functions to items, as requested through a pipe; main function of a process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Windows cannot block it, as the parent does
    threading.Thread(target=_exit_with_parent, daemon=True).start()
    load_files(files)
    while True:
        try:
            function, items = connection.recv()
        except EOFError:
            return
        results, raised = [], None
        try:
            results = [function(item) for item in items]
        except Exception as error:
            raised = error
        connection.send((results, raised))


def _exit_with_parent() -> None:
    """End this process when its parent has ended."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        with contextlib.suppress(OSError):
            parent.join()
        os._exit(1)
