"""What a formula's own source calls its intermediate quantities: the names of its local variables.

A trace leaves nodes without names. Those that the author of the formula gave are there while it
runs: they are read from the frames of the functions as these return.
"""

import sys
from collections.abc import Callable
from types import FrameType
from typing import Any, NamedTuple, TypeVar

from ab_sim.tracing.expression import Expression

T = TypeVar("T")

_OWN = __name__.rpartition(".")[0]


class Named(NamedTuple):
    """An intermediate quantity."""

    name: str
    """In the source."""
    node: Expression


def with_local_names(formula: Callable[..., T], *arguments: Any) -> tuple[T, list[Named]]:
    """What a formula gives, and what it and the formulas that it calls name on the way.

    Args:
        formula: plain Python on numbers.
        *arguments: expressions, or nested tuples of them.

    Returns:
        Its result, and each node that a local variable stood for when its function returned, or
        that a field of a named tuple was made of, in the order in which nodes were made. Inputs and
        constants are left out, and of several nodes of one name all but the first.
    """
    found: dict[str, Named] = {}

    def look(frame: FrameType, event: str, _: Any) -> None:
        if event != "return" or frame.f_globals.get("__name__", "").startswith(_OWN):
            return
        for name, value in frame.f_locals.items():
            if isinstance(value, Expression) and value.op not in ("input", "const"):
                found.setdefault(name, Named(name, value))

    before = sys.getprofile()
    sys.setprofile(look)
    try:
        result = formula(*arguments)
    finally:
        sys.setprofile(before)
    return result, sorted(found.values(), key=lambda one: one.node.number)
