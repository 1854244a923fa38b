"""Directional derivatives of expressions (forward mode), with respect to states and parameters."""

from collections.abc import Callable, Iterable, Mapping, Sequence

from ab_sim.tracing.expression import (
    Expression,
    across,
    is_constant,
    reachable_nodes,
    rows,
    total,
    where,
)

Rule = Callable[[Expression, Sequence[Expression], Sequence[Expression]], Expression]


def derivatives(
    roots: Iterable[Expression],
    along: Mapping[Expression, Expression],
) -> list[Expression]:
    """Return the derivatives of roots along a direction.

    Args:
        roots: expressions of one graph.
        along: rate of change of each input, an expression of the same graph; inputs that are
            missing stay constant.

    Returns:
        Rates of change of the roots, in the order of the roots. The rate of ``abs`` at 0 is that of
        its argument. The rate of ``where`` is that of the branch taken, also at the switch, where
        the function has no derivative.

    Raises:
        ValueError: a key of ``along`` is not an input.
    """
    roots = list(roots)
    for x in along:
        if x.op != "input":
            raise ValueError(f"along: {x} is not an input; a direction changes inputs only")
    rates: dict[int, Expression] = {}
    for x in reachable_nodes(roots):
        zero = x.graph.constant(0.0)
        changes = [rates[arg.number] for arg in x.args]
        if x in along:
            rates[x.number] = along[x]
        elif x.op in ("lt", "le") or all(is_constant(change, 0.0) for change in changes):
            rates[x.number] = zero
        else:
            rates[x.number] = _RULES[x.op](x, x.args, changes)
    return [rates[root.number] for root in roots]


_RULES: dict[str, Rule] = {
    "add": lambda x, a, d: d[0] + d[1],
    "sub": lambda x, a, d: d[0] - d[1],
    "mul": lambda x, a, d: d[0] * a[1] + a[0] * d[1],
    "div": lambda x, a, d: (d[0] - x * d[1]) / a[1],
    "neg": lambda x, a, d: -d[0],
    "abs": lambda x, a, d: where(a[0] < 0.0, -d[0], d[0]),
    "sqrt": lambda x, a, d: d[0] / (2.0 * x),
    "fma": lambda x, a, d: d[0] * a[1] + a[0] * d[1] + d[2],
    "where": lambda x, a, d: where(a[0], d[1], d[2]),
    "cos": lambda x, a, d: -(a[0].sin() * d[0]),
    "sin": lambda x, a, d: a[0].cos() * d[0],
    "total": lambda x, a, d: total(d[0]),
    "rows": lambda x, a, d: rows(d[0]),
    "across": lambda x, a, d: across(d[0]),
}
