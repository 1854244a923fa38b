"""Derivatives of expressions: along a direction, and of high order along a motion (Taylor series).

Taylor coefficients are automatic differentiation of high order: Moore, Interval Analysis (1966),
ch. 11; Jorba and Zou (2005), Exp. Math. 14, 99-117; Griewank and Walther, Evaluating Derivatives
(2008), ch. 13. Coefficient k of x' = f(x) is coefficient k - 1 of f, divided by k; coefficients of
f follow from those of its parts by one recurrence per operation.
"""

import copy
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

from ab_sim.tracing.expression import (
    Expression,
    Graph,
    Level,
    across,
    fma,
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


class _Term(NamedTuple):
    """Term of a sum: a factor that is known before a run, times a node or a product of two."""

    minus: bool
    factor: Expression
    parts: tuple[Expression, ...]


class PowerSeries:
    """Taylor coefficients, in powers of the time since an instant, of expressions of one graph.

    Sums are taken apart into terms, and terms with the same factor are added before they are
    multiplied by it, so that all products of series in a sum are one chain of fused operations.

    Parameters
    ----------
    rates
        Rate of change of each input that moves. Other inputs stay constant.
    roots
        Expressions whose coefficients will be requested, besides those of the rates. Nodes that
        several of them use are not taken apart.
    """

    def __init__(
        self, rates: Mapping[Expression, Expression], roots: Iterable[Expression] = ()
    ) -> None:
        self._rates = dict(rates)
        nodes = reachable_nodes([*self._rates.values(), *roots])
        self._uses = Counter(arg.number for x in nodes for arg in x.args)
        self._coefficients: dict[tuple[int, int], Expression] = {}
        """Taylor coefficients computed so far, by node number and power of time."""
        self._sums: dict[int, list[_Term]] = {}
        """Terms into which nodes have been taken apart, by node number."""

    def give(self, x: Expression, k: int, value: Expression) -> None:
        """Set coefficient k of a node, which is then not derived from other coefficients."""
        self._coefficients[x.number, k] = value

    def without(self, unknown: Iterable[Expression], k: int) -> "PowerSeries":
        """Return a copy with coefficient k, as yet unknown, of the nodes ``unknown`` set to 0."""
        ahead = copy.copy(self)
        ahead._coefficients = dict(self._coefficients)
        for x in unknown:
            ahead.give(x, k, x.graph.constant(0.0))
        return ahead

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

    def product(self, a: Expression, b: Expression, k: int, first: int = 0) -> Expression:
        """Return coefficient k of the product a b, with a's coefficients from ``first`` on.

        This is the Cauchy product, sum over i of a_i b_(k-i).
        """
        return _chain(a.graph, [self._pair(False, a, i, b, k - i) for i in range(first, k + 1)])

    def _pair(self, minus: bool, a: Expression, i: int, b: Expression, j: int) -> "_Addend":
        """Return the addend a_i b_j, ranked by the order of what is computed last."""
        moving = [(n, x.op != "input") for n, x in ((i, a), (j, b)) if x.level == Level.STATE]
        return _Addend(
            (True, *max(moving, default=(0, False))),
            minus,
            self.coefficient(a, i),
            self.coefficient(b, j),
        )

    def change(self, x: Expression, k: int) -> Expression:
        """Return coefficient k of the node's rate of change."""
        return self.coefficient(x, k + 1) * float(k + 1)

    def rate(self, x: Expression) -> Expression | None:
        """Return the expression of an input's rate of change, or None."""
        return self._rates.get(x)

    def _terms(self, x: Expression) -> list[_Term]:
        """Return the terms of a sum or product."""
        if x.number in self._sums:
            return self._sums[x.number]
        terms, ahead = [], [(False, lifted(x.graph, 1.0), x)]
        while ahead:
            minus, factor, node = _split(*ahead.pop())
            apart = node is x or self._uses[node.number] < 2
            if node.op in ("add", "sub") and apart:
                ahead += [(minus ^ (node.op == "sub"), factor, node.args[1])]
                ahead += [(minus, factor, node.args[0])]
                continue
            parts: tuple[Expression, ...] = (node,)
            if node.op == "fma" and apart:
                ahead += [(minus, factor, node.args[2])]
            if node.op in ("mul", "fma") and apart:
                one = lifted(x.graph, 1.0)
                (m, f, a), (n, g, b) = (_split(False, one, arg) for arg in node.args[:2])
                minus, factor = minus ^ m ^ n, factor * f * g
                parts = (a, b) if a.number < b.number else (b, a)
            terms.append(_Term(minus, factor, parts))
        self._sums[x.number] = terms
        return terms

    def _sum(self, x: Expression, k: int, scale: float = 1.0) -> Expression:
        """Return coefficient k of a sum or product, times a number."""
        groups: dict[Expression, list[_Term]] = {}
        for term in self._terms(x):
            groups.setdefault(term.factor, []).append(term)
        if len(groups) == 1:
            ((factor, terms),) = groups.items()
            total = _chain(x.graph, self._addends(terms, terms[0].minus, k)) * (factor * scale)
            return -total if terms[0].minus else total
        addends: list[_Addend] = []
        for factor, terms in groups.items():
            if is_constant(factor, 1.0):
                addends += self._addends(terms, False, k)
            else:
                # Each group has the sign of its first term, so that groups with opposite signs
                # share their sums.
                minus, inner = terms[0].minus, self._addends(terms, terms[0].minus, k)
                rank = (True, *max(addend.rank[1:] for addend in inner))
                addends.append(_Addend(rank, minus, factor, _chain(x.graph, inner)))
        return _chain(x.graph, addends) * scale

    def _addends(self, terms: Iterable[_Term], opposite: bool, k: int) -> "list[_Addend]":
        """Return the addends of coefficient k of some terms, without their factors."""
        of, addends = self.coefficient, []
        for term in terms:
            minus, a, b = term.minus != opposite, term.parts[0], term.parts[-1]
            one, two = (lifted(a.graph, value) for value in (1.0, 2.0))
            if len(term.parts) == 1:
                state = a.level == Level.STATE
                rank = (False, k * state, state and a.op != "input")
                addends.append(_Addend(rank, minus, one, of(a, k)))
            elif a is b:
                # A square takes half the products.
                twice = [self._pair(False, a, i, a, k - i) for i in range((k + 1) // 2)]
                state = a.level == Level.STATE
                rank = (True, k * state, state)
                addends.append(_Addend(rank, minus, two, _chain(a.graph, twice)))
                if k % 2 == 0:
                    addends.append(self._pair(minus, a, k // 2, a, k // 2))
            else:
                addends += [self._pair(minus, a, i, b, k - i) for i in range(k + 1)]
        return addends

    def _derived(self, x: Expression, k: int) -> Expression:
        """Return coefficient k of a node, from lower coefficients and those of the arguments."""
        of, args, graph = self.coefficient, x.args, x.graph
        if x.op == "input":
            if k == 0:
                return x
            rate = self._rates.get(x)
            if rate is None:
                return graph.constant(0.0)
            is_sum = rate.op in _SUMS and rate.level > Level.PARAMETER
            return self._sum(rate, k - 1, 1.0 / k) if is_sum else of(rate, k - 1) * (1.0 / k)
        if x.op in _SUMS:
            return self._sum(x, k)
        if x.op == "total":
            return rebuilt(x, [of(arg, k) for arg in args])
        if x.op == "where" and args[0].level <= Level.PARAMETER:
            return where(args[0], of(args[1], k), of(args[2], k))
        if x.op not in _COEFFICIENTS:
            raise NotAnalyticError(f"{x.op} has no Taylor series: {x}")
        return (
            rebuilt(x, [of(arg, 0) for arg in args]) if k == 0 else _COEFFICIENTS[x.op](self, x, k)
        )


_SUMS = ("add", "sub", "neg", "mul", "fma")
"""Operations whose coefficients are sums of products."""


class _Addend(NamedTuple):
    """Product of two numbers in a sum."""

    rank: tuple[bool, int, bool]
    """Rank in the sum: false for a number without a factor; order of the coefficient that is
    computed last; true if that is not a state. It does not depend on the law of the speed, so that
    runs along different laws have equal bits while the laws are equal."""
    minus: bool
    """True to subtract the product."""
    a: Expression
    b: Expression


def _chain(graph: Graph, addends: Iterable[_Addend]) -> Expression:
    """Return a sum of products.

    Those that are computed last are added last, so that the sum waits for them as little as
    possible. Numbers without a factor come first: they take no operation.
    """
    total = graph.constant(0.0)
    for _, minus, a, b in sorted(addends, key=lambda addend: addend.rank):
        if is_constant(a, 1.0) or is_constant(total, 0.0) or (a * b).level <= Level.PARAMETER:
            total = total - a * b if minus else total + a * b
        else:
            # All products but the first are fused, so that a product of 0 changes no rounding.
            total = fma(-a if minus else a, b, total)
    return total


def _split(minus: bool, factor: Expression, x: Expression) -> tuple[bool, Expression, Expression]:
    """Move a node's sign, and the factors of a state that are known before a run, out of it.

    Products of numbers that depend on time only stay whole: the law of the speed must not change
    the order of operations.
    """
    while x.level > Level.PARAMETER:
        is_scaled = x.op == "mul" and min(arg.level for arg in x.args) <= Level.PARAMETER
        if x.op == "neg":
            minus, x = not minus, x.args[0]
        elif is_scaled and x.level == Level.STATE:
            number, x = sorted(x.args, key=lambda arg: arg.level)
            factor = factor * number
        else:
            break
    return minus, factor, x


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
    rate = of.rate(angle)
    if rate is not None:
        return of.coefficient(other * rate, k - 1) * (sign / k)
    for j in sorted(range(k), key=lambda j: max(j, k - 1 - j)):
        coefficient = coefficient + of.change(angle, j) * of.coefficient(other, k - 1 - j)
    return coefficient * (sign / k)


_COEFFICIENTS: dict[str, Callable[[PowerSeries, Expression, int], Expression]] = {
    "div": _quotient,
    "sqrt": _root,
    "cos": _turning,
    "sin": _turning,
}
