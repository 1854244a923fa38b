"""Where the work of a command is done: processes here, or a cluster."""

import os
from contextlib import AbstractContextManager

from ab_sim.design.cluster import Cluster
from ab_sim.design.work import Executor
from ab_sim.errors import InputError
from ab_sim.workers import Workers


def executor_of(
    workers: int | None, scheduler: str | None = None
) -> AbstractContextManager[Executor]:
    """What ``--workers`` and ``--scheduler`` ask for.

    Args:
        workers: processes; None: as many as there are processors.
        scheduler: its address; None: there is none.

    Raises:
        InputError: there are both, or no workers; or see ``Cluster``.
    """
    if scheduler is not None:
        if workers is not None:
            raise InputError("--workers are processes here, --scheduler has others: give one")
        return Cluster(scheduler)
    return Workers(processes(workers))


def processes(workers: int | None) -> int:
    """How many processes to use.

    Raises:
        InputError: fewer than one.
    """
    count = len(os.sched_getaffinity(0)) if workers is None else workers
    if count < 1:
        raise InputError(f"--workers {count}: must be at least 1")
    return count
