"""Unroll expressions over the balls: a quantity per ball becomes one node for each ball."""

from collections.abc import Iterable

from ab_sim.tracing.expression import (
    ROWS,
    Expression,
    Level,
    add,
    fma,
    mul,
    reachable_nodes,
    rebuilt,
)
from ab_sim.tracing.functions import added_up


def name_of(name: str, ball: int) -> str:
    """Return the name of the input ``name`` of one ball."""
    return f"{name}[{ball}]"


def unrolled(roots: Iterable[Expression], balls: int) -> list[list[Expression]]:
    """Return each root as a list of expressions, one per ball, or one if the balls share it.

    Args:
        roots: expressions of one graph.
        balls: number of balls, at least 1.

    Returns:
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
