"""Expressions: what formulas leave behind when they are run on them instead of on floats.

An expression is a node of a graph. Equal nodes of one graph are one object, so common parts of
formulas are there once. A node may stand for one number per ball (``each``): ``total`` adds such a
node up over the balls. Where numbers have lanes, ``lane`` takes one of them, for all lanes, and
``across`` adds them up.
"""

from collections.abc import Callable, Container, Iterable
from enum import IntEnum
from typing import Any, NoReturn


class Level(IntEnum):
    """When the value of a node is known; a node is known as late as the latest of its arguments."""

    CONSTANT = 0
    """When code is made."""
    PARAMETER = 1
    """Before a run: parameters of a scene."""
    TIME = 2
    STATE = 3


class Graph:
    """The nodes that one trace makes."""

    def __init__(self) -> None:
        self._nodes: dict[tuple[Any, ...], Expression] = {}

    def __len__(self) -> int:
        return len(self._nodes)

    def constant(self, value: float) -> "Expression":
        """A number that is known now."""
        value = float(value)
        # By its digits: -0.0 is not 0.0, and NaN is itself.
        return self._node("const", (), Level.CONSTANT, False, value, value.hex())

    def input(self, name: str, level: Level = Level.STATE, each: bool = False) -> "Expression":
        """A number that is given; with ``each``, one per ball.

        Raises:
            ValueError: there is an input of that name that is known at another time, or of another
                shape.
        """
        node = self._node("input", (), level, each, name, name)
        if (node.level, node.each) != (level, each):
            raise ValueError(f"input {name!r} is there already, as {node.level.name}, {node.each=}")
        return node

    def node(self, op: str, *args: "Expression") -> "Expression":
        """An operation on nodes of this graph."""
        each, level = op == "rows", Level.TIME if op == "rows" else Level.CONSTANT
        for arg in args:
            if arg.graph is not self:
                raise ValueError(f"{op} of expressions of different graphs")
            each = each or (arg.each and op != "total")
            if arg.level > level:
                level = arg.level
        numbers = [arg.number for arg in args]
        if op in ("add", "mul", "fma") and numbers[0] > numbers[1]:
            # The first two commute: either order is the same node, printed as written first.
            numbers[:2] = numbers[1::-1]
        return self._node(op, args, level, each, None, tuple(numbers))

    def lane(self, x: "Expression", k: int) -> "Expression":
        """Lane k of a node of this graph, in all lanes."""
        return self._node("lane", (x,), x.level, x.each, k, (x.number, k))

    def _node(
        self, op: str, args: Any, level: Level, each: bool, payload: Any, key: Any
    ) -> "Expression":
        found = self._nodes.get((op, key))
        if found is None:
            found = Expression()
            found.graph, found.op, found.args = self, op, args
            found.level, found.each, found.payload = level, each, payload
            found.number = len(self._nodes)
            self._nodes[op, key] = found
        return found


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
    """Whether it stands for one number per ball."""
    level: Level
    payload: Any
    """Value of a constant, name of an input, which lane."""
    number: int
    """In the order in which the graph's nodes were made: after all its arguments."""

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

    # What numpy's functions of the same names call.
    def cos(self) -> "Expression":
        """Cosine; an angle [rad]."""
        return self.graph.node("cos", self)

    def sin(self) -> "Expression":
        """Sine; an angle [rad]."""
        return self.graph.node("sin", self)

    def sqrt(self) -> "Expression":
        """Square root."""
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
    """An expression as it is, a number as a constant."""
    return value if isinstance(value, Expression) else graph.constant(value)


def is_constant(x: Expression, value: float | None = None) -> bool:
    """Whether a node is a constant, or that constant (0.0 is -0.0 here)."""
    return x.op == "const" and (value is None or x.payload == value)


def add(a: Expression, b: Expression) -> Expression:
    """A sum; one with 0 is the other term."""
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
    """A difference."""
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
    """A product; signs go to the front."""
    if is_constant(a) and is_constant(b):
        return a.graph.constant(a.payload * b.payload)
    if is_constant(a):
        a, b = b, a
    if is_constant(b, 0.0):
        # Also of what may be infinite: a term with the factor 0 is not computed.
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
    """A quotient."""
    if is_constant(a) and is_constant(b) and b.payload:
        return a.graph.constant(a.payload / b.payload)
    if is_constant(b, 1.0):
        return a
    if is_constant(a, 0.0):
        return a.graph.constant(0.0)
    return a.graph.node("div", a, b)


def neg(a: Expression) -> Expression:
    """The opposite."""
    if is_constant(a):
        return a.graph.constant(-a.payload)
    return a.args[0] if a.op == "neg" else a.graph.node("neg", a)


def fma(a: Expression, b: Expression, c: Expression) -> Expression:
    """a b + c, rounded once."""
    if is_constant(a, 0.0) or is_constant(b, 0.0):
        return c
    return a.graph.node("fma", a, b, c)


def where(condition: Expression, a: Expression, b: Expression) -> Expression:
    """``a`` where a condition holds, else ``b``."""
    return a if a is b else a.graph.node("where", condition, a, b)


def total(a: Expression) -> Expression:
    """The sum over the balls of a node; of one that is the same for all, too."""
    return a if is_constant(a, 0.0) else a.graph.node("total", a)


def lane(a: Expression, k: int) -> Expression:
    """Lane k of a node that has an element in each, in all lanes."""
    return a if is_constant(a) or a.op in ("lane", "across") else a.graph.lane(a, k)


def across(a: Expression) -> Expression:
    """The sum of a node's lanes, in all of them."""
    return a if is_constant(a, 0.0) else a.graph.node("across", a)


def rows(a: Expression) -> Expression:
    """Of each ball, what a matrix makes of a node that stands for a number per ball.

    The matrix is symmetric, and the input ``ROWS`` of whoever emits it, column by column: balls of
    a row that moves as one have an acceleration in common. It may change at events.
    """
    return a if is_constant(a, 0.0) else a.graph.node("rows", a)


ROWS = "rows"

REBUILD: dict[str, Callable[..., "Expression"]] = {
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
    """The operation of a node on other arguments."""
    own = tuple(args)
    if own == x.args:
        return x
    if x.op == "total":
        return total(own[0])
    if x.op == "lane":
        return lane(own[0], x.payload)
    return REBUILD[x.op](*own) if x.op in REBUILD else x.graph.node(x.op, *own)


def reached(roots: Iterable[Expression], known: Container[int] = ()) -> list[Expression]:
    """All nodes that some depend on, and these; arguments first.

    Args:
        roots: of one graph.
        known: numbers of nodes whose arguments do not count.
    """
    seen: dict[int, Expression] = {}
    ahead = list(roots)
    while ahead:
        x = ahead.pop()
        if x.number not in seen:
            seen[x.number] = x
            ahead += () if x.number in known else x.args
    return [seen[number] for number in sorted(seen)]


_SIGNS = {"add": "+", "sub": "-", "mul": "*", "div": "/", "lt": "<", "le": "<="}


def shown(x: Expression, depth: int = 6) -> str:
    """An expression in words, for messages: to some depth."""
    if x.op == "const":
        return f"{x.payload:g}"
    if x.op == "input":
        return f"{x.payload}_i" if x.each else str(x.payload)
    if depth == 0:
        return "..."
    args = [shown(arg, depth - 1) for arg in x.args]
    if x.op in _SIGNS:
        return f"({args[0]} {_SIGNS[x.op]} {args[1]})"
    if x.op == "lane":
        return f"lane({args[0]}, {x.payload})"
    return f"-{args[0]}" if x.op == "neg" else f"{x.op}({', '.join(args)})"


def _binary(make: Any, own: Expression, other: Any) -> Any:
    if not isinstance(other, Expression | float | int):
        return NotImplemented
    return make(own, lifted(own.graph, other))


def _reflected(make: Any, own: Expression, other: Any) -> Any:
    if not isinstance(other, float | int):
        return NotImplemented
    return make(own.graph.constant(other), own)
