"""Emit lowered expressions as LLVM IR, for one run or for several in lanes.

A number is a double, or a vector with an element per lane. A quantity per ball is, in a single run,
one or more vectors of up to eight balls; in lanes, it is one such number per ball. All sums over
balls are in the order of ``functions.added_up``, so both forms give bitwise the same results.
"""

import struct
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ab_sim.tracing.expression import ROWS, Expression, reachable_nodes
from ab_sim.tracing.functions import GROUP, added_up
from ab_sim.tracing.scheduling import scheduled


class Shape(NamedTuple):
    """Number of balls and lanes, which decide how a node is held in memory and in vectors."""

    balls: int
    lanes: int = 1
    """Number of runs computed together; a number's elements, one per lane, are adjacent in
    memory."""

    def widths(self, per_ball: bool) -> list[int]:
        """Return the widths of the vectors of a node; with ``per_ball``, those for all balls."""
        if not per_ball:
            return [self.lanes]
        if self.lanes > 1:
            return [self.lanes] * self.balls
        whole, rest = divmod(self.balls, GROUP)
        return [GROUP] * whole + [rest] * (rest > 0)


class MemorySlot(NamedTuple):
    """Position of a number in memory; for a quantity per ball, that of the first ball."""

    pointer: str
    at: int
    """Offset in numbers; a number takes ``lanes`` doubles, or one if the pointer is uniform."""
    stride: int = 1
    """Distance from one ball to the next, in numbers."""


class StoredRoot(NamedTuple):
    """Expression to compute (a root), and the memory that gets the value."""

    root: Expression
    place: MemorySlot
    per_ball: bool = False
    """True to store one value per ball, even if the value is the same for all balls."""


_ATTRIBUTES = 'nounwind "frame-pointer"="all"'
"""Attributes of functions. Only with a frame pointer does LLVM align the stack to whole vectors;
otherwise, most values that do not fit into registers straddle two cache lines."""


class Function:
    """Function of pointers to doubles and of doubles, built line by line.

    Parameters
    ----------
    name
        Name of the function.
    pointers
        Names of its first arguments.
    shape
        Shape of the numbers with which it computes.
    numbers
        Names of further arguments, doubles.
    uniform
        Pointers to numbers that are one double each, the same for all lanes.
    """

    def __init__(
        self,
        name: str,
        pointers: Sequence[str],
        shape: Shape,
        numbers: Sequence[str] = (),
        uniform: Sequence[str] = (),
    ) -> None:
        self.name, self.pointers, self.shape = name, pointers, shape
        self.numbers, self.uniform = numbers, frozenset(uniform)
        self.lines: list[str] = []
        self.declared: set[str] = set()
        self._count = 0
        self._wide: dict[tuple[str, int], str] = {}

    def new(self) -> str:
        """Return an unused numbered name for a value, which LLVM handles faster than a word."""
        self._count += 1
        return f"%{self._count}"

    def put(self, text: str) -> str:
        """Append a line that computes a value, and return the value's name."""
        name = self.new()
        self.lines.append(f"{name} = {text}")
        return name

    def load(self, place: MemorySlot, first: int, width: int) -> str:
        """Append a load of numbers, and return the LLVM name of the value.

        With lanes, this is the number of ball ``first`` in all lanes; else a vector with the
        numbers of ``width`` balls from ``first`` on.
        """
        lanes = self.shape.lanes
        if lanes > 1:
            pointer = self._pointer(place, first)
            if place.pointer in self.uniform:
                return self.widened(self.put(f"load double, ptr {pointer}, align 8"), lanes)
            return self.put(f"load {kind(lanes)}, ptr {pointer}, align 8")
        if place.stride == 1 or width == 1:
            return self.put(f"load {kind(width)}, ptr {self._pointer(place, first)}, align 8")
        vector = "poison"
        for k in range(width):
            one = self.put(f"load double, ptr {self._pointer(place, first + k)}, align 8")
            vector = self.put(f"insertelement {kind(width)} {vector}, double {one}, i32 {k}")
        return vector

    def store(self, value: str, place: MemorySlot, first: int, width: int) -> None:
        """Append a store of a value in the layout that ``load`` reads."""
        if self.shape.lanes > 1 and place.pointer in self.uniform:
            value, width = self.put(f"extractelement {kind(width)} {value}, i32 0"), 1
        if self.shape.lanes > 1 or place.stride == 1 or width == 1:
            pointer = self._pointer(place, first)
            self.lines.append(f"store {kind(width)} {value}, ptr {pointer}, align 8")
            return
        for k in range(width):
            one = self.put(f"extractelement {kind(width)} {value}, i32 {k}")
            pointer = self._pointer(place, first + k)
            self.lines.append(f"store double {one}, ptr {pointer}, align 8")

    def _pointer(self, place: MemorySlot, ball: int) -> str:
        """Append the computation of the address of a ball's number; return the pointer's name."""
        size = 1 if place.pointer in self.uniform else self.shape.lanes
        at = (place.at + ball * place.stride) * size
        return self.put(f"getelementptr double, ptr %{place.pointer}, i64 {at}")

    def call(self, name: str, width: int, *values: str) -> str:
        """Append a call of LLVM's intrinsic function ``name``, and return the result's name."""
        suffix = f"v{width}f64" if width > 1 else "f64"
        whole, of = f"@llvm.{name}.{suffix}", kind(width)
        self.declared.add(f"declare {of} {whole}({', '.join([of] * len(values))})")
        return self.put(f"call {of} {whole}({', '.join(f'{of} {value}' for value in values)})")

    def widened(self, value: str, width: int, element: str = "double") -> str:
        """Return the name of a vector with one value in every element."""
        if (value, width) not in self._wide:
            of = kind(width, element)
            one = self.put(f"insertelement {of} poison, {element} {value}, i32 0")
            self._wide[value, width] = self.put(
                f"shufflevector {of} {one}, {of} poison, <{width} x i32> zeroinitializer"
            )
        return self._wide[value, width]

    def shuffled(self, value: str, width: int, which: Sequence[int], other: str = "poison") -> str:
        """Append a selection of elements from two vectors, and return the new vector's name.

        ``which`` has indices of elements; those of ``other`` follow those of ``value``.
        """
        of, order = kind(width), ", ".join(f"i32 {k}" for k in which)
        return self.put(f"shufflevector {of} {value}, {of} {other}, <{len(which)} x i32> <{order}>")

    def text(self) -> str:
        """Return the function's definition."""
        arguments = [f"ptr noalias %{name}" for name in self.pointers]
        arguments += [f"double %{name}" for name in self.numbers]
        body = "\n".join(f"  {line}" for line in [*self.lines, "ret void"])
        return f"define void @{self.name}({', '.join(arguments)}) {_ATTRIBUTES} {{\n{body}\n}}\n"


class Body:
    """Emitter of expressions into a function.

    Parameters
    ----------
    into
        Function to which lines are appended.
    places
        Positions of inputs in memory, by name.
    known_slots
        Positions of nodes that are already in memory, by the nodes' numbers.
    bound
        Names of values of inputs that are already loaded, by input, one per vector.
    """

    def __init__(
        self,
        into: Function,
        places: dict[str, MemorySlot],
        known_slots: Mapping[int, MemorySlot] | None = None,
        bound: Mapping[str, list[str]] | None = None,
    ) -> None:
        self._into, self._known = into, known_slots or {}
        self.places = places
        """Positions of inputs in memory, by name."""
        self._bound = bound or {}
        self._values: dict[int, list[str]] = {}

    def values(self, x: Expression) -> list[str]:
        """Return the LLVM names of a node's values, one per vector or number in which it is kept.

        Nodes are emitted depth first, each right after its last missing argument. A value is then
        used soon after it is computed, which keeps the number of live registers small. An explicit
        stack replaces recursion, as expressions may be deeper than Python's recursion limit.
        """
        ahead = [x]
        while ahead:
            node = ahead[-1]
            if node.number in self._values or node.op == "const":
                ahead.pop()
                continue
            args = () if node.number in self._known else node.args
            missing = [a for a in args if a.number not in self._values and a.op != "const"]
            if missing:
                ahead += missing[::-1]
                continue
            ahead.pop()
            self._values[node.number] = self._emitted(node)
        return [self._operand(x, k, width) for k, width in enumerate(self._widths(x))]

    def store(self, x: Expression, place: MemorySlot, per_ball: bool = False) -> None:
        """Append stores of a node; with ``per_ball``, one value per ball even if it is shared."""
        shape, first = self._into.shape, 0
        self.values(x)
        for k, width in enumerate(shape.widths(x.each or per_ball)):
            self._into.store(self._operand(x, k, width), place, first, width)
            first += 1 if shape.lanes > 1 else width

    def store_all(self, stores: Sequence[StoredRoot]) -> None:
        """Append stores whose values are computed in an order in which few operations wait.

        A value is stored as soon as it is computed, so no destination may be read later.
        """
        waiting: dict[int, list[StoredRoot]] = {}
        for store in stores:
            waiting.setdefault(store.root.number, []).append(store)
        balls = len(self._into.shape.widths(True))
        for x in scheduled([store.root for store in stores], balls, self._known):
            self.values(x)
            for store in waiting.pop(x.number, ()):
                self.store(*store)
        for rest in waiting.values():
            for store in rest:
                self.store(*store)

    def each(self, x: Expression) -> list[str]:
        """Return the LLVM names of a node's values for all balls; balls may share one value."""
        self.values(x)
        widths = self._into.shape.widths(True)
        return [self._operand(x, k, width) for k, width in enumerate(widths)]

    def _widths(self, x: Expression) -> list[int]:
        """Return the widths of the vectors that hold a node."""
        return self._into.shape.widths(x.each)

    def _operand(self, x: Expression, k: int, width: int) -> str:
        """Return part ``k`` of a node in the given width."""
        if x.op == "const":
            return literal(x.payload, width)
        values = self._values[x.number]
        if len(values) > 1 or x.each:
            return values[k]
        is_bool = x.op in ("lt", "le")
        if self._into.shape.lanes == width:
            return values[0]
        return self._into.widened(values[0], width, "i1" if is_bool else "double")

    def _emitted(self, x: Expression) -> list[str]:
        """Append the load or the operation of a node, whose arguments have been emitted."""
        into = self._into
        place = self._known.get(x.number)
        if place is None and x.op == "input":
            if x.payload in self._bound:
                return self._bound[x.payload]
            place = self.places[x.payload]
        if place is not None:
            values, first = [], 0
            for width in self._widths(x):
                values.append(into.load(place, first, width))
                first += 1 if into.shape.lanes > 1 else width
            return values
        if x.op == "total":
            return [self._total(x.args[0])]
        if x.op == "rows":
            return self._rows(x.args[0])
        if x.op == "across":
            parts = enumerate(self._widths(x))
            return [self._across(self._operand(x.args[0], k, width)) for k, width in parts]
        return [
            self._operation(x.op, width, [self._operand(arg, k, width) for arg in x.args])
            for k, width in enumerate(self._widths(x))
        ]

    def _operation(self, op: str, width: int, args: Sequence[str]) -> str:
        """Append an operation on vectors of ``width`` elements, and return the result's name."""
        of = kind(width)
        if op in _TWO:
            return self._into.put(f"{_TWO[op]} {of} {args[0]}, {args[1]}")
        if op == "neg":
            return self._into.put(f"fneg {of} {args[0]}")
        if op == "where":
            which = kind(width, "i1")
            return self._into.put(f"select {which} {args[0]}, {of} {args[1]}, {of} {args[2]}")
        return self._into.call("fabs" if op == "abs" else op, width, *args)

    def _across(self, value: str) -> str:
        """Return the sum of all lanes in every lane."""
        lanes = self._into.shape.lanes
        # Butterfly: each lane adds its partner at half the distance, so after log2(lanes) rounds
        # every lane has the sum.
        half = lanes // 2
        while half:
            other = self._into.shuffled(value, lanes, [k ^ half for k in range(lanes)])
            value, half = self._operation("add", lanes, (value, other)), half // 2
        return value

    def _total(self, x: Expression) -> str:
        """Return the sum over the balls, in the order of ``added_up``."""
        shape = self._into.shape
        widths = shape.widths(True)
        parts = [self._operand(x, k, width) for k, width in enumerate(widths)]
        if shape.lanes > 1:
            return str(added_up(parts, lambda a, b: self._operation("add", shape.lanes, (a, b))))
        groups = [part for part, width in zip(parts, widths, strict=True) if width == GROUP]
        sums = []
        if groups:
            whole = groups[0]
            for group in groups[1:]:
                whole = self._operation("add", GROUP, (whole, group))
            sums.append(self._halved(whole, GROUP))
        if widths[-1] != GROUP:
            sums.append(self._halved(parts[-1], widths[-1]))
        return sums[0] if len(sums) == 1 else self._operation("add", 1, sums)

    def _rows(self, x: Expression) -> list[str]:
        """Return the matrix times a quantity per ball, accumulated column by column."""
        into, shape, matrix = self._into, self._into.shape, self.places[ROWS]
        widths, n = shape.widths(True), shape.balls
        parts = [self._operand(x, k, width) for k, width in enumerate(widths)]
        texts: list[str] = []
        for j in range(n):
            if shape.lanes > 1:
                factors = [parts[j]] * n
            else:
                group, at = divmod(j, GROUP)
                one = parts[group]
                if widths[group] > 1:
                    one = into.put(f"extractelement {kind(widths[group])} {one}, i32 {at}")
                factors = [one if w == 1 else into.widened(one, w) for w in widths]
            first, rows = 0, []
            for k, width in enumerate(widths):
                column = into.load(matrix, j * n + first, width)
                if j == 0:
                    rows.append(self._operation("mul", width, (column, factors[k])))
                else:
                    rows.append(self._operation("fma", width, (column, factors[k], texts[k])))
                first += 1 if shape.lanes > 1 else width
            texts = rows
        return texts

    def _halved(self, value: str, width: int) -> str:
        """Return the sum of a vector's elements, in the order of ``functions.halved``."""
        while width > 1:
            half = 1 << (width - 1).bit_length() - 1
            low, high = (self._part(value, width, first, half) for first in (0, half))
            value, width = self._operation("add", half, (low, high)), half
        return value

    def _part(self, value: str, width: int, first: int, count: int) -> str:
        """Return ``count`` elements of a vector; beyond its end they are -0.0, neutral in sums."""
        if count == 1:
            return self._into.put(f"extractelement {kind(width)} {value}, i32 {first}")
        which = [min(first + k, width) for k in range(count)]
        return self._into.shuffled(value, width, which, literal(-0.0, width))


_TWO = {
    "add": "fadd",
    "sub": "fsub",
    "mul": "fmul",
    "div": "fdiv",
    "lt": "fcmp olt",
    "le": "fcmp ole",
}


def kind(width: int, element: str = "double") -> str:
    """Return LLVM's type of a number or vector."""
    return f"<{width} x {element}>" if width > 1 else element


def literal(value: float, width: int) -> str:
    """Return a constant in LLVM IR, bit by bit."""
    one = "0x" + struct.pack(">d", value).hex().upper()
    return one if width == 1 else f"splat (double {one})"


def module_text(functions: Sequence[Function]) -> str:
    """Return the text of a module with several functions."""
    declared = sorted(set().union(*(function.declared for function in functions)))
    return "\n".join([*declared, *(function.text() for function in functions)]) + "\n"


def border(roots: Sequence[Expression], level: int) -> list[Expression]:
    """Return nodes known at a level that later levels use: values to compute once and store.

    Constants and inputs are left out, as they are available anyway. The result of a comparison
    cannot be stored as a number; the nodes that it compares are returned instead.

    Parameters
    ----------
    roots
        Expressions of one graph.
    level
        Last ``Level`` at which the returned nodes are known.
    """
    by_number: dict[int, Expression] = {}
    ahead = [root for root in roots if root.level <= level]
    ahead += [arg for x in reachable_nodes(roots) if x.level > level for arg in x.args]
    while ahead:
        x = ahead.pop()
        if x.level > level or x.op in ("const", "input") or x.number in by_number:
            continue
        if x.op in ("lt", "le"):
            ahead += x.args
        else:
            by_number[x.number] = x
    return [by_number[number] for number in sorted(by_number)]


WIDTH = 8
"""Largest number of lanes that are transposed together."""


def store_lines(into: Function, columns: Sequence[str], pointers: Sequence[str]) -> None:
    """Append stores of vectors with a number per lane; each lane's numbers are adjacent in memory.

    Groups of columns are transposed and stored in turn, as all of them together would not fit into
    registers. Lanes are stored from the last to the first, so that of several lanes with one
    pointer the first one's numbers remain.

    Parameters
    ----------
    into
        Function to which lines are appended.
    columns
        Names of values in lanes.
    pointers
        LLVM's names of the pointers to the rows, one for each lane.
    """
    lanes = len(pointers)
    width = min(WIDTH, lanes)
    for first in range(0, len(columns), width):
        group = list(columns[first : first + width])
        for lane in reversed(range(0, lanes, width)):
            part = range(lane, lane + width)
            square = [x if lanes == width else into.shuffled(x, lanes, part) for x in group]
            square += ["poison"] * (width - len(group))
            turned = zip(part, _transposed(into, square), strict=True)
            for k, line in reversed([*turned]):
                at = first
                for count, value in _cut(into, line, width, len(group)):
                    place = into.put(f"getelementptr double, ptr {pointers[k]}, i64 {at}")
                    into.lines.append(f"store {kind(count)} {value}, ptr {place}, align 8")
                    at += count


def _transposed(into: Function, square: Sequence[str]) -> list[str]:
    """Return the transpose of a square matrix of vectors.

    Blocks next to the diagonal are exchanged, at half the size in each round, so that n vectors
    need n log2(n) shuffles (Eklundh 1972, IEEE Trans. Comput. C-21, 801-803).
    """
    lines, width = list(square), len(square)
    d = width // 2
    while d:
        for i in range(width):
            if not i & d:
                a, b = lines[i], lines[i + d]
                high = [p if not p & d else width + p - d for p in range(width)]
                low = [p + d if not p & d else width + p for p in range(width)]
                lines[i], lines[i + d] = (into.shuffled(a, width, w, b) for w in (high, low))
        d //= 2
    return lines


def _cut(into: Function, value: str, width: int, count: int) -> list[tuple[int, str]]:
    """Return the first ``count`` numbers of a vector, in pieces whose sizes are powers of two.

    Each piece can be stored by one instruction.
    """
    if count == width:
        return [(width, value)]
    pieces, first, size = [], 0, width // 2
    while size:
        if count & size:
            which = range(first, first + size)
            piece = (
                into.put(f"extractelement {kind(width)} {value}, i32 {first}")
                if size == 1
                else into.shuffled(value, width, which)
            )
            pieces.append((size, piece))
            first += size
        size //= 2
    return pieces
