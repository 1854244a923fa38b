"""Lower expressions to arithmetic: expand cosines, fuse products with sums, unroll over the balls.

All emitters (``llvm_text``, ``c_text``, ``plain``) start from lowered expressions, so their results
are rounded alike. Compilers are not free to choose which operations to fuse.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from ab_sim.tracing.expression import (
    ROWS,
    Expression,
    Level,
    add,
    fma,
    mul,
    neg,
    reachable_nodes,
    rebuilt,
)
from ab_sim.tracing.functions import added_up, cos_sin

NOTHING: Mapping[Expression, Expression] = {}
"""Default of ``_mapped``: no input is replaced."""


def lowered(roots: Iterable[Expression]) -> list[Expression]:
    """Return the roots without ``cos`` and ``sin``, and with fused products."""
    return _fused(without_cosines(roots))


def without_cosines(roots: Iterable[Expression]) -> list[Expression]:
    """Return the roots with cosines and sines expanded into arithmetic operations."""
    pairs: dict[int, Any] = {}

    def rule(x: Expression, args: Sequence[Expression]) -> Expression:
        if x.op not in ("cos", "sin"):
            return rebuilt(x, args)
        angle: Any = args[0]
        if angle.number not in pairs:
            pairs[angle.number] = cos_sin(angle)
        replacement: Expression = pairs[angle.number][x.op == "sin"]
        return replacement

    return _mapped(roots, rule)


def _fused(roots: Iterable[Expression]) -> list[Expression]:
    """Return the roots with products fused into sums (``fma``).

    A product is fused if its only use is in a sum. If both terms of a sum are such products, the
    first one is fused. Products are not fused across levels, so that a product that is known before
    the run can be computed once.
    """
    roots = list(roots)
    nodes = reachable_nodes(roots)
    uses = Counter(arg.number for x in nodes for arg in x.args)
    uses.update(root.number for root in roots)
    once = {x.number for x in nodes if x.op == "mul" and uses[x.number] == 1}

    def rule(x: Expression, args: Sequence[Expression]) -> Expression:
        if x.op in ("add", "sub"):
            minus = x.op == "sub"
            for k, (was, now, other) in enumerate(zip(x.args, args, args[::-1], strict=True)):
                if was.number in once and now.op == "mul" and now.level == x.level:
                    a, b = now.args
                    if k == 0:
                        return fma(a, b, neg(other) if minus else other)
                    return fma(neg(a) if minus else a, b, other)
        return rebuilt(x, args)

    return _mapped(roots, rule)


def _mapped(
    roots: Iterable[Expression],
    rule: Callable[[Expression, Sequence[Expression]], Expression],
    inputs: Mapping[Expression, Expression] = NOTHING,
) -> list[Expression]:
    """Return the roots rebuilt from the inputs up, each node by ``rule(node, new arguments)``.

    ``inputs`` maps inputs to their replacements.
    """
    roots = list(roots)
    new: dict[int, Expression] = {}
    for x in reachable_nodes(roots):
        new[x.number] = rule(x, [new[arg.number] for arg in x.args]) if x.args else inputs.get(x, x)
    return [new[root.number] for root in roots]


def name_of(name: str, ball: int) -> str:
    """Return the name of the input ``name`` of one ball."""
    return f"{name}[{ball}]"


def unrolled(roots: Iterable[Expression], balls: int) -> list[list[Expression]]:
    """Return each root as a list of expressions: one per ball, or one for a shared value.

    Parameters
    ----------
    roots
        Expressions of one graph.
    balls
        Number of balls, at least 1.

    Returns
    -------
    list[list[Expression]]
        A list for each root: ``balls`` expressions for a quantity per ball, whose inputs are named
        by ``name_of``; else one expression.
    """
    roots = list(roots)
    new: dict[int, list[Expression]] = {}
    for x in reachable_nodes(roots):
        if x.op == "total":
            of = new[x.args[0].number]
            parts = of if len(of) == balls else of * balls
            new[x.number] = [added_up(parts, add)]
        elif x.op == "rows":
            of = new[x.args[0].number]
            new[x.number] = [_row(of * balls if len(of) == 1 else of, i) for i in range(balls)]
        elif x.op == "input" and x.each:
            names = (name_of(x.payload, ball) for ball in range(balls))
            new[x.number] = [x.graph.input(name, x.level) for name in names]
        elif not x.args:
            new[x.number] = [x]
        else:
            columns = [new[arg.number] for arg in x.args]
            count = balls if x.each else 1
            new[x.number] = [
                rebuilt(x, [column[k if len(column) > 1 else 0] for column in columns])
                for k in range(count)
            ]
    return [new[root.number] for root in roots]


def _row(of: list[Expression], i: int) -> Expression:
    """Return a row of the matrix times a column, summed from the first ball on."""
    graph, n = of[0].graph, len(of)
    line = [graph.input(name_of(ROWS, j * n + i), Level.TIME) for j in range(n)]
    total = mul(line[0], of[0])
    for j in range(1, n):
        total = fma(line[j], of[j], total)
    return total
