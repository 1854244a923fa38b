"""Expressions: recorded operations of a formula that is called with expressions, not floats.

An expression is a node of a graph. Equal nodes of one graph are one object (hash consing), so a
common subexpression exists once. A node may stand for one number per ball (``each``); ``total``
sums such a node over the balls. If numbers have lanes, ``across`` sums over the lanes.
"""

from collections.abc import Callable, Container, Iterable
from enum import IntEnum
from typing import Any, NoReturn


class Level(IntEnum):
    """Stage at which a node's value becomes known: the latest stage of its arguments."""

    CONSTANT = 0
    """Value known when code is generated."""
    PARAMETER = 1
    """Value known before a run, computed from parameters of the scene."""
    TIME = 2
    """Value that depends on time, not on the state."""
    STATE = 3
    """Value that depends on the state."""


class Graph:
    """Expressions of one trace as nodes; equal expressions are the same node."""

    def __init__(self) -> None:
        self._nodes: dict[tuple[Any, ...], Expression] = {}

    def __len__(self) -> int:
        return len(self._nodes)

    def constant(self, value: float) -> "Expression":
        """Return the node of a constant, the same object for the same number."""
        value = float(value)
        # The key is the hexadecimal text: it tells -0.0 from 0.0, and NaN equals itself.
        return self._node("const", (), Level.CONSTANT, False, value, value.hex())

    def input(self, name: str, level: Level = Level.STATE, per_ball: bool = False) -> "Expression":
        """Return the node of an input.

        Parameters
        ----------
        name
            Name of the input, unique in the graph.
        level
            Stage at which its value becomes known.
        per_ball
            True if it stands for one number per ball.

        Raises
        ------
        ValueError
            An input of that name exists with another level or shape.
        """
        node = self._node("input", (), level, per_ball, name, name)
        if (node.level, node.each) != (level, per_ball):
            raise ValueError(f"input {name!r} is there already, as {node.level.name}, {node.each=}")
        return node

    def node(self, op: str, *args: "Expression") -> "Expression":
        """Return the node of the operation ``op`` on nodes of this graph.

        Raises
        ------
        ValueError
            An argument belongs to another graph.
        """
        per_ball, level = op == "rows", Level.TIME if op == "rows" else Level.CONSTANT
        for arg in args:
            if arg.graph is not self:
                raise ValueError(f"{op} of expressions of different graphs")
            per_ball = per_ball or (arg.each and op != "total")
            if arg.level > level:
                level = arg.level
        numbers = [arg.number for arg in args]
        if op in ("add", "mul", "fma") and numbers[0] > numbers[1]:
            # The first two arguments commute, so both orders are one node. It is printed in the
            # order that came first.
            numbers[:2] = numbers[1::-1]
        return self._node(op, args, level, per_ball, None, tuple(numbers))

    def _node(
        self, op: str, args: Any, level: Level, per_ball: bool, payload: Any, key: Any
    ) -> "Expression":
        # Common subexpressions: the key names the operation and its arguments' numbers, so an
        # operation that exists already is returned instead of a second node.
        node = self._nodes.get((op, key))
        if node is None:
            node = Expression()
            node.graph, node.op, node.args = self, op, args
            node.level, node.each, node.payload = level, per_ball, payload
            node.number = len(self._nodes)
            self._nodes[op, key] = node
        return node


class Expression:
    """A node: an operation on other nodes, a constant, or an input.

    Arithmetic and comparisons make new nodes. ``==`` compares nodes, not values: equal nodes are
    one object.
    """

    __slots__ = ("args", "each", "graph", "level", "number", "op", "payload")

    graph: Graph
    op: str
    args: "tuple[Expression, ...]"
    each: bool
    """True if the node stands for one number per ball."""
    level: Level
    payload: Any
    """Value of a constant, or name of an input."""
    number: int
    """Position in the order of creation; a node's arguments have smaller numbers."""

    def __add__(self, other: Any) -> "Expression":
        return _binary(add, self, other)

    def __radd__(self, other: Any) -> "Expression":
        return _reflected(add, self, other)

    def __sub__(self, other: Any) -> "Expression":
        return _binary(sub, self, other)

    def __rsub__(self, other: Any) -> "Expression":
        return _reflected(sub, self, other)

    def __mul__(self, other: Any) -> "Expression":
        return _binary(mul, self, other)

    def __rmul__(self, other: Any) -> "Expression":
        return _reflected(mul, self, other)

    def __truediv__(self, other: Any) -> "Expression":
        return _binary(div, self, other)

    def __rtruediv__(self, other: Any) -> "Expression":
        return _reflected(div, self, other)

    def __pow__(self, power: Any) -> "Expression":
        if not isinstance(power, int) or not 1 <= power <= 16:
            raise TypeError(f"power {power!r} of a traced number: must be a whole number, 1 to 16")
        half = self ** (power // 2) if power > 1 else None
        if half is None:
            return self
        return half * half * self if power % 2 else half * half

    def __neg__(self) -> "Expression":
        return neg(self)

    def __pos__(self) -> "Expression":
        return self

    def __abs__(self) -> "Expression":
        return self.graph.node("abs", self)

    def __lt__(self, other: Any) -> "Expression":
        return self.graph.node("lt", self, lifted(self.graph, other))

    def __gt__(self, other: Any) -> "Expression":
        return self.graph.node("lt", lifted(self.graph, other), self)

    def __le__(self, other: Any) -> "Expression":
        return self.graph.node("le", self, lifted(self.graph, other))

    def __ge__(self, other: Any) -> "Expression":
        return self.graph.node("le", lifted(self.graph, other), self)

    # numpy's functions of the same names call these methods on arrays of objects.
    def cos(self) -> "Expression":
        """Return the cosine of an angle [rad]."""
        return self.graph.node("cos", self)

    def sin(self) -> "Expression":
        """Return the sine of an angle [rad]."""
        return self.graph.node("sin", self)

    def sqrt(self) -> "Expression":
        """Return the square root."""
        return self.graph.node("sqrt", self)

    def __bool__(self) -> NoReturn:
        raise TypeError(f"a branch on a traced number: write where(...); it is {self}")

    def __float__(self) -> NoReturn:
        raise TypeError(
            "a traced number where a float is needed: take cos, sin, sqrt from "
            f"ab_sim.tracing, not from math; it is {self}"
        )

    def __repr__(self) -> str:
        return shown(self)


def lifted(graph: Graph, value: Any) -> Expression:
    """Return an expression unchanged, and a number as a constant."""
    return value if isinstance(value, Expression) else graph.constant(value)


def is_constant(x: Expression, value: float | None = None) -> bool:
    """Return whether a node is a constant, or is the given constant (0.0 equals -0.0 here)."""
    return x.op == "const" and (value is None or x.payload == value)


def add(a: Expression, b: Expression) -> Expression:
    """Return a sum; if one term is the constant 0, the other term."""
    if is_constant(a) and is_constant(b):
        return a.graph.constant(a.payload + b.payload)
    if is_constant(a, 0.0):
        return b
    if is_constant(b, 0.0):
        return a
    if b.op == "neg":
        return sub(a, b.args[0])
    if a.op == "neg":
        return sub(b, a.args[0])
    return a.graph.node("add", a, b)


def sub(a: Expression, b: Expression) -> Expression:
    """Return a - b, simplified for constants and signs."""
    if is_constant(a) and is_constant(b):
        return a.graph.constant(a.payload - b.payload)
    if is_constant(b, 0.0):
        return a
    if is_constant(a, 0.0):
        return neg(b)
    if b.op == "neg":
        return add(a, b.args[0])
    return a.graph.node("sub", a, b)


def mul(a: Expression, b: Expression) -> Expression:
    """Return a product; minus signs of the factors are moved in front of the product."""
    if is_constant(a) and is_constant(b):
        return a.graph.constant(a.payload * b.payload)
    if is_constant(a):
        a, b = b, a
    if is_constant(b, 0.0):
        # Even if the other factor may be infinite: a term with the factor 0 is not computed.
        return a.graph.constant(0.0)
    if is_constant(b, 1.0):
        return a
    if is_constant(b, -1.0):
        return neg(a)
    if a.op == "neg":
        return neg(mul(a.args[0], b))
    if b.op == "neg":
        return neg(mul(a, b.args[0]))
    return a.graph.node("mul", a, b)


def div(a: Expression, b: Expression) -> Expression:
    """Return a / b, simplified for constants and signs."""
    if is_constant(a) and is_constant(b) and b.payload:
        return a.graph.constant(a.payload / b.payload)
    if is_constant(b, 1.0):
        return a
    if is_constant(a, 0.0):
        return a.graph.constant(0.0)
    return a.graph.node("div", a, b)


def neg(a: Expression) -> Expression:
    """Return the negative of a node."""
    if is_constant(a):
        return a.graph.constant(-a.payload)
    return a.args[0] if a.op == "neg" else a.graph.node("neg", a)


def fma(a: Expression, b: Expression, c: Expression) -> Expression:
    """Return a b + c, rounded once."""
    if is_constant(a, 0.0) or is_constant(b, 0.0):
        return c
    return a.graph.node("fma", a, b, c)


def where(condition: Expression, a: Expression, b: Expression) -> Expression:
    """Return ``a`` if a condition holds, else ``b``."""
    return a if a is b else a.graph.node("where", condition, a, b)


def total(a: Expression) -> Expression:
    """Return the sum of a node over the balls; a shared value is counted once for each ball."""
    return a if is_constant(a, 0.0) else a.graph.node("total", a)


def across(a: Expression) -> Expression:
    """Return a node that has, in every lane, the sum of a node's values over all lanes."""
    return a if is_constant(a, 0.0) else a.graph.node("across", a)


def rows(a: Expression) -> Expression:
    """Return the product of a symmetric matrix with a node that has one number per ball.

    The matrix gives touching balls that move as one row a common acceleration. It may change at
    events. Emitted code reads it, column by column, from the input named ``ROWS``.
    """
    return a if is_constant(a, 0.0) else a.graph.node("rows", a)


ROWS = "rows"
"""Name of the input that holds the matrix of ``rows``."""

_REBUILD: dict[str, Callable[..., "Expression"]] = {
    "add": add,
    "sub": sub,
    "mul": mul,
    "div": div,
    "neg": neg,
    "fma": fma,
    "where": where,
    "across": across,
}


def rebuilt(x: Expression, args: Iterable[Expression]) -> Expression:
    """Return the operation of a node applied to other arguments."""
    arguments = tuple(args)
    if arguments == x.args:
        return x
    if x.op == "total":
        return total(arguments[0])
    return _REBUILD[x.op](*arguments) if x.op in _REBUILD else x.graph.node(x.op, *arguments)


def reachable_nodes(
    roots: Iterable[Expression], known_numbers: Container[int] = ()
) -> list[Expression]:
    """Return the roots and all nodes on which they depend, arguments first.

    Parameters
    ----------
    roots
        Nodes of one graph.
    known_numbers
        Numbers of nodes whose arguments are not followed.
    """
    seen: dict[int, Expression] = {}
    ahead = list(roots)
    while ahead:
        x = ahead.pop()
        if x.number not in seen:
            seen[x.number] = x
            ahead += () if x.number in known_numbers else x.args
    # Numbers grow from arguments to results, so sorting by them is a topological order.
    return [seen[number] for number in sorted(seen)]


_SIGNS = {"add": "+", "sub": "-", "mul": "*", "div": "/", "lt": "<", "le": "<="}


def shown(x: Expression, depth: int = 6) -> str:
    """Return an expression as text for messages, down to a depth."""
    if x.op == "const":
        return f"{x.payload:g}"
    if x.op == "input":
        return f"{x.payload}_i" if x.each else str(x.payload)
    if depth == 0:
        return "..."
    args = [shown(arg, depth - 1) for arg in x.args]
    if x.op in _SIGNS:
        return f"({args[0]} {_SIGNS[x.op]} {args[1]})"
    return f"-{args[0]}" if x.op == "neg" else f"{x.op}({', '.join(args)})"


def _binary(make: Any, operand: Expression, other: Any) -> Any:
    """Return ``make(operand, other)``; for another type, let Python try the other operand."""
    if not isinstance(other, Expression | float | int):
        return NotImplemented
    return make(operand, lifted(operand.graph, other))


def _reflected(make: Any, operand: Expression, other: Any) -> Any:
    """Return ``make(other, operand)`` for a number on the left of an expression."""
    if not isinstance(other, float | int):
        return NotImplemented
    return make(operand.graph.constant(other), operand)
