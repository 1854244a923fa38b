"""Evaluate lowered expressions in Python, as a reference for machine code."""

import math
import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ab_sim.tracing.expression import Expression, reachable_nodes
from ab_sim.tracing.functions import multiply_add


def python_function(
    roots: Sequence[Expression], names: Mapping[str, str]
) -> Callable[..., list[float]]:
    """Return a function of keyword arguments that returns the roots' values.

    Parameters
    ----------
    roots
        Lowered expressions that stand for one number each, not for one per ball.
    names
        Name of the function's argument for each input's name.
    """
    nodes = list(reachable_nodes(roots))

    def evaluate(**arguments: float) -> list[float]:
        values: dict[int, Any] = {}
        for x in nodes:
            if x.op == "const":
                values[x.number] = x.payload
            elif x.op == "input":
                values[x.number] = arguments[names[x.payload]]
            else:
                values[x.number] = _OPERATIONS[x.op](*(values[arg.number] for arg in x.args))
        return [values[root.number] for root in roots]

    return evaluate


def _divided(a: float, b: float) -> float:
    """Return a / b by IEEE 754, which defines a division by zero."""
    if b:
        return a / b
    if a == 0 or math.isnan(a):
        return math.nan
    return math.copysign(math.inf, a) * math.copysign(1.0, b)


def _root(x: float) -> float:
    """Return the square root by IEEE 754: NaN of a negative number."""
    return math.sqrt(x) if x >= 0 else math.nan


_OPERATIONS: dict[str, Callable[..., Any]] = {
    "add": operator.add,
    "sub": operator.sub,
    "mul": operator.mul,
    "div": _divided,
    "neg": operator.neg,
    "abs": abs,
    "sqrt": _root,
    "fma": multiply_add,
    "lt": operator.lt,
    "le": operator.le,
    "where": lambda condition, a, b: a if condition else b,
}
