"""Order in which to compute expressions, such that few operations wait for results.

A processor looks only some hundred instructions ahead for operations whose arguments are known.
Long code whose sums follow each other, each a chain of dependent operations, would leave it idle.
"""

import heapq
from collections.abc import Container, Sequence

from ab_sim.tracing.expression import Expression, reachable_nodes

_LATENCY = {"div": 14, "sqrt": 19}
"""Cycles until the result of an operation is available, for operations slower than a sum."""
_OF_A_SUM = 4
"""Cycles until the result of a sum, product or other operation is available."""
_FREE = ("const", "input", "neg")
"""Operations without a cost: operands in memory, and signs that are a part of their use."""


def scheduled(
    roots: Sequence[Expression], balls: int, known_numbers: Container[int] = ()
) -> list[Expression]:
    """Return all operations on which roots depend, in the order in which to compute them.

    This is list scheduling (Graham 1969, SIAM J. Appl. Math. 17, 416-429) for a processor that
    starts one operation per cycle: of the operations whose arguments are known, the one that most
    further operations wait for comes next.

    Parameters
    ----------
    roots
        Lowered expressions of one graph.
    balls
        Number of operations that a quantity per ball takes.
    known_numbers
        Numbers of nodes that are not computed.
    """
    nodes = reachable_nodes(roots, known_numbers)
    needs = {
        x.number: set() if x.number in known_numbers else {a.number for a in x.args} for x in nodes
    }
    users: dict[int, list[Expression]] = {x.number: [] for x in nodes}
    ahead: dict[int, int] = {}
    """Least number of cycles from a node's start to the end of all, by the node's number."""
    for x in reversed(nodes):
        least = max((ahead[u.number] for u in users[x.number]), default=0)
        ahead[x.number] = _cycles(x, known_numbers) + least
        for number in needs[x.number]:
            users[number].append(x)
    now, order = 0, []
    begin = dict.fromkeys(needs, 0)
    """Cycle from which on a node's arguments, as far as scheduled, are available."""
    later = [(0, x.number, x) for x in nodes if not needs[x.number]]
    ready: list[tuple[int, int, Expression]] = []
    while ready or later:
        now = now if ready else max(now, later[0][0])
        while later and later[0][0] <= now:
            _, number, x = heapq.heappop(later)
            heapq.heappush(ready, (-ahead[number], number, x))
        _, number, x = heapq.heappop(ready)
        cycles = _cycles(x, known_numbers)
        if cycles:
            order.append(x)
            now += balls if x.each else 1
        for user in users[number]:
            needs[user.number].remove(number)
            begin[user.number] = max(begin[user.number], now + max(cycles - 1, 0))
            if not needs[user.number]:
                heapq.heappush(later, (begin[user.number], user.number, user))
    return order


def _cycles(x: Expression, known_numbers: Container[int]) -> int:
    """Return the number of cycles until a node's result is available."""
    free = x.op in _FREE or x.number in known_numbers
    return 0 if free else _LATENCY.get(x.op, _OF_A_SUM)
