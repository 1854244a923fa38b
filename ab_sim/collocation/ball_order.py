"""An order in which what is computed of many balls needs few registers: one ball after the other.

Numbers of all balls do not fit into registers at the same time. So what is of one ball is computed
in one go, with what it adds to sums over the balls; what needs such a sum comes behind the last.
"""

from collections.abc import Callable, Iterable

from ab_sim.tracing import Expression


def ball_by_ball(
    nodes: Iterable[Expression], balls: int, ball_of: Callable[[str], int | None]
) -> list[Expression]:
    """Nodes in that order, arguments first.

    Args:
        nodes: without the balls' axis, in the order of their numbers, arguments first.
        balls: how many.
        ball_of: of which ball an input is, by its name.
    """
    every = (1 << balls) - 1
    found: dict[int, tuple[int, int]] = {}
    """Of each node how many sums over all balls come before it, one after the other, and, a bit for
    each, the balls that it is of since then."""

    def of(x: Expression) -> tuple[int, int]:
        if x.op == "lane":
            return of(x.args[0])
        ball = ball_of(x.payload) if x.op == "input" else None
        sums, own = found.get(x.number, (0, 0)) if ball is None else (0, 1 << ball)
        return (sums + 1, 0) if own == every else (sums, own)

    order = []
    for x in nodes:
        sums = own = 0
        for before, balls_before in map(of, x.args):
            sums, own = max(sums, before), own | balls_before
        found[x.number] = sums, own
        order.append((sums, own.bit_length(), x.number, x))
    return [x for *_, x in sorted(order, key=lambda each: each[:3])]
