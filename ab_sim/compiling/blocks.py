"""Lines of a function in LLVM's language, and values in it."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from ab_sim.compiling.kinds import Array
from ab_sim.compiling.source import BOOL, FLOAT, INT, Kind, Record, Scalar, element_of, leaves
from ab_sim.tracing.llvm_text import literal

FIELD, ELEMENT = ", !tbaa !3", ", !tbaa !4"
"""What memory is: part of a record, or a number of an array. Neither is ever written as the other,
so writing to an array does not make LLVM read a record anew."""
METADATA = """
!0 = !{!"ab_sim"}
!1 = !{!"field", !0, i64 0}
!2 = !{!"element", !0, i64 0}
!3 = !{!1, !1, i64 0}
!4 = !{!2, !2, i64 0}
"""


class Number(NamedTuple):
    """A float, int or bool."""

    kind: Scalar
    code: str
    """LLVM's name of it."""
    constant: float | int | bool | None = None
    """What it is, if that is known now."""


class ArrayView(NamedTuple):
    """An array: a pointer and lengths, LLVM's names of them."""

    kind: Array
    pointer: str
    shape: tuple[str, ...]


class Fields(NamedTuple):
    """A record or tuple, field by field."""

    kind: Record
    values: tuple["Value", ...]


class StoredRecord(NamedTuple):
    """A record in memory, eight bytes for each leaf."""

    kind: Record
    pointer: str
    at: int
    """The first leaf's number behind the pointer."""
    fixed: bool
    """Whether it stays the same for as long as the function runs."""


Value = Number | ArrayView | Fields | StoredRecord


def constant(x: float | int | bool) -> Number:
    """A number that is known now."""
    if isinstance(x, bool):
        return Number(BOOL, "true" if x else "false", x)
    if isinstance(x, int):
        return Number(INT, str(int(x)), int(x))
    return Number(FLOAT, literal(float(x), 1), float(x))


def is_known(value: Value) -> bool:
    """Whether this is a number that is known now."""
    return isinstance(value, Number) and value.constant is not None


class BlockWriter:
    """Lines of a function, block by block."""

    def __init__(self) -> None:
        self.entry: list[str] = []
        """Room on the stack, which has to come first."""
        self.lines: list[str] = []
        self.block = "begin"
        """The label of the block that lines go into."""
        self.open = True
        """Whether the block can be reached and has no end yet."""
        self.declared: set[str] = set()
        self._count = 0

    def new(self, of: str = "") -> str:
        """A name, without LLVM's %; of a value it is a number, as LLVM keeps no such names."""
        self._count += 1
        return f"{of}{self._count}"

    def put(self, text: str) -> str:
        """A line that makes a value; its name."""
        made = "%" + self.new()
        self.lines.append(f"{made} = {text}")
        return made

    def end(self, text: str) -> None:
        """The last line of a block."""
        if self.open:
            self.lines.append(text)
        self.open = False

    def go(self, label: str) -> None:
        """End the block: on to another."""
        self.end(f"br label %{label}")

    def fork(self, condition: str, yes: str, no: str) -> None:
        """End the block: on to one of two others."""
        self.end(f"br i1 {condition}, label %{yes}, label %{no}")

    def start(self, label: str) -> None:
        """Begin a block."""
        self.lines.append(f"{label}:")
        self.block, self.open = label, True

    def llvm(self, name: str, kind: str, *values: str, of: str | None = None) -> str:
        """Call one of LLVM's own functions on numbers of a kind."""
        arguments = ", ".join(f"{of or kind} {value}" for value in values)
        kinds = ", ".join([of or kind] * len(values))
        self.declared.add(f"declare {kind} @llvm.{name}({kinds})")
        return self.put(f"call {kind} @llvm.{name}({arguments})")

    def room(self, size: int) -> str:
        """So many leaves on the stack."""
        made = "%" + self.new("room")
        self.entry.append(f"{made} = alloca [{size} x i64], align 8")
        return made

    def step(self, pointer: str, leaves: int) -> str:
        """A pointer so many leaves behind another."""
        if leaves == 0:
            return pointer
        return self.put(f"getelementptr inbounds i64, ptr {pointer}, i64 {leaves}")

    def flat(self, value: Value) -> list[str]:
        """The leaves of a value, LLVM's names of them."""
        if isinstance(value, Number):
            return [value.code]
        if isinstance(value, ArrayView):
            return [value.pointer, *value.shape]
        if isinstance(value, Fields):
            return [leaf for field in value.values for leaf in self.flat(field)]
        found = []
        for k, leaf in enumerate(leaves(value.kind)):
            pointer, of = self.step(value.pointer, value.at + k), "i64" if leaf == "i1" else leaf
            one = self.put(f"load {of}, ptr {pointer}, align 8{FIELD}")
            found.append(self.put(f"trunc i64 {one} to i1") if leaf == "i1" else one)
        return found

    def loaded(self, value: Value) -> Value:
        """A value that does not change when memory on the stack is written."""
        if isinstance(value, Fields):
            return Fields(value.kind, tuple(self.loaded(field) for field in value.values))
        if isinstance(value, StoredRecord) and not value.fixed:
            return self.made(value.kind, iter(self.flat(value)))
        return value

    def made(self, kind: Kind, flat: Iterator[str]) -> Value:
        """A value of its leaves."""
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
            self.lines.append(f"store {leaf} {one}, ptr {to}, align 8{FIELD}")

    def load(self, kind: Kind, pointer: str, at: int = 0, fixed: bool = True) -> Value:
        """A value in memory; a record is read when its fields are."""
        if isinstance(kind, Record):
            return StoredRecord(kind, pointer, at, fixed)
        one = StoredRecord(Record(None, ("0",), (kind,)), pointer, at, fixed)
        return self.made(kind, iter(self.flat(one)))

    def field(self, value: Fields | StoredRecord, k: int) -> Value:
        """Of a record."""
        if isinstance(value, Fields):
            return value.values[k]
        at = value.at + sum(len(leaves(kind)) for kind in value.kind.kinds[:k])
        return self.load(value.kind.kinds[k], value.pointer, at, value.fixed)

    def pointer_to(self, value: Value) -> str:
        """Where a record is in memory; it is put there if need be."""
        if isinstance(value, StoredRecord):
            return self.step(value.pointer, value.at)
        room = self.room(len(leaves(value.kind)))
        self.store(value, room)
        return room

    def passed(self, value: Value) -> list[tuple[str, str]]:
        """A value as arguments: records by their place in memory, arrays leaf by leaf."""
        if isinstance(value, Fields | StoredRecord):
            return [("ptr", self.pointer_to(value))]
        return list(zip(leaves(value.kind), self.flat(value), strict=True))

    def element(self, view: ArrayView, index: Sequence[str]) -> str:
        """Pointer to a number of an array; with fewer indices than axes, to several."""
        at, element = index[0], element_of(view.kind).llvm
        for one, length in zip(index[1:], view.shape[1:], strict=False):
            at = self.put(f"mul i64 {at}, {length}")
            at = self.put(f"add i64 {at}, {one}")
        for length in view.shape[len(index) :]:
            at = self.put(f"mul i64 {at}, {length}")
        return self.put(f"getelementptr inbounds {element}, ptr {view.pointer}, i64 {at}")
