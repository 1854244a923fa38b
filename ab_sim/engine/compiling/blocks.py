"""Lines of a function in LLVM IR, the values that they compute, and operations on numbers.

Results are those of Python, except that a division by zero follows IEEE 754, and that ints have 64
bits and wrap.
"""

import ast
import operator
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple, NoReturn

from ab_sim.engine.compiling.kinds import Array
from ab_sim.engine.compiling.source import (
    BOOL,
    FLOAT,
    INT,
    FunctionSource,
    Kind,
    RecordKind,
    Scalar,
    element_of,
    leaves,
)
from ab_sim.tracing.llvm_text import literal

_FIELD, ELEMENT = ", !tbaa !3", ", !tbaa !4"
"""Type-based alias classes of memory: part of a record, or number of an array. No memory belongs to
both, so LLVM does not load a record again after a write to an array."""
METADATA = """
!0 = !{!"ab_sim"}
!1 = !{!"field", !0, i64 0}
!2 = !{!"element", !0, i64 0}
!3 = !{!1, !1, i64 0}
!4 = !{!2, !2, i64 0}
"""


class Number(NamedTuple):
    """Float, int or bool."""

    kind: Scalar
    code: str
    """Operand in LLVM IR: a name or a literal."""
    constant: float | int | bool | None = None
    """Value, if known at compile time."""


class ArrayView(NamedTuple):
    """Array: LLVM's names of its pointer and of its lengths."""

    kind: Array
    pointer: str
    shape: tuple[str, ...]


class Fields(NamedTuple):
    """Record or tuple, field by field."""

    kind: RecordKind
    values: tuple["Value", ...]


class StoredRecord(NamedTuple):
    """Record in memory, eight bytes for each leaf."""

    kind: RecordKind
    pointer: str
    at: int
    """Offset of the first leaf from the pointer, in leaves."""
    immutable: bool
    """True if the record does not change while the function runs."""


Value = Number | ArrayView | Fields | StoredRecord


def constant(x: float | int | bool) -> Number:
    """Return a number that is known at compile time."""
    if isinstance(x, bool):
        return Number(BOOL, "true" if x else "false", x)
    if isinstance(x, int):
        return Number(INT, str(int(x)), int(x))
    return Number(FLOAT, literal(float(x), 1), float(x))


def is_known(value: Value) -> bool:
    """Return whether a value is a number that is known at compile time."""
    return isinstance(value, Number) and value.constant is not None


class BlockWriter:
    """Writer of a function's lines, basic block by basic block."""

    def __init__(self) -> None:
        self.entry: list[str] = []
        """Allocations on the stack, which come first in the function."""
        self.lines: list[str] = []
        self.block = "begin"
        """Label of the current block."""
        self.open = True
        """True if the current block is reachable and has no terminator yet."""
        self.declared: set[str] = set()
        self._count = 0

    def new(self, of: str = "") -> str:
        """Return a new name, without LLVM's %; without ``of`` it is a number, which is faster."""
        self._count += 1
        return f"{of}{self._count}"

    def put(self, text: str) -> str:
        """Append a line that computes a value, and return the value's name."""
        name = "%" + self.new()
        self.lines.append(f"{name} = {text}")
        return name

    def end(self, text: str) -> None:
        """Append a terminator to the current block, unless the block is already ended."""
        if self.open:
            self.lines.append(text)
        self.open = False

    def go(self, label: str) -> None:
        """End the block with a jump to another one."""
        self.end(f"br label %{label}")

    def fork(self, condition: str, yes: str, no: str) -> None:
        """End the block with a jump to ``yes`` if a condition holds, else to ``no``."""
        self.end(f"br i1 {condition}, label %{yes}, label %{no}")

    def start(self, label: str) -> None:
        """Begin the block with this label; further lines belong to it."""
        self.lines.append(f"{label}:")
        self.block, self.open = label, True

    def llvm(self, name: str, kind: str, *values: str, of: str | None = None) -> str:
        """Append a call of an LLVM intrinsic on numbers of a kind, and return its result's name."""
        arguments = ", ".join(f"{of or kind} {value}" for value in values)
        kinds = ", ".join([of or kind] * len(values))
        self.declared.add(f"declare {kind} @llvm.{name}({kinds})")
        return self.put(f"call {kind} @llvm.{name}({arguments})")

    def room(self, size: int) -> str:
        """Allocate ``size`` leaves on the stack, and return the pointer's name."""
        name = "%" + self.new("room")
        self.entry.append(f"{name} = alloca [{size} x i64], align 8")
        return name

    def step(self, pointer: str, leaves: int) -> str:
        """Return a pointer that is ``leaves`` leaves after another."""
        if leaves == 0:
            return pointer
        return self.put(f"getelementptr inbounds i64, ptr {pointer}, i64 {leaves}")

    def flat(self, value: Value) -> list[str]:
        """Return LLVM's names of a value's leaves."""
        if isinstance(value, Number):
            return [value.code]
        if isinstance(value, ArrayView):
            return [value.pointer, *value.shape]
        if isinstance(value, Fields):
            return [leaf for field in value.values for leaf in self.flat(field)]
        leaves_ = []
        for k, leaf in enumerate(leaves(value.kind)):
            pointer, of = self.step(value.pointer, value.at + k), "i64" if leaf == "i1" else leaf
            one = self.put(f"load {of}, ptr {pointer}, align 8{_FIELD}")
            leaves_.append(self.put(f"trunc i64 {one} to i1") if leaf == "i1" else one)
        return leaves_

    def loaded(self, value: Value) -> Value:
        """Return a copy of a value that later writes to the stack do not change."""
        if isinstance(value, Fields):
            return Fields(value.kind, tuple(self.loaded(field) for field in value.values))
        if isinstance(value, StoredRecord) and not value.immutable:
            return self.made(value.kind, iter(self.flat(value)))
        return value

    def made(self, kind: Kind, flat: Iterator[str]) -> Value:
        """Return a value of a kind, assembled from the LLVM names of the value's leaves."""
        if isinstance(kind, Scalar):
            return Number(kind, next(flat))
        if isinstance(kind, Array):
            return ArrayView(kind, next(flat), tuple(next(flat) for _ in range(kind.rank)))
        return Fields(kind, tuple(self.made(field, flat) for field in kind.kinds))

    def store(self, value: Value, pointer: str) -> None:
        """Write the leaves of a value to memory, eight bytes for each."""
        for k, (leaf, one) in enumerate(zip(leaves(value.kind), self.flat(value), strict=True)):
            if leaf == "i1":
                leaf, one = "i64", self.put(f"zext i1 {one} to i64")
            to = self.step(pointer, k)
            self.lines.append(f"store {leaf} {one}, ptr {to}, align 8{_FIELD}")

    def load(self, kind: Kind, pointer: str, at: int = 0, immutable: bool = True) -> Value:
        """Return a value in memory; a record's fields are loaded when they are used.

        Parameters
        ----------
        kind
            Kind of the value.
        pointer
            LLVM's name of a pointer.
        at
            Offset of the value from the pointer, in leaves.
        immutable
            True if the memory does not change while the function runs.
        """
        if isinstance(kind, RecordKind):
            return StoredRecord(kind, pointer, at, immutable)
        one = StoredRecord(RecordKind(None, ("0",), (kind,)), pointer, at, immutable)
        return self.made(kind, iter(self.flat(one)))

    def field(self, value: Fields | StoredRecord, k: int) -> Value:
        """Return field ``k`` of a record."""
        if isinstance(value, Fields):
            return value.values[k]
        at = value.at + sum(len(leaves(kind)) for kind in value.kind.kinds[:k])
        return self.load(value.kind.kinds[k], value.pointer, at, value.immutable)

    def pointer_to(self, value: Value) -> str:
        """Return a pointer to a record, which is stored on the stack first if necessary."""
        if isinstance(value, StoredRecord):
            return self.step(value.pointer, value.at)
        room = self.room(len(leaves(value.kind)))
        self.store(value, room)
        return room

    def passed(self, value: Value) -> list[tuple[str, str]]:
        """Return a value as arguments (type, name): records by pointer, arrays leaf by leaf."""
        if isinstance(value, Fields | StoredRecord):
            return [("ptr", self.pointer_to(value))]
        return list(zip(leaves(value.kind), self.flat(value), strict=True))

    def element(self, view: ArrayView, index: Sequence[str]) -> str:
        """Return a pointer to a number of an array; with fewer indices than axes, to a subarray."""
        at, element = index[0], element_of(view.kind).llvm
        for one, length in zip(index[1:], view.shape[1:], strict=False):
            at = self.put(f"mul i64 {at}, {length}")
            at = self.put(f"add i64 {at}, {one}")
        for length in view.shape[len(index) :]:
            at = self.put(f"mul i64 {at}, {length}")
        return self.put(f"getelementptr inbounds {element}, ptr {view.pointer}, i64 {at}")


RANK = {BOOL: 0, INT: 1, FLOAT: 2}
"""Rank of each kind of number, from the narrowest to the widest."""

_FLOATS = {ast.Add: "fadd", ast.Sub: "fsub", ast.Mult: "fmul", ast.Div: "fdiv"}
_INTS = {ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul"}
_FOLDED: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
}
COMPARED = {
    ast.Lt: ("olt", "slt"),
    ast.LtE: ("ole", "sle"),
    ast.Gt: ("ogt", "sgt"),
    ast.GtE: ("oge", "sge"),
    ast.Eq: ("oeq", "eq"),
    ast.NotEq: ("une", "ne"),
}


class Operations(BlockWriter):
    """Writer of a function's lines with operations on numbers.

    Parameters
    ----------
    source
        Source of the function.
    """

    def __init__(self, source: FunctionSource) -> None:
        super().__init__()
        self.source = source

    def fail(self, node: ast.AST, what: str, instead: str) -> NoReturn:
        """Raise an error with a node's line, what is wrong there, and what to write instead."""
        raise self.source.error(node, what, instead)

    def truth(self, x: Number) -> Number:
        """Return whether a number is not zero."""
        if x.constant is not None:
            return constant(bool(x.constant))
        if x.kind == FLOAT:
            return Number(BOOL, self.put(f"fcmp une double {x.code}, 0.0"))
        return x if x.kind == BOOL else Number(BOOL, self.put(f"icmp ne i64 {x.code}, 0"))

    def converted(self, x: Number, kind: Scalar) -> Number:
        """Return a number converted to the same or a wider kind: bool, int, float."""
        if x.kind == kind:
            return x
        if x.constant is not None:
            return constant(float(x.constant) if kind == FLOAT else int(x.constant))
        if x.kind == BOOL:
            x = Number(INT, self.put(f"zext i1 {x.code} to i64"))
        return Number(FLOAT, self.put(f"sitofp i64 {x.code} to double")) if kind == FLOAT else x

    def wider(self, *numbers: Number) -> Scalar:
        """Return float if any of the numbers is a float, else int (also for bools)."""
        return FLOAT if any(x.kind == FLOAT for x in numbers) else INT

    def alike(self, *numbers: Number) -> list[Number]:
        """Return numbers converted to their common kind."""
        kind = self.wider(*numbers)
        return [self.converted(x, kind) for x in numbers]

    def operation(self, node: ast.AST, op: ast.operator, a: Number, b: Number) -> Number:
        """Return the result of an operation on two numbers, folded if both are constant."""
        operator_ = type(op)
        if operator_ is ast.Div:
            a, b = self.converted(a, FLOAT), self.converted(b, FLOAT)
        a, b = self.alike(a, b)
        both = a.constant is not None and b.constant is not None
        if both and operator_ in _FOLDED and (a.kind == INT or operator_ in _FLOATS):
            result = _FOLDED[operator_](a.constant, b.constant)
            if a.kind == FLOAT or -(2**63) <= result < 2**63:
                return constant(result)
        if operator_ in (ast.FloorDiv, ast.Mod) and a.kind == INT:
            return self._floor_division(operator_ is ast.Mod, a, b)
        name = (_FLOATS if a.kind == FLOAT else _INTS).get(operator_)
        if name is None:
            self.fail(
                node,
                f"{operator_.__name__} of {a.kind}s",
                "see ab_sim.engine.compiling for the subset",
            )
        return Number(a.kind, self.put(f"{name} {a.kind.llvm} {a.code}, {b.code}"))

    def _floor_division(self, rest: bool, a: Number, b: Number) -> Number:
        """Return a // b of ints, or with ``rest`` a % b, rounded as in Python."""
        # LLVM rounds quotients towards zero, Python towards minus infinity. They differ if the
        # remainder is not zero and its sign is not the divisor's.
        remainder = self.put(f"srem i64 {a.code}, {b.code}")
        signs = self.put(f"xor i64 {remainder}, {b.code}")
        differ, some = self.put(f"icmp slt i64 {signs}, 0"), self.put(f"icmp ne i64 {remainder}, 0")
        off = self.put(f"and i1 {differ}, {some}")
        if rest:
            more = self.put(f"select i1 {off}, i64 {b.code}, i64 0")
            return Number(INT, self.put(f"add i64 {remainder}, {more}"))
        quotient = self.put(f"sdiv i64 {a.code}, {b.code}")
        less = self.put(f"sext i1 {off} to i64")
        return Number(INT, self.put(f"add i64 {quotient}, {less}"))

    def compared(self, op: ast.cmpop, a: Number, b: Number) -> Number:
        """Return a comparison of two numbers; with a NaN only != is true, as in Python."""
        a, b = self.alike(a, b)
        of_floats, of_ints = COMPARED[type(op)]
        how = f"fcmp {of_floats}" if a.kind == FLOAT else f"icmp {of_ints}"
        return Number(BOOL, self.put(f"{how} {a.kind.llvm} {a.code}, {b.code}"))
