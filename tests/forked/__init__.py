"""Processes for tests, forked from one that has imported what they need, and has run a scene.

There are hundreds, of commands and of nodes, and from nothing each would take a second or two.
"""

import multiprocessing
import os
from collections.abc import Callable
from multiprocessing import forkserver
from multiprocessing.context import ForkServerProcess
from typing import Any

WIDTH = {"COLUMNS": "200"}
"""Of all tables; consoles look at it when they are imported."""
_SERVER = multiprocessing.get_context("forkserver")
_SERVER.set_forkserver_preload(["tests.forked.warm", "pyarrow.parquet", "scipy.stats", "pandas"])


def forked(target: Callable[..., None], *arguments: Any) -> ForkServerProcess:
    """A process that calls a function; it runs."""
    before = dict(os.environ)
    os.environ.update(WIDTH)
    forkserver.ensure_running()
    os.environ.clear()
    os.environ.update(before)
    process = _SERVER.Process(target=target, args=arguments)
    process.start()
    return process
