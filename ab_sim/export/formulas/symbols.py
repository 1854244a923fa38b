"""Symbols of docs/equations.md for names in the code."""

import re
from typing import Any

from ab_sim.tracing.expression import Expression, Graph, Level
from ab_sim.tracing.notations import GREEK, latex_symbol

KNOWN = {
    "w": r"\omega",
    "al": r"\dot{\omega}",
    "dl/dtheta": r"\frac{\mathrm{d}l}{\mathrm{d}\theta}",
}
"""LaTeX of symbols that are written otherwise in plain text."""


def in_latex(symbol: str) -> str:
    """Return the LaTeX of a symbol of plain text."""
    return latex_symbol(symbol, KNOWN)


class Symbols:
    """Inputs of a graph by their symbols in plain text.

    Args:
        graph: graph in which the inputs are created.
    """

    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        self.used: set[str] = set()

    def __call__(self, symbol: str) -> Any:
        """Return the input for a quantity with a single value."""
        self.used.add(symbol)
        return self.graph.input(symbol, Level.STATE)

    def each(self, symbol: str) -> Any:
        """Return the input for a quantity with a value per ball."""
        self.used.add(symbol)
        return self.graph.input(symbol, Level.STATE, per_ball=True)


def symbol_of_field(name: str, description: str) -> str:
    """Return a parameter's symbol: the first word of its description if that is one, or its name.

    ``"k_3"``, ``"beta_b, a length"`` and ``"g, of free fall"`` begin with a symbol, ``"a slower
    approach"`` does not.
    """
    first = re.match(r"([A-Za-z]+)(_\w+)?(?=$|,| of )", description)
    if first is not None and (len(first[1]) == 1 or first[1] in GREEK):
        return first[0]
    return name


def symbol_of_local(name: str, known_symbols: dict[str, str]) -> str:
    """Return a local variable's symbol: f_1 for ``f1``, v_x for ``vx``; others are unchanged."""
    if name in known_symbols:
        return known_symbols[name]
    short = re.fullmatch(r"([a-z])(\d+|x|y|z)", name)
    return name if short is None else f"{short[1]}_{short[2]}"


def lifted(graph: Graph, value: Any) -> Expression:
    """Return a number as an expression, and an expression unchanged."""
    return value if isinstance(value, Expression) else graph.constant(value)
