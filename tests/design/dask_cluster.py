"""Dask cluster of processes on this machine, reached over loopback only."""

import importlib
import os
import socket
import sys
import time
from multiprocessing.context import ForkServerProcess
from pathlib import Path
from types import TracebackType

from tests.forked import forked

IDLE = {
    "DASK_DISTRIBUTED__DIAGNOSTICS__NVML": "False",
    "DASK_DISTRIBUTED__WORKER__PROFILE__ENABLED": "False",
    "DASK_DISTRIBUTED__ADMIN__TICK__INTERVAL": "1s",
}
"""Settings that keep idle processes from using CPU time."""
BEGINS = 60.0
"""Time within which a scheduler listens on a busy machine [s]."""


class DaskCluster:
    """Scheduler and workers in forked processes; a context manager.

    Parameters
    ----------
    folder
        Folder for the cluster's files.
    workers
        Number of workers, with one thread each.
    scheduler
        Settings of Dask's scheduler.
    """

    def __init__(self, folder: Path, workers: int = 0, **scheduler: str) -> None:
        self._settings = {f"DASK_DISTRIBUTED__SCHEDULER__{k}": v for k, v in scheduler.items()}
        self._folder = folder / "cluster"
        self._folder.mkdir()
        self.port = free_port()
        self.processes: list[ForkServerProcess] = []
        self.workers: list[ForkServerProcess] = []
        self.begin()
        for _ in range(workers):
            self.add_worker()

    @property
    def address(self) -> str:
        return f"tcp://127.0.0.1:{self.port}"

    def begin(self) -> None:
        """Start the scheduler, at the same address again after it was killed."""
        self.scheduler = self._started(
            "scheduler", "--port", str(self.port), "--no-show", **self._settings
        )
        until = time.monotonic() + BEGINS
        while not listens(self.port):
            assert self.scheduler.is_alive() and time.monotonic() < until, self.said()
            time.sleep(0.05)

    def add_worker(self, path: Path | None = None, without: str = "", **environment: str) -> None:
        """Start a worker without a nanny, which would restart the worker after it is killed.

        Parameters
        ----------
        path
            Folder in front of the worker's search path.
        without
            Package that the worker lacks.
        environment
            Environment variables in addition to those of the test process.
        """
        own = ("--nthreads", "1", "--no-nanny", "--local-directory", str(self._folder))
        process = self._started(
            "worker", self.address, *own, path=path, without=without, **environment
        )
        self.workers.append(process)

    def kill_worker(self, which: int = 0) -> None:
        process = self.workers.pop(which)
        process.kill()
        process.join()

    def kill_scheduler(self) -> None:
        self.scheduler.kill()
        self.scheduler.join()

    def said(self) -> str:
        return "".join(file.read_text() for file in sorted(self._folder.glob("*.log")))

    def __enter__(self) -> "DaskCluster":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        for process in self.processes:
            process.kill()
        for process in self.processes:
            process.join()

    def _started(
        self,
        program: str,
        *options: str,
        path: Path | None = None,
        without: str = "",
        **environment: str,
    ) -> ForkServerProcess:
        log = self._folder / f"{program}-{len(self.processes)}.log"
        log.touch()
        own = ("--host", "127.0.0.1", "--dashboard-address", "127.0.0.1:0", "--no-dashboard")
        variables = {**os.environ, **IDLE, **environment}
        process = forked(_run, program, [*own, *options], variables, log, path, without)
        self.processes.append(process)
        return process


def _run(
    program: str,
    options: list[str],
    environment: dict[str, str],
    log: Path,
    path: Path | None,
    without: str,
) -> None:
    """Run a program of Dask in the forked process."""
    file = os.open(log, os.O_WRONLY)
    for number in (1, 2):
        os.dup2(file, number)
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(log.parent)
    if path is not None:
        sys.path.insert(0, str(path))
    if without:
        for name in list(sys.modules):
            if name.partition(".")[0] == without:
                del sys.modules[name]
        sys.modules[without] = None  # type: ignore[assignment]
    import dask

    dask.config.refresh()
    importlib.import_module(f"distributed.cli.dask_{program}").main(options)


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        port: int = one.getsockname()[1]
        return port


def listens(port: int) -> bool:
    with socket.socket() as one:
        one.settimeout(1.0)
        return one.connect_ex(("127.0.0.1", port)) == 0
