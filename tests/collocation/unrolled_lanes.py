"""Expressions without lanes: a node with an element in each lane becomes one node for each lane."""

from collections.abc import Callable, Iterable

from ab_sim.tracing.expression import Expression, add, reached, rebuilt
from ab_sim.tracing.functions import halved


def name_in(name: str, lane: int) -> str:
    """What the input ``name`` is called in one lane."""
    return f"{name}@{lane}"


def unrolled_lanes(
    roots: Iterable[Expression], lanes: int, uniform: Callable[[str], bool]
) -> list[list[Expression]]:
    """Each root as one expression per lane, or as one alone.

    Args:
        roots: of one graph.
        lanes: how many, a power of two.
        uniform: by input's name whether it is the same in all lanes.

    Returns:
        By root a list: of ``lanes`` expressions for one that differs from lane to lane, whose
        inputs are named as by ``name_in``; else of one.
    """
    roots = list(roots)
    new: dict[int, list[Expression]] = {}
    for x in reached(roots):
        if x.op == "input":
            name = x.payload
            names = [name] if uniform(name) else [name_in(name, k) for k in range(lanes)]
            new[x.number] = [x.graph.input(each, x.level, x.each) for each in names]
            continue
        columns = [new[arg.number] for arg in x.args]
        if x.op == "lane":
            new[x.number] = [columns[0][x.payload if len(columns[0]) > 1 else 0]]
        elif x.op == "across":
            own = columns[0] if len(columns[0]) > 1 else columns[0] * lanes
            new[x.number] = [halved(own, add)]
        elif not columns:
            new[x.number] = [x]
        else:
            count = max(map(len, columns))
            new[x.number] = [
                rebuilt(x, [column[k if len(column) > 1 else 0] for column in columns])
                for k in range(count)
            ]
    return [new[root.number] for root in roots]
