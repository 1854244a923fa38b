"""Executors of a command's work: local processes, or a cluster."""

import os
from contextlib import AbstractContextManager

from ab_sim.design.cluster import Cluster
from ab_sim.design.work import Executor
from ab_sim.errors import InputError
from ab_sim.workers import Workers


def executor_of(
    workers: int | None, scheduler: str | None = None
) -> AbstractContextManager[Executor]:
    """Return the executor for ``--workers`` and ``--scheduler``.

    Args:
        workers: number of processes; None: the number of processors.
        scheduler: address of a cluster's scheduler; None: no cluster.

    Raises:
        InputError: both are given, or no workers; or see ``Cluster``.
    """
    if scheduler is not None:
        if workers is not None:
            raise InputError("--workers are processes here, --scheduler has others: give one")
        return Cluster(scheduler)
    return Workers(processes(workers))


def processes(workers: int | None) -> int:
    """Return the number of processes to use.

    Raises:
        InputError: the number is less than one.
    """
    count = _usable_cores() if workers is None else workers
    if count < 1:
        raise InputError(f"--workers {count}: must be at least 1")
    return count


def _usable_cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
