"""Processes for tests, forked from a process that has imported the package and run a scene.

Tests start hundreds of commands and nodes; from scratch each would take a second or two.
"""

import multiprocessing
import os
from collections.abc import Callable
from multiprocessing import forkserver
from multiprocessing.context import ForkServerProcess
from typing import Any

import pytest

from ab_sim.base import workers

WIDTH = {"COLUMNS": "200"}
"""Width of all tables; consoles read it when they are imported."""
_SERVER = multiprocessing.get_context("forkserver")
_SERVER.set_forkserver_preload(
    [
        *("scipy.signal", "scipy.stats", "pandas", "pint", "distributed"),
        *("pyarrow.dataset", "pyarrow.parquet"),
        *("rosbags.rosbag2", "rosbags.typesys.stores.ros2_kilted"),
        *("ab_sim.cli.design", "ab_sim.cli.identify", "tests.forked.warm"),
    ]
)


def start_workers_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make ``Workers`` start processes for any work, forked from the prepared one."""
    monkeypatch.setattr(workers, "TRIAL", 0.0)
    monkeypatch.setattr(workers, "WORTH_IT", 0.0)
    _start_server()
    monkeypatch.setattr(multiprocessing, "get_context", lambda _: _SERVER)


def forked(target: Callable[..., None], *arguments: Any) -> ForkServerProcess:
    """Start a forked process that calls a function."""
    _start_server()
    process = _SERVER.Process(target=target, args=arguments)
    process.start()
    return process


def _start_server() -> None:
    """Start the process from which others are forked, with wide tables."""
    before = dict(os.environ)
    os.environ.update(WIDTH)
    forkserver.ensure_running()
    os.environ.clear()
    os.environ.update(before)
