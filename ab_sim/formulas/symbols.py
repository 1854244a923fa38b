"""How docs/equations.md writes what the code calls otherwise."""

import re
from typing import Any

from ab_sim.tracing.expression import Expression, Graph, Level
from ab_sim.tracing.latex import GREEK, latex_symbol

KNOWN = {
    "w": r"\omega",
    "al": r"\dot{\omega}",
    "dl/dtheta": r"\frac{\mathrm{d}l}{\mathrm{d}\theta}",
}
"""LaTeX of symbols that text writes with letters at hand."""


def in_latex(symbol: str) -> str:
    """LaTeX of a symbol in text."""
    return latex_symbol(symbol, KNOWN)


class Symbols:
    """Inputs of a graph by their symbols in text.

    Args:
        graph: where they are made.
    """

    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        self.used: set[str] = set()

    def __call__(self, symbol: str) -> Any:
        """What has one value: an expression, where formulas have a number."""
        self.used.add(symbol)
        return self.graph.input(symbol, Level.STATE)

    def each(self, symbol: str) -> Any:
        """What each ball has."""
        self.used.add(symbol)
        return self.graph.input(symbol, Level.STATE, each=True)


def symbol_of_field(name: str, description: str) -> str:
    """An effect's parameter: the symbol that its description begins with, or its name.

    ``"k_3"``, ``"beta_b, a length"`` and ``"g, of free fall"`` begin with one, ``"a slower
    approach"`` does not.
    """
    first = re.match(r"([A-Za-z]+)(_\w+)?(?=$|,| of )", description)
    if first is not None and (len(first[1]) == 1 or first[1] in GREEK):
        return first[0]
    return name


def symbol_of_local(name: str, known: dict[str, str]) -> str:
    """A local variable: ``f1`` is f_1, ``vx`` is v_x; others as they are."""
    if name in known:
        return known[name]
    short = re.fullmatch(r"([a-z])(\d+|x|y|z)", name)
    return name if short is None else f"{short[1]}_{short[2]}"


def lifted(graph: Graph, value: Any) -> Expression:
    """A number as expression."""
    return value if isinstance(value, Expression) else graph.constant(value)
