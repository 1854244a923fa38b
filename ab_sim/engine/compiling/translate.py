"""Translate functions of the subset to LLVM IR.

    source        source and annotations of a function
    blocks        lines of LLVM IR, the values that they compute, and operations on numbers
    expressions   expressions
    intrinsics    functions that are expanded in place instead of called
    translate     statements, and whole functions
    library       modules of a function and its callees; the entry from outside

A local variable is memory on the stack, which LLVM turns into registers (pass ``sroa``), so no phi
nodes are written for variables. Records (NamedTuples) are passed as pointers to their fields, eight
bytes for each number, pointer or length. They never change, so calls copy nothing.
"""

import ast
from collections import Counter
from collections.abc import Iterator, Sequence
from types import FunctionType
from typing import NamedTuple

from ab_sim.engine.compiling.blocks import (
    ELEMENT,
    ArrayView,
    Number,
    StoredRecord,
    Value,
    is_known,
)
from ab_sim.engine.compiling.expressions import Callees, Conditions, result_type
from ab_sim.engine.compiling.intrinsics import INTRINSICS
from ab_sim.engine.compiling.source import (
    INT,
    FunctionSource,
    Kind,
    RecordKind,
    Scalar,
    Signature,
    element_of,
    leaves,
    text_of,
)

SHORT = 60
"""Number of lines below which a function is inlined at each call. With 30, runs with contact take
15 % longer; with 200, compiling takes twice as long."""


class Translated(NamedTuple):
    """Function in LLVM IR, with the names on which it depends."""

    signature: Signature
    head: str
    """First line of the definition, without the keyword ``define`` or ``declare``."""
    body: str
    is_short: bool
    """True if the function is inlined at each call."""
    declared: set[str]
    """Declarations of the LLVM intrinsics that are called."""
    calls: set[FunctionType]
    reads: set[str]
    """Names of the records' fields that are read."""

    def definition(self) -> str:
        """Return the function's definition."""
        of_module, inlined = ("internal ", " alwaysinline") if self.is_short else ("", "")
        return f"define {of_module}{self.head}{inlined} {{\n{self.body}\n}}\n"


class FunctionTranslator(Conditions):
    """Translator of one function.

    Parameters
    ----------
    source
        Source of the function.
    callees
        Provider of other functions.
    """

    def __init__(self, source: FunctionSource, callees: Callees) -> None:
        self._stored = Counter(stored(source.tree.body))
        super().__init__(source, callees, {*source.arguments, *self._stored}, INTRINSICS)
        self._ways: list[tuple[str, str]] = []
        """Labels for continue and break of the enclosing loops, from the outermost on."""
        self._left: set[str] = set()
        """Labels of the ends of loops that a break reaches."""
        self._unrolling = 0

    def translated(self, signature: Signature) -> Translated:
        """Return the translated function, under the symbol of its signature."""
        declared: list[str] = []
        for name, kind in zip(self.source.arguments, self.source.kinds, strict=True):
            if isinstance(kind, RecordKind):
                value: Value = StoredRecord(kind, f'%"{name}.at"', 0, True)
                declared.append(f'ptr noalias readonly %"{name}.at"')
            else:
                leaf_types = leaves(kind)
                parts = [f'%"{name}.{k}"' for k in range(len(leaf_types))]
                declared += [f"{leaf} {part}" for leaf, part in zip(leaf_types, parts, strict=True)]
                value = self.made(kind, iter(parts))
            if name in self._stored:
                self._assign_name(self.source.tree, name, value)
            else:
                self.bound[name] = value
        self._run(self.source.tree.body)
        if self.open:
            if self.source.result is not None:
                self.fail(self.source.tree, "the end is reached without a result", "return one")
            self.end("ret void")
        lines = [*self.entry, "br label %begin", "begin:", *self.lines]
        result, symbol = result_type(signature.result), signature.symbol
        head, is_short = f'{result} @"{symbol}"({", ".join(declared)}) nounwind', len(lines) < SHORT
        body = "\n".join(lines)
        return Translated(signature, head, body, is_short, self.declared, self.calls, self.reads)

    def _run(self, statements: Sequence[ast.stmt]) -> None:
        """Translate statements; those after the first that leaves the block are unreachable."""
        for statement in statements:
            if not self.open:
                return
            method = getattr(self, "_" + type(statement).__name__, None)
            if method is None:
                what = f"statement '{ast.unparse(statement).splitlines()[0]}'"
                self.fail(statement, f"{what} is not in the subset", "see ab_sim.engine.compiling")
            method(statement)

    # Assignment

    def _Assign(self, node: ast.Assign) -> None:
        value = self.loaded(self.value(node.value))
        for target in node.targets:
            self._assign(target, value)

    def _assign(self, target: ast.expr, value: Value) -> None:
        if isinstance(target, ast.Name):
            self._assign_name(target, target.id, value)
        elif isinstance(target, ast.Tuple):
            if isinstance(value, Number | ArrayView) or len(value.kind.kinds) != len(target.elts):
                what = f"a {text_of(value.kind)} in {ast.unparse(target)}"
                self.fail(target, what, "write one name for each value")
            for k, part in enumerate(target.elts):
                self._assign(part, self.field(value, k))
        elif isinstance(target, ast.Subscript):
            self._put(target, self._target(target), value)
        else:
            instead = "records never change; make a new one, or keep what changes in an array"
            self.fail(target, f"assignment to {ast.unparse(target)}", instead)

    def _assign_name(self, node: ast.AST, name: str, value: Value) -> None:
        needs_no_memory = value.immutable if isinstance(value, StoredRecord) else is_known(value)
        if (
            needs_no_memory
            and self._stored[name] == 1
            and not self._unrolling
            and name not in self.slots
        ):
            # The only assignment of a constant, or of a record that never changes: the name
            # needs no memory.
            self.bound[name] = value
            return
        kind, slot = self._slot(name, value.kind)
        value = self.fitted(node, value, kind, f"{name}, from its first assignment on,")
        if isinstance(value, Number):
            self.lines.append(f"store {value.kind.llvm} {value.code}, ptr {slot}")
        else:
            self.store(value, slot)

    def _slot(self, name: str, kind: Kind) -> tuple[Kind, str]:
        """Return kind and stack slot of a local variable; the first assignment allocates it."""
        if name not in self.slots:
            slot = f'%"{name}.slot"'
            of = kind.llvm if isinstance(kind, Scalar) else f"[{len(leaves(kind))} x i64]"
            self.entry.append(f"{slot} = alloca {of}, align 8")
            self.slots[name] = kind, slot
        return self.slots[name]

    def _target(self, node: ast.Subscript) -> tuple[str, Scalar]:
        """Return pointer and kind of the number of an array to which a statement assigns."""
        owner = self.value(node.value)
        place = self.place(node, owner) if isinstance(owner, ArrayView) else owner
        if not isinstance(owner, ArrayView) or not isinstance(place, str):
            self.fail(node, f"assignment to {ast.unparse(node)}", "assign to numbers, in a loop")
        return place, element_of(owner.kind)

    def _put(self, node: ast.AST, target: tuple[str, Scalar], value: Value) -> None:
        """Append a store of a value to a ``_target``."""
        pointer, kind = target
        value = self.fitted(node, value, kind, "the array's element")
        (code,) = self.flat(value)
        self.lines.append(f"store {kind.llvm} {code}, ptr {pointer}, align 8{ELEMENT}")

    def _AugAssign(self, node: ast.AugAssign) -> None:
        target = node.target
        if isinstance(target, ast.Subscript):
            pointer, kind = place = self._target(target)
            load = f"load {kind.llvm}, ptr {pointer}, align 8{ELEMENT}"
            before = Number(kind, self.put(load))
            self._put(node, place, self.operation(node, node.op, before, self.number(node.value)))
            return
        if not isinstance(target, ast.Name):
            self.fail(node, f"assignment to {ast.unparse(target)}", "use a variable")
        before = self.as_number(target, self._Name(target))
        after = self.operation(node, node.op, before, self.number(node.value))
        self._assign_name(node, target.id, after)

    # Control

    def _If(self, node: ast.If) -> None:
        test = self.condition(node.test)
        if test.constant is not None:
            self._run(node.body if test.constant else node.orelse)
            return
        yes, no, done = self.new("if"), self.new("else"), self.new("endif")
        self.fork(test.code, yes, no if node.orelse else done)
        self.start(yes)
        self._run(node.body)
        reached = self.open or not node.orelse
        self.go(done)
        if node.orelse:
            self.start(no)
            self._run(node.orelse)
            reached = self.open or reached
            self.go(done)
        if reached:
            self.start(done)

    def _While(self, node: ast.While) -> None:
        head, body, done = self.new("while"), self.new("do"), self.new("endwhile")
        self._no_else(node)
        self.go(head)
        self.start(head)
        for_ever = isinstance(node.test, ast.Constant) and node.test.value is True
        if for_ever:
            self.go(body)
        else:
            self.fork(self.condition(node.test).code, body, done)
        self._loop(node.body, body, head, done)
        self.go(head)
        if not for_ever or done in self._left:
            self.start(done)

    def _For(self, node: ast.For) -> None:
        self._no_else(node)
        if isinstance(node.iter, ast.Call) and self.static(node.iter.func) is range:
            self._for_range(node, node.iter)
            return
        items = self.loaded(self.value(node.iter))
        if isinstance(items, Number | ArrayView):
            instead = "write for i in range(...), or over a tuple"
            self.fail(node, f"loop over a {text_of(items.kind)}", instead)
        # A loop over a tuple is unrolled, as its items may differ in kind. A name that the body
        # assigns once in the source is then assigned in every copy: ``_unrolling`` keeps it from
        # being bound to its first value.
        done = self.new("endfor")
        for k in range(len(items.kind.kinds)):
            item, begin, following = self.field(items, k), self.new("do"), self.new("next")
            self._unrolling += 1
            name = node.target.id if isinstance(node.target, ast.Name) else ""
            stays = bool(name) and name not in stored(node.body)
            in_memory = isinstance(item, StoredRecord) and item.immutable
            if not (stays and in_memory):
                self._assign(node.target, item)
            if stays and (in_memory or is_known(item)):
                self.bound[name] = item  # an alias in this copy of the body
            self.go(begin)
            self._loop(node.body, begin, following, done)
            self._unrolling -= 1
            self.bound.pop(name, None)
            self.go(following)
            self.start(following)
        self.go(done)
        self.start(done)

    def _for_range(self, node: ast.For, call: ast.Call) -> None:
        if not 1 <= len(call.args) <= 3 or call.keywords or not isinstance(node.target, ast.Name):
            self.fail(node, "range", "write for i in range(...) with one to three arguments")
        numbers = [self.number(x) for x in call.args]
        if any(x.kind != INT for x in numbers):
            self.fail(node, "range of a number that is no int", "write int(...)")
        begin = numbers[0].code if len(numbers) > 1 else "0"
        end = numbers[min(len(numbers), 2) - 1].code
        step = numbers[2].constant if len(numbers) == 3 else 1
        if not step:
            self.fail(node, "range with this step", "write a constant other than 0")
        head, body = self.new("for"), self.new("do")
        following, done = self.new("next"), self.new("endfor")
        counter = "%" + self.new("counter")
        self.entry.append(f"{counter} = alloca i64, align 8")
        self.lines.append(f"store i64 {begin}, ptr {counter}")
        self.go(head)
        self.start(head)
        at = self.put(f"load i64, ptr {counter}")
        how = "slt" if step > 0 else "sgt"
        self.fork(self.put(f"icmp {how} i64 {at}, {end}"), body, done)
        self.start(body)
        self._assign(node.target, Number(INT, at))
        inner = self.new("do")
        self.go(inner)
        self._loop(node.body, inner, following, done)
        self.go(following)
        self.start(following)
        self.lines.append(f"store i64 {self.put(f'add nsw i64 {at}, {step}')}, ptr {counter}")
        self.go(head)
        self.start(done)

    def _loop(self, body: list[ast.stmt], begin: str, again: str, done: str) -> None:
        """Translate a loop's body from the block ``begin`` on.

        Parameters
        ----------
        body
            Statements of the loop.
        begin
            Label of the body's first block.
        again
            Label to which ``continue`` jumps.
        done
            Label to which ``break`` jumps.
        """
        self._ways.append((again, done))
        self.loops += 1
        self.start(begin)
        self._run(body)
        self.loops -= 1
        self._ways.pop()

    def _no_else(self, node: ast.For | ast.While) -> None:
        if node.orelse:
            self.fail(node, "else of a loop", "use a variable")

    def _Break(self, node: ast.Break) -> None:
        self._left.add(self._ways[-1][1])
        self.go(self._ways[-1][1])

    def _Continue(self, node: ast.Continue) -> None:
        self.go(self._ways[-1][0])

    def _Return(self, node: ast.Return) -> None:
        kind = self.source.result
        if node.value is None or kind is None:
            if kind is not None or not (
                node.value is None or isinstance(node.value, ast.Constant) and not node.value.value
            ):
                self.fail(node, "return", "return what the annotation says")
            self.end("ret void")
            return
        value = self.fitted(node, self.value(node.value), kind, "the result")
        flat = self.flat(value)
        if isinstance(kind, Scalar):
            self.end(f"ret {kind.llvm} {flat[0]}")
            return
        result, of = "poison", result_type(kind)
        for k, (leaf, one) in enumerate(zip(leaves(kind), flat, strict=True)):
            result = self.put(f"insertvalue {of} {result}, {leaf} {one}, {k}")
        self.end(f"ret {of} {result}")

    def _Expr(self, node: ast.Expr) -> None:
        if isinstance(node.value, ast.Call):
            self.value_or_none(node.value)
        elif not (isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)):
            self.fail(node, f"'{ast.unparse(node)}' by itself", "leave it out")

    def _Pass(self, node: ast.Pass) -> None:
        pass


def stored(statements: Sequence[ast.stmt]) -> Iterator[str]:
    """Yield the names to which statements assign, once for each assignment."""
    for statement in statements:
        targets = [getattr(statement, "target", None), *getattr(statement, "targets", ())]
        for target in filter(None, targets):
            names = (n for n in ast.walk(target) if isinstance(n, ast.Name))
            yield from (n.id for n in names if isinstance(n.ctx, ast.Store))
        for part in ("body", "orelse"):
            yield from stored(getattr(statement, part, ()))
