"""Dask cluster of processes on this machine, reached over loopback only."""

import os
import socket
import subprocess
import sys
import time
from pathlib import Path
from types import TracebackType

ROOT = Path(__file__).parents[2]
IDLE = {
    "DASK_DISTRIBUTED__DIAGNOSTICS__NVML": "False",
    "DASK_DISTRIBUTED__WORKER__PROFILE__ENABLED": "False",
    "DASK_DISTRIBUTED__ADMIN__TICK__INTERVAL": "1s",
}
"""Settings that keep idle processes from using CPU time."""
BEGINS = 60.0
"""Time within which a scheduler listens on a busy machine [s]."""


class DaskCluster:
    """Scheduler and workers in separate processes; a context manager.

    Args:
        folder: folder for the cluster's files.
        workers: number of workers, with one thread each.
        scheduler: settings of Dask's scheduler.
    """

    def __init__(self, folder: Path, workers: int = 0, **scheduler: str) -> None:
        self._settings = {f"DASK_DISTRIBUTED__SCHEDULER__{k}": v for k, v in scheduler.items()}
        self._folder = folder / "cluster"
        self._folder.mkdir()
        self.port = free_port()
        self.processes: list[subprocess.Popen[bytes]] = []
        self.workers: list[subprocess.Popen[bytes]] = []
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
            assert self.scheduler.poll() is None and time.monotonic() < until, self.said()
            time.sleep(0.05)

    def add_worker(self, *options: str, **environment: str) -> None:
        """Start a worker without a nanny, which would restart the worker after it is killed."""
        own = ("--nthreads", "1", "--no-nanny", "--local-directory", str(self._folder))
        self.workers.append(self._started("worker", self.address, *own, *options, **environment))

    def kill_worker(self, which: int = 0) -> None:
        process = self.workers.pop(which)
        process.kill()
        process.wait()

    def kill_scheduler(self) -> None:
        self.scheduler.kill()
        self.scheduler.wait()

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
            process.wait()

    def _started(self, program: str, *options: str, **environment: str) -> subprocess.Popen[bytes]:
        log = (self._folder / f"{program}-{len(self.processes)}.log").open("wb")
        own = {"PYTHONPATH": str(ROOT), **IDLE}
        process = subprocess.Popen(
            [
                *(sys.executable, "-m", f"distributed.cli.dask_{program}"),
                *("--host", "127.0.0.1", "--dashboard-address", "127.0.0.1:0", "--no-dashboard"),
                *options,
            ],
            cwd=self._folder,
            env={**os.environ, **own, **environment},
            stdout=log,
            stderr=subprocess.STDOUT,
        )
        log.close()
        self.processes.append(process)
        return process


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        port: int = one.getsockname()[1]
        return port


def listens(port: int) -> bool:
    with socket.socket() as one:
        one.settimeout(1.0)
        return one.connect_ex(("127.0.0.1", port)) == 0
