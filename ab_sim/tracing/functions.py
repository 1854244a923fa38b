"""Functions for formulas: for floats they compute, for expressions they create nodes."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ab_sim.tracing import expression
from ab_sim.tracing.expression import Expression
from ab_sim.tracing.plain import multiply_add


def cos(x: Any) -> Any:
    """Return the cosine of an angle [rad]."""
    return math.cos(x) if isinstance(x, float) else np.cos(x)


def sin(x: Any) -> Any:
    """Return the sine of an angle [rad]."""
    return math.sin(x) if isinstance(x, float) else np.sin(x)


def sqrt(x: Any) -> Any:
    """Return the square root."""
    return math.sqrt(x) if isinstance(x, float) else np.sqrt(x)


def fma(a: Any, b: Any, c: Any) -> Any:
    """Return a b + c, rounded once."""
    for x in (a, b, c):
        if isinstance(x, Expression):
            return expression.fma(*(expression.lifted(x.graph, operand) for operand in (a, b, c)))
    return multiply_add(a, b, c)


def where(condition: Any, a: Any, b: Any) -> Any:
    """Return ``a`` if a condition holds, else ``b``; both are computed, and neither may fail."""
    if isinstance(condition, Expression):
        graph = condition.graph
        return expression.where(condition, expression.lifted(graph, a), expression.lifted(graph, b))
    if isinstance(condition, np.ndarray):
        return np.where(condition, a, b)
    return a if condition else b


def total(x: Any) -> Any:
    """Return the sum over the balls of an expression, or of a sequence with a number per ball."""
    if isinstance(x, Expression):
        return expression.total(x)
    if isinstance(x, Sequence | np.ndarray):
        return added_up(list(x), lambda a, b: a + b)
    raise TypeError(f"total of {x!r}: must be an expression or a sequence with a number per ball")


def across(x: Any) -> Any:
    """Return the sum over lanes, repeated in each lane; the number of lanes is a power of two.

    In an array, the last axis counts lanes.
    """
    if isinstance(x, Expression):
        return expression.across(x)
    return halved(list(np.moveaxis(x, -1, 0)), lambda a, b: a + b)[..., None]


GROUP = 8
"""Number of balls in a vector register."""


def added_up(parts: Sequence[Any], add: Any) -> Any:
    """Return a sum over the balls in the order that all emitted forms share.

    Floating-point addition is not associative, so the order is fixed. Whole groups of eight are
    added element by element, then the result by halves. An incomplete last group is added by
    halves on its own, and its sum is added last.
    """
    whole = len(parts) - len(parts) % GROUP
    sums = []
    if whole:
        lanes = list(parts[:GROUP])
        for at in range(GROUP, whole, GROUP):
            lanes = [add(a, b) for a, b in zip(lanes, parts[at : at + GROUP], strict=True)]
        sums.append(halved(lanes, add))
    if whole < len(parts):
        sums.append(halved(parts[whole:], add))
    return sums[0] if len(sums) == 1 else add(*sums)


def halved(parts: Sequence[Any], add: Any) -> Any:
    """Return a sum, by adding the second half to the first until one element remains."""
    remaining = list(parts)
    while len(remaining) > 1:
        half = 1 << (len(remaining) - 1).bit_length() - 1
        remaining = [
            add(a, remaining[half + k]) if half + k < len(remaining) else a
            for k, a in enumerate(remaining[:half])
        ]
    return remaining[0]
