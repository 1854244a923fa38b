"""Emit lowered expressions as a Python function, to read and as a reference for machine code."""

import math
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from typing import Any

from ab_sim.tracing.expression import Expression, reachable_nodes

_FORMS = {
    "add": "{} + {}",
    "sub": "{} - {}",
    "mul": "{} * {}",
    "div": "divided({}, {})",
    "neg": "-{}",
    "abs": "abs({})",
    "sqrt": "root({})",
    "fma": "multiply_add({}, {}, {})",
    "lt": "{} < {}",
    "le": "{} <= {}",
    "where": "{1} if {0} else {2}",
}


def python_function(
    roots: Sequence[Expression], names: Mapping[str, str]
) -> Callable[..., list[float]]:
    """Return a function that computes the roots from the inputs' values.

    Args:
        roots: lowered expressions that stand for one number each, not for one per ball.
        names: name of the function's argument for each input's name.

    Returns:
        A function of keyword arguments, which returns the roots' values.
    """
    scope: dict[str, Any] = {
        "multiply_add": multiply_add,
        "divided": _divided,
        "root": _root,
        "inf": math.inf,
        "nan": math.nan,
    }
    exec(python_text(roots, names), scope)
    evaluate: Callable[..., list[float]] = scope["evaluate"]
    return evaluate


def python_text(roots: Sequence[Expression], names: Mapping[str, str]) -> str:
    """Return the source of ``python_function``'s result."""
    lines, texts = [], {}
    for x in reachable_nodes(roots):
        if x.op == "const":
            texts[x.number] = f"({x.payload!r})"
        elif x.op == "input":
            texts[x.number] = names[x.payload]
        else:
            texts[x.number] = f"t{x.number}"
            form = _FORMS[x.op].format(*(texts[arg.number] for arg in x.args))
            lines.append(f"    {texts[x.number]} = {form}")
    lines.append(f"    return [{', '.join(texts[root.number] for root in roots)}]")
    arguments = ", ".join(sorted(names.values()))
    return f"def evaluate(*, {arguments}):\n" + "\n".join(lines) + "\n"


def multiply_add(a: float, b: float, c: float) -> float:
    """Return a b + c, rounded once, as IEEE 754 defines it.

    Python has no ``math.fma`` before 3.13; exact fractions replace it, as dividing two integers
    rounds correctly.
    """
    if not (math.isfinite(a) and math.isfinite(b) and math.isfinite(c)):
        return c if math.isfinite(a) and math.isfinite(b) else a * b + c
    exact = Fraction(a) * Fraction(b) + Fraction(c)
    if exact == 0:
        # Fractions have no sign of zero. If both terms are zeros, floats add them with the right
        # sign; terms that cancel give +0.
        product = math.copysign(0.0, a) * math.copysign(1.0, b)
        return product + c if a * b == 0 and c == 0 else 0.0
    try:
        return exact.numerator / exact.denominator
    except OverflowError:
        return math.inf if exact > 0 else -math.inf


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
