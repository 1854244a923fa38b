"""A pytest plugin (-p, so that it comes before all imports): nothing is compiled.

An address of a function is the function itself.
"""

from collections.abc import Callable
from typing import Any

import numba


def _njit(function: Any = None, **options: Any) -> Any:
    if function is None:
        return _njit
    function.py_func = function
    return function


def _call_at(result: Any, *kinds: Any) -> Callable[..., Any]:
    return lambda address, arguments: address(*arguments)


numba.njit = _njit

# What it is for imports it by name: so it has to be replaced before that.
from ab_sim.dynamics import calling  # noqa: E402

calling.call_at = _call_at
