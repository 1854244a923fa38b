"""Names of a formula's intermediate quantities, taken from the local variables of its source.

The nodes of a trace have no names. The author's names exist while the formula runs: a profiling
hook reads them from the frames of the functions as these return.
"""

import sys
from collections.abc import Callable
from types import FrameType
from typing import Any, NamedTuple, TypeVar

from ab_sim.tracing.expression import Expression

T = TypeVar("T")

_OWN = __name__.rpartition(".")[0]


class Named(NamedTuple):
    """Named intermediate quantity."""

    name: str
    """Name in the source."""
    node: Expression


def with_local_names(formula: Callable[..., T], *arguments: Any) -> tuple[T, list[Named]]:
    """Return a formula's result, and the named quantities in it and in the formulas that it calls.

    Args:
        formula: plain Python on numbers.
        *arguments: expressions, or nested tuples of them.

    Returns:
        The result, and each node that was the value of a local variable when a function returned,
        or of a field of a named tuple that was constructed, in the order of the nodes' creation.
        Inputs and constants are left out; of several nodes with one name, the first is returned.
    """
    by_name: dict[str, Named] = {}

    def look(frame: FrameType, event: str, _: Any) -> None:
        if event != "return" or frame.f_globals.get("__name__", "").startswith(_OWN):
            return
        for name, value in frame.f_locals.items():
            if isinstance(value, Expression) and value.op not in ("input", "const"):
                by_name.setdefault(name, Named(name, value))

    before = sys.getprofile()
    sys.setprofile(look)
    try:
        result = formula(*arguments)
    finally:
        sys.setprofile(before)
    return result, sorted(by_name.values(), key=lambda one: one.node.number)
