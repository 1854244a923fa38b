"""Derivatives of expressions: along a direction, and of high order along a motion (Taylor series).

Taylor coefficients are automatic differentiation of high order: Moore, Interval Analysis (1966),
ch. 11; Jorba and Zou (2005), Exp. Math. 14, 99-117; Griewank and Walther, Evaluating Derivatives
(2008), ch. 13. Coefficient k of x' = f(x) is coefficient k - 1 of f, divided by k; coefficients of
f follow from those of its parts by one recurrence per operation.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence

from ab_sim.tracing.expression import (
    Expression,
    Level,
    across,
    is_constant,
    lifted,
    reachable_nodes,
    rebuilt,
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

    Parameters
    ----------
    roots
        Expressions of one graph.
    along
        Rate of change of each input, an expression of the same graph; inputs that are missing stay
        constant.

    Returns
    -------
    list[Expression]
        Rates of change of the roots, in the order of the roots. The rate of ``abs`` at 0 is that of
        its argument. The rate of ``where`` is that of the branch taken, also at the switch, where
        the function has no derivative.

    Raises
    ------
    ValueError
        A key of ``along`` is not an input.
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
            rates[x.number] = _CHANGES[x.op](x, x.args, changes)
    return [rates[root.number] for root in roots]


_CHANGES: dict[str, Rule] = {
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


class NotAnalyticError(ValueError):
    """Error of an operation that has no Taylor series."""


class PowerSeries:
    """Taylor coefficients, in powers of the time since an instant, of expressions of one graph.

    Parameters
    ----------
    rates
        Rate of change of each input that moves. Other inputs stay constant.
    """

    def __init__(self, rates: Mapping[Expression, Expression]) -> None:
        self._rates = dict(rates)
        self._coefficients: dict[tuple[int, int], Expression] = {}
        """Coefficients so far, by a node's number and the power of time."""

    def give(self, x: Expression, k: int, value: Expression) -> None:
        """Set coefficient k of a node, instead of deriving it."""
        self._coefficients[x.number, k] = value

    def without(self, x: Expression, k: int) -> "PowerSeries":
        """Return a copy in which coefficient k of a node is 0, e.g. because it is not known yet."""
        copy = PowerSeries(self._rates)
        copy._coefficients = {**self._coefficients, (x.number, k): x.graph.constant(0.0)}
        return copy

    def coefficient(self, x: Expression, k: int) -> Expression:
        """Return a node's coefficient of the k-th power of time.

        Raises
        ------
        NotAnalyticError
            The node, or one on which it depends, has no Taylor series.
        """
        if x.level <= Level.PARAMETER:
            return x if k == 0 else x.graph.constant(0.0)
        key = x.number, k
        if key not in self._coefficients:
            self._coefficients[key] = self._derived(x, k)
        return self._coefficients[key]

    def change(self, x: Expression, k: int) -> Expression:
        """Return coefficient k of the node's rate of change."""
        rate = self._rates.get(x)
        if rate is not None:
            return self.coefficient(rate, k)
        return self.coefficient(x, k + 1) * float(k + 1)

    def product(self, a: Expression, b: Expression, k: int, first: int = 0) -> Expression:
        """Return coefficient k of the product a b, with a's coefficients from ``first`` on.

        This is the Cauchy product, sum over i of a_i b_(k-i). Terms with the highest orders, which
        are computed last, are added last, so that the sum waits for them as little as possible. A
        square takes half the products.
        """
        of, is_square = self.coefficient, a is b and first == 0
        once = twice = a.graph.constant(0.0)
        for i in sorted(range(first, k + 1), key=lambda i: (max(i, k - i), i)):
            if not is_square or 2 * i == k:
                once = once + of(a, i) * of(b, k - i)
            elif 2 * i < k:
                twice = twice + of(a, i) * of(a, k - i)
        return once if is_constant(twice, 0.0) else once + 2.0 * twice

    def _derived(self, x: Expression, k: int) -> Expression:
        """Return coefficient k of a node, from its lower ones and those of its arguments."""
        of, args, graph = self.coefficient, x.args, x.graph
        if x.op == "input":
            if k == 0:
                return x
            rate = self._rates.get(x)
            return graph.constant(0.0) if rate is None else of(rate, k - 1) * (1.0 / k)
        if x.op in ("add", "sub", "neg", "total"):
            return rebuilt(x, [of(arg, k) for arg in args])
        if x.op == "fma":
            return self.product(args[0], args[1], k) + of(args[2], k)
        if x.op == "mul":
            return self.product(args[0], args[1], k)
        if x.op == "where" and args[0].level <= Level.PARAMETER:
            return where(args[0], of(args[1], k), of(args[2], k))
        if x.op not in _COEFFICIENTS:
            raise NotAnalyticError(f"{x.op} has no Taylor series: {x}")
        return (
            rebuilt(x, [of(arg, 0) for arg in args]) if k == 0 else _COEFFICIENTS[x.op](self, x, k)
        )


def _quotient(of: PowerSeries, x: Expression, k: int) -> Expression:
    """Return coefficient k of x = a / b.

    From b x = a: b_0 x_k = a_k - sum over i >= 1 of b_i x_(k-i).
    """
    a, b = x.args
    return (of.coefficient(a, k) - of.product(b, x, k, 1)) * (1.0 / of.coefficient(b, 0))


def _root(of: PowerSeries, x: Expression, k: int) -> Expression:
    """Return coefficient k of x = sqrt(a).

    From x x = a: 2 x_0 x_k = a_k - sum over 0 < i < k of x_i x_(k-i).
    """
    inner = lifted(x.graph, 0.0)
    for i in range(1, k):
        inner = inner + of.coefficient(x, i) * of.coefficient(x, k - i)
    return (of.coefficient(x.args[0], k) - inner) * (0.5 / of.coefficient(x, 0))


def _turning(of: PowerSeries, x: Expression, k: int) -> Expression:
    """Return coefficient k of a cosine or sine from lower ones of the other function.

    From (cos u)' = -u' sin u and (sin u)' = u' cos u, whose coefficient k - 1 is a Cauchy product.
    """
    angle, coefficient = x.args[0], lifted(x.graph, 0.0)
    other, sign = (angle.sin(), -1.0) if x.op == "cos" else (angle.cos(), 1.0)
    for j in sorted(range(k), key=lambda j: max(j, k - 1 - j)):
        coefficient = coefficient + of.change(angle, j) * of.coefficient(other, k - 1 - j)
    return coefficient * (sign / k)


_COEFFICIENTS: dict[str, Callable[[PowerSeries, Expression, int], Expression]] = {
    "div": _quotient,
    "sqrt": _root,
    "cos": _turning,
    "sin": _turning,
}
