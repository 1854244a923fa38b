"""Symbols of docs/equations.md, and traced formulas as lines."""

import re
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from ab_sim.tracing.expression import Expression, Graph, Level, reachable_nodes
from ab_sim.tracing.notations import GREEK, Latex, PlainText, latex_symbol
from ab_sim.tracing.printed import Named, Printer

_KNOWN = {
    "w": r"\omega",
    "al": r"\dot{\omega}",
    "dl/dtheta": r"\frac{\mathrm{d}l}{\mathrm{d}\theta}",
}
"""LaTeX of symbols that are written otherwise in plain text."""


def in_latex(symbol: str) -> str:
    """Return the LaTeX of a symbol of plain text."""
    return latex_symbol(symbol, _KNOWN)


class Symbols:
    """Access to a graph's inputs by symbol in plain text; a new symbol adds an input.

    Parameters
    ----------
    graph
        Graph in which the inputs are created.
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


def _symbol_of_local(name: str, known_symbols: dict[str, str]) -> str:
    """Return a local variable's symbol: f_1 for ``f1``, v_x for ``vx``; others are unchanged."""
    if name in known_symbols:
        return known_symbols[name]
    short = re.fullmatch(r"([a-z])(\d+|x|y|z)", name)
    return name if short is None else f"{short[1]}_{short[2]}"


WIDTH = 88
"""Largest number of characters of a line in text.

If a line is longer, intermediate quantities are named and printed on separate lines.
"""


class Line(NamedTuple):
    """Printed equation, as plain text and as LaTeX."""

    text: str
    latex: str


class Equation(NamedTuple):
    """Two sides of an equation."""

    left: Expression
    right: Expression


class Lines(NamedTuple):
    """Printed equations, and definitions of the intermediate quantities that they name."""

    equations: list[Line]
    quantities: list[Line]
    """Definitions of the intermediate quantities, in the order of computation."""


def lines_of(
    equations: Sequence[Equation],
    locals_: Iterable[Named],
    known_symbols: Mapping[str, str] | None = None,
    explained: Collection[str] = (),
    *,
    always: bool = False,
) -> Lines:
    """Return printed equations, with as few named quantities as keep the lines short.

    No quantity is named if all lines are short without names. Otherwise all quantities are named at
    first. Then names are removed one by one: unused ones, and those used once, as long as every
    line stays within ``WIDTH``.

    Parameters
    ----------
    equations
        Equations in the order of printing.
    locals_
        Intermediate quantities that can be named.
    known_symbols
        Symbols of some of these quantities, by their names in the source.
    explained
        Symbols that need no definition.
    always
        True to name all quantities even in short lines, for a system of equations.
    """
    symbols = _symbols(equations, locals_, dict(known_symbols or {}))
    if not always and _short(equations, {}):
        symbols = {}
    while not always:
        uses = _uses(equations, symbols)
        spare = next((n for n in symbols if _can_go(equations, symbols, n, uses)), None)
        if spare is None:
            break
        del symbols[spare]
    uses = _uses(equations, symbols)
    used = {n: symbols[n] for n in sorted(symbols) if uses[n]}
    nodes = {n: node for node in _nodes(equations) if (n := node.number) in used}
    return Lines(
        [_line(equation.left, equation.right, used) for equation in equations],
        [_line(None, nodes[n], used) for n in used if used[n] not in explained],
    )


def _symbols(
    equations: Sequence[Equation], locals_: Iterable[Named], known_symbols: dict[str, str]
) -> dict[int, str]:
    """Return the symbols of the nodes that can be named, by node number.

    A symbol that the equations already use, or a whole right side, names nothing, unless the symbol
    is in ``known_symbols``.
    """
    taken = {node.payload for node in _nodes(equations) if node.op == "input"}
    whole = {equation.right.number for equation in equations}
    symbols: dict[int, str] = {}
    for name, node in locals_:
        if node.number in symbols:
            continue
        symbol = _symbol_of_local(name, known_symbols)
        if name in known_symbols or (symbol not in taken and node.number not in whole):
            symbols[node.number] = symbol
            taken.add(symbol)
    return symbols


def _can_go(
    equations: Sequence[Equation], symbols: dict[int, str], number: int, uses: Counter[int]
) -> bool:
    """Return whether a quantity needs no name: its one use, if any, fits on the line."""
    if uses[number] == 0:
        return True
    fewer = {n: symbol for n, symbol in symbols.items() if n != number}
    return uses[number] == 1 and _short(equations, fewer)


def _short(equations: Sequence[Equation], symbols: Mapping[int, str]) -> bool:
    """Return whether all equations and definitions fit in ``WIDTH`` characters."""
    nodes = {node.number: node for node in _nodes(equations)}
    whole = [_line(equation.left, equation.right, symbols) for equation in equations]
    parts = [_line(None, nodes[n], symbols) for n in symbols if n in nodes]
    return all(len(line.text) <= WIDTH for line in [*whole, *parts])


def _uses(equations: Sequence[Equation], symbols: Mapping[int, str]) -> Counter[int]:
    """Count the occurrences of each named quantity in the equations and definitions."""
    uses: Counter[int] = Counter()
    ahead = [side for equation in equations for side in equation]
    done: set[int] = set()
    while ahead:
        for arg in ahead.pop().args:
            if arg.number in symbols:
                uses[arg.number] += 1
                if arg.number in done:
                    continue
                done.add(arg.number)
            ahead.append(arg)
    return uses


def _nodes(equations: Sequence[Equation]) -> list[Expression]:
    """Return all nodes of the expressions on both sides of the equations."""
    return reachable_nodes(side for equation in equations for side in equation)


def _line(left_side: Expression | None, right: Expression, symbols: Mapping[int, str]) -> Line:
    """Return an equation; without a left side, the definition of a named quantity."""
    text = Printer(PlainText(), named=symbols)
    latex = Printer(Latex(), in_latex, {n: in_latex(symbol) for n, symbol in symbols.items()})
    sides = []
    for printer in (text, latex):
        first_side = printer.name(right) if left_side is None else printer.text(left_side)
        other = printer.text(right)
        sides.append(first_side if first_side == other else f"{first_side} = {other}")
    return Line(*sides)
