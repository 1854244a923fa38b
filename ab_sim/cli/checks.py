"""Checks and meanings of options that several commands share.

Imports that take long are in the functions.
"""

import math
import os
from collections.abc import Iterator
from typing import TYPE_CHECKING

from ab_sim.base.errors import InputError, short

if TYPE_CHECKING:
    from ab_sim.design.sweep import Sweep
    from ab_sim.design.work import Executor


def require_ros(purpose: str) -> None:
    """Refuse to continue without ROS 2.

    Parameters
    ----------
    purpose
        Purpose of ROS 2, such as "to replay".

    Raises
    ------
    InputError
        ROS 2 is missing; the message tells how to install it.
    """
    try:
        import rclpy  # noqa: F401
    except ImportError as error:
        raise InputError(
            f"ROS 2 is needed {purpose}, and rclpy cannot be imported ({error}); "
            "install it with `pip install 'ab_sim[ros]'`, or source your ROS 2 installation"
        ) from error


def check_positive(option: str, value: float, meaning: str) -> None:
    """Refuse a number that is not positive and finite.

    Raises
    ------
    InputError
        The message has the option, its value and its meaning.
    """
    if not 0.0 < value < math.inf:
        raise InputError(f"{option} {value:g}: {meaning}, must be more than 0 and finite")


def check_speed(speed: float) -> float:
    """Check a spindle speed [rad/s] and return it.

    Raises
    ------
    InputError
        The speed is not a number, too high, or too low.
    """
    from ab_sim.analysis.held_speed import SPEEDS, can_be_held

    if not can_be_held(speed):
        raise InputError(f"--speed {speed}: {SPEEDS}")
    return speed


def executor_of(workers: int | None, scheduler: str | None) -> "Executor":
    """Return the executor for ``--workers`` and ``--scheduler``.

    Parameters
    ----------
    workers
        Number of processes; None: the number of processors.
    scheduler
        Address of a cluster's scheduler; None: no cluster.

    Raises
    ------
    InputError
        Both are given, the number of workers is below one, or ``Cluster`` refuses the address.
    """
    from ab_sim.base.workers import Workers
    from ab_sim.design.cluster import Cluster

    if scheduler is not None:
        if workers is not None:
            raise InputError("--workers and --scheduler: give one; a cluster has its own processes")
        return Cluster(scheduler)
    return Workers(processes(workers))


def processes(workers: int | None) -> int:
    """Return the number of processes to use.

    Raises
    ------
    InputError
        The number is less than one.
    """
    count = _usable_cores() if workers is None else workers
    if count < 1:
        raise InputError(f"--workers {count}: must be at least 1")
    return count


def _usable_cores() -> int:
    """Return the number of processor cores on which this process may run."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def wanted_metrics(text: str | None) -> tuple[str, ...]:
    """Parse names of metrics separated by commas; for None, return those of a sweep.

    Raises
    ------
    InputError
        A name is unknown; the message has the nearest name and all names.
    """
    from ab_sim.analysis.metrics.metric import metrics_named
    from ab_sim.design.sweep import DEFAULT_METRICS

    if text is None:
        return DEFAULT_METRICS
    names = tuple(name.strip() for name in text.split(","))
    metrics_named(names)
    return names


def share_of(option: str, text: str, must: str) -> float:
    """Parse a share, given as a number or in %.

    Parameters
    ----------
    option
        Name without its dashes.
    text
        Text of the option.
    must
        Allowed values, for the error message.

    Raises
    ------
    InputError
        The text is not a number.
    """
    plain = text.strip()
    try:
        return float(plain.removesuffix("%")) / (100.0 if plain.endswith("%") else 1.0)
    except ValueError:
        raise InputError(f"--{option} {short(text)}: {must}") from None


def outcome_notes(sweep: "Sweep") -> Iterator[str]:
    """Yield the meanings of the outcomes that occur, and a note if balls never separate."""
    from ab_sim.analysis.metrics.verdict import Verdict

    longer = "a longer duration (--set duration=...) shows where it goes"
    no_final = f"the whirl has no final value yet, and the run does not count; {longer}"
    notes = {
        Verdict.RINGING_DOWN: f"the run counts, with its final whirl as an upper bound; {longer}",
        Verdict.CHANGING: no_final,
        Verdict.UNSETTLED: no_final,
        Verdict.CIRCULATES: "balls go round the race, and the run does not count",
    }
    for verdict, note in notes.items():
        if verdict.value in sweep.outcomes:
            yield f"{verdict.value}: {note}"
    if sweep.start_warning:
        yield sweep.start_warning
