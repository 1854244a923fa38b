"""Translate expressions of the subset to LLVM IR, including those that branch."""

import ast
import functools
from collections.abc import Callable, Mapping, Sequence
from types import FunctionType
from typing import Any, Protocol

from ab_sim.engine.compiling.blocks import (
    COMPARED,
    ELEMENT,
    RANK,
    ArrayView,
    Fields,
    Number,
    Operations,
    StoredRecord,
    Value,
    constant,
)
from ab_sim.engine.compiling.kinds import Array
from ab_sim.engine.compiling.source import (
    BOOL,
    FLOAT,
    INT,
    FunctionSource,
    Kind,
    RecordKind,
    Scalar,
    Signature,
    element_of,
    for_class,
    is_record,
    kind_of,
    leaves,
    text_of,
    tuple_of,
)

MISSING = object()
"""Result of ``Expressions.static`` for a node that is not a global value."""


class Callees(Protocol):
    """Provider of the functions that a translated function calls."""

    flags: Mapping[str, bool]
    """Values of records' bool fields that are known at compile time, by name."""

    def signature(self, function: FunctionType) -> Signature:
        """Return the signature of a function, which is translated later if necessary."""


class Expressions(Operations):
    """Translator of a function's expressions.

    Parameters
    ----------
    source
        Source of the function.
    callees
        Provider of other functions.
    local
        Names of local variables, which hide global ones.
    intrinsics
        Functions that are expanded in place instead of called.
    """

    def __init__(
        self,
        source: FunctionSource,
        callees: Callees,
        local: set[str],
        intrinsics: dict[Any, Callable[..., Value | None]],
    ) -> None:
        super().__init__(source)
        self._callees, self._local, self._intrinsics = callees, local, intrinsics
        self.slots: dict[str, tuple[Kind, str]] = {}
        """Kinds and stack slots of local variables, by name."""
        self.bound: dict[str, Value] = {}
        """Values of names that need no memory."""
        self.loops = 0
        """Number of loops around the current statement."""
        self.calls: set[FunctionType] = set()
        self.reads: set[str] = set()
        """Names of records' fields that are read."""

    # Values

    def static(self, node: ast.AST) -> Any:
        """Return the value of a global name, or MISSING."""
        if isinstance(node, ast.Name) and node.id not in self._local:
            try:
                return self.source.global_value(node.id)
            except KeyError:
                return MISSING
        if isinstance(node, ast.Attribute):
            owner = self.static(node.value)
            return MISSING if owner is MISSING else getattr(owner, node.attr, MISSING)
        return MISSING

    def value(self, node: ast.AST) -> Value:
        """Return the value of an expression."""
        value = self.value_or_none(node)
        if value is None:
            self.fail(node, "a function without a result is used as a value", "call it by itself")
        return value

    def value_or_none(self, node: ast.AST) -> Value | None:
        """Return the value of an expression, or None for a call of a function without a result."""
        static = self.static(node)
        if static is not MISSING:
            return self._constant(node, static)
        method = getattr(self, "_" + type(node).__name__, None)
        if method is None:
            instead = _INSTEAD.get(type(node), "see ab_sim.engine.compiling for the subset")
            self.fail(node, f"'{ast.unparse(node)}' is not in the subset", instead)
        value: Value | None = method(node)
        return value

    def number(self, node: ast.AST) -> Number:
        """Return the value of an expression that is a float, int or bool."""
        return self.as_number(node, self.value(node))

    def as_number(self, node: ast.AST, value: Value) -> Number:
        """Return a value unchanged; raise an error if it is not a number."""
        if not isinstance(value, Number):
            self.fail(
                node,
                f"{ast.unparse(node)} is a {text_of(value.kind)}, not a number",
                "work on its elements or fields, in a loop",
            )
        return value

    def condition(self, node: ast.AST) -> Number:
        """Return the truth value of an expression; a constant if known at compile time."""
        return self.truth(self.number(node))

    def fitted(self, node: ast.AST, value: Value, kind: Kind, what: str) -> Value:
        """Return a value converted to the required kind; raise an error if this is not possible.

        Parameters
        ----------
        node
            Syntax node of the value, for the error's line.
        value
            Value to convert.
        kind
            Required kind.
        what
            Name of the value's destination, for the error.
        """
        if value.kind == kind:
            return value
        if isinstance(value, Number) and isinstance(kind, Scalar):
            if RANK[value.kind] < RANK[kind]:
                return self.converted(value, kind)
            how = "write a comparison" if kind == BOOL else f"write {kind}(...)"
            if kind == INT and value.kind == FLOAT:
                how += ", or begin with a float, as 0.0, if it is to be one"
            self.fail(node, f"{what} is {kind}, this is {value.kind}", how)
        self.fail(
            node,
            f"{what} is {text_of(kind)}, this is {text_of(value.kind)}",
            "use another name, or change the annotation",
        )

    # Names, constants, parts

    def _constant(self, node: ast.AST, constant_: Any) -> Value:
        """Return a constant or a global value as a number; raise an error if it is not one."""
        if isinstance(constant_, bool | int | float):
            if isinstance(constant_, int) and not -(2**63) <= constant_ < 2**63:
                self.fail(node, "a number of more than 64 bits", "keep ints below 2**63")
            return constant(constant_)
        self.fail(
            node,
            f"{ast.unparse(node)} is a {type(constant_).__name__}",
            "global names may be numbers, and functions that are called; pass anything else as an "
            "argument",
        )

    def _Constant(self, node: ast.Constant) -> Value:
        return self._constant(node, node.value)

    def _Name(self, node: ast.Name) -> Value:
        if node.id in self.bound:
            return self.bound[node.id]
        if node.id not in self.slots:
            self.fail(node, f"{node.id} is not known here", "assign to it on a line above")
        kind, slot = self.slots[node.id]
        if isinstance(kind, Scalar):
            return Number(kind, self.put(f"load {kind.llvm}, ptr {slot}"))
        return self.load(kind, slot, immutable=False)

    def _Tuple(self, node: ast.Tuple) -> Value:
        values = tuple(self.value(x) for x in node.elts)
        return Fields(tuple_of(x.kind for x in values), values)

    def _Attribute(self, node: ast.Attribute) -> Value:
        owner, name = self.value(node.value), node.attr
        if isinstance(owner, Fields | StoredRecord):
            if name not in owner.kind.names:
                field_names = ", ".join(owner.kind.names)
                self.fail(node, f"{owner.kind} has no {name}", f"its fields are {field_names}")
            self.reads.add(name)
            if name in self._callees.flags:
                return constant(self._callees.flags[name])
            return self.field(owner, owner.kind.names.index(name))
        if isinstance(owner, ArrayView) and name == "shape":
            lengths = tuple(Number(INT, length) for length in owner.shape)
            return Fields(tuple_of([INT] * len(lengths)), lengths)
        if isinstance(owner, ArrayView) and name == "size":
            size = owner.shape[0]
            for length in owner.shape[1:]:
                size = self.put(f"mul i64 {size}, {length}")
            return Number(INT, size)
        self.fail(node, f".{name} of a {text_of(owner.kind)}", "arrays have .size and .shape")

    def _Subscript(self, node: ast.Subscript) -> Value:
        owner = self.value(node.value)
        if isinstance(owner, ArrayView):
            place = self.place(node, owner)
            if isinstance(place, ArrayView):
                return place
            kind = element_of(owner.kind)
            return Number(kind, self.put(f"load {kind.llvm}, ptr {place}, align 8{ELEMENT}"))
        index = self.value(node.slice)
        if isinstance(owner, Number) or not isinstance(index, Number) or index.kind != INT:
            self.fail(node, f"{ast.unparse(node)} is no element", "index arrays, and tuples")
        if index.constant is None or not 0 <= index.constant < len(owner.kind.kinds):
            self.fail(node, "index of a tuple", "write a constant within it, or use an array")
        return self.field(owner, int(index.constant))

    def place(self, node: ast.Subscript, owner: ArrayView) -> ArrayView | str:
        """Return the target of a subscript: a pointer to a number, or a view if axes remain."""
        parts = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        if len(parts) > owner.kind.rank:
            self.fail(node, f"{len(parts)} indices of a {text_of(owner.kind)}", "use fewer")
        index: list[str] = []
        rest = owner.shape[len(parts) :]
        for part in parts:
            if not isinstance(part, ast.Slice):
                index.append(self._whole(part))
                continue
            if part is not parts[-1] or part.step is not None:
                self.fail(node, "a view that is not contiguous", "slice the last index given: i:j")
            low = self._whole(part.lower) if part.lower else "0"
            high = self._whole(part.upper) if part.upper else owner.shape[len(index)]
            index.append(low)
            rest = (high if low == "0" else self.put(f"sub i64 {high}, {low}"), *rest)
        pointer = self.element(owner, index)
        return ArrayView(Array(len(rest), owner.kind.element), pointer, rest) if rest else pointer

    def _whole(self, node: ast.AST) -> str:
        """Return LLVM's name of an index; raise an error for a float or a negative constant."""
        index = self.number(node)
        if index.kind == FLOAT:
            self.fail(node, f"index {ast.unparse(node)} is a float", "write int(...)")
        if index.constant is not None and index.constant < 0:
            self.fail(node, "negative index", "count from the front: a[a.size - 1]")
        return self.converted(index, INT).code

    # Arithmetic

    def _BinOp(self, node: ast.BinOp) -> Value:
        return self.operation(node, node.op, self.number(node.left), self.number(node.right))

    def _UnaryOp(self, node: ast.UnaryOp) -> Value:
        x = self.number(node.operand)
        if isinstance(node.op, ast.Not):
            x = self.truth(x)
            if x.constant is not None:
                return constant(not x.constant)
            return Number(BOOL, self.put(f"xor i1 {x.code}, true"))
        if not isinstance(node.op, ast.USub):
            self.fail(node, f"'{ast.unparse(node)}' is not in the subset", "write not, or -x")
        x = self.converted(x, self.wider(x))
        if x.constant is not None:
            return constant(-x.constant)
        text = f"fneg double {x.code}" if x.kind == FLOAT else f"sub i64 0, {x.code}"
        return Number(x.kind, self.put(text))

    # Calls

    def _Call(self, node: ast.Call) -> Value | None:
        callee, owners = self._callee(node.func)
        if node.keywords or any(isinstance(x, ast.Starred) for x in node.args):
            self.fail(node, "arguments by name, or with *", "pass them by place, one by one")
        try:
            intrinsic = self._intrinsics.get(callee)
        except TypeError:
            intrinsic = None
        if intrinsic is not None:
            return intrinsic(self, node, [self.value(x) for x in node.args])
        if is_record(callee):
            kind = kind_of(callee)
            if not isinstance(kind, RecordKind):
                self.fail(node, f"a field of {callee.__name__}", "annotate all as in the subset")
            values = [self.value(x) for x in node.args]
            return Fields(kind, tuple(self._given(node, values, kind.names, kind.kinds)))
        if isinstance(callee, FunctionType):
            return self._subset_call(node, callee, [*owners, *map(self.value, node.args)])
        self.fail(
            node,
            f"call of {ast.unparse(node.func)}",
            "functions of the subset, NamedTuple classes, and those that are listed in "
            "ab_sim.engine.compiling can be called",
        )

    def _callee(self, node: ast.expr) -> tuple[Any, list[Value]]:
        """Return the callee of a call, and the record if the callee is a method of its class."""
        callee = self.static(node)
        if callee is MISSING and isinstance(node, ast.Attribute):
            owner = self.value(node.value)
            if isinstance(owner, Fields | StoredRecord):
                return getattr(owner.kind.cls, node.attr, MISSING), [owner]
        return getattr(callee, "__wrapped__", callee), []

    def _subset_call(
        self, node: ast.Call, function: FunctionType, values: Sequence[Value]
    ) -> Value | None:
        """Append a call of another function of the subset, and return its result."""
        if values and isinstance(values[0].kind, RecordKind) and values[0].kind.cls:
            function = for_class(function, values[0].kind.cls)
        self.calls.add(function)
        symbol, names, kinds, result = self._callees.signature(function)
        arguments_ = self._given(node, values, names, kinds)
        arguments = ", ".join(
            f"{leaf} {one}" for value in arguments_ for leaf, one in self.passed(value)
        )
        if result is None:
            self.lines.append(f'call void @"{symbol}"({arguments})')
            return None
        result_code = self.put(f'call {result_type(result)} @"{symbol}"({arguments})')
        if isinstance(result, Scalar):
            return Number(result, result_code)
        of = result_type(result)
        parts = [
            self.put(f"extractvalue {of} {result_code}, {k}") for k in range(len(leaves(result)))
        ]
        return self.made(result, iter(parts))

    def _given(
        self, node: ast.Call, values: Sequence[Value], names: Sequence[str], kinds: Sequence[Kind]
    ) -> list[Value]:
        """Return the arguments of a call, converted to the kinds that the function takes."""
        called = ast.unparse(node.func)
        if len(values) != len(names):
            takes = f"{called} takes {len(names)} arguments: {', '.join(names)}"
            self.fail(node, f"{takes}; this passes {len(values)}", "pass each one once")
        nodes = [node.func, *node.args][-len(values) :]
        return [
            self.fitted(x, value, kind, f"{name} of {called}")
            for x, value, name, kind in zip(nodes, values, names, kinds, strict=True)
        ]


def result_type(kind: Kind | None) -> str:
    """Return the type that LLVM's function returns for a result of a kind."""
    if kind is None:
        return "void"
    return kind.llvm if isinstance(kind, Scalar) else "{ " + ", ".join(leaves(kind)) + " }"


_INSTEAD: dict[type[ast.AST], str] = {
    ast.ListComp: "write a loop",
    ast.GeneratorExp: "write a loop",
    ast.List: "use a tuple, or scratch(n)",
    ast.Dict: "use a NamedTuple",
    ast.Lambda: "write a function",
    ast.JoinedStr: "leave texts to the caller",
    ast.NamedExpr: "assign on a line of its own",
}


class Conditions(Expressions):
    """Translator of a function's expressions, including those that branch."""

    def _Compare(self, node: ast.Compare) -> Value:
        for op in node.ops:
            if type(op) not in COMPARED:
                self.fail(node, f"'{ast.unparse(node)}'", "write ==, as in a == b or a == c")
        last = [self.number(node.left)]

        def step(op: ast.cmpop, right: ast.AST) -> Number:
            a, b = last[0], self.number(right)
            last[0] = b
            return self.compared(op, a, b)

        pairs = list(zip(node.ops, node.comparators, strict=True))
        return self._one_by_one([functools.partial(step, *pair) for pair in pairs], True)

    def _BoolOp(self, node: ast.BoolOp) -> Value:
        def step(part: ast.AST) -> Number:
            x = self.number(part)
            if x.kind != BOOL:
                self.fail(part, f"{x.kind} in 'and' or 'or'", "write a comparison, as x != 0")
            return x

        steps = [functools.partial(step, part) for part in node.values]
        return self._one_by_one(steps, isinstance(node.op, ast.And))

    def _one_by_one(self, steps: Sequence[Callable[[], Number]], every: bool) -> Number:
        """Return whether every step, or any, is true, with short-circuit evaluation.

        Each step is a block that jumps to the end if it decides the result; a phi node merges the
        results there. A step that is known at compile time emits no code: it either decides the
        result or changes nothing.
        """
        if len(steps) == 1:
            return steps[0]()
        done, ends = self.new("done"), list[str]()
        for step in steps[:-1]:
            truth = step()
            if truth.constant is (not every):
                break
            if truth.constant is None:
                following = self.new("next")
                ends.append(f"[ {'false' if every else 'true'}, %{self.block} ]")
                self.fork(truth.code, *((following, done) if every else (done, following)))
                self.start(following)
        else:
            truth = steps[-1]()
        if not ends:
            return truth
        ends.append(f"[ {truth.code}, %{self.block} ]")
        self.go(done)
        self.start(done)
        return Number(BOOL, self.put(f"phi i1 {', '.join(ends)}"))

    def _IfExp(self, node: ast.IfExp) -> Value:
        test = self.condition(node.test)
        if test.constant is not None:
            return self.value(node.body if test.constant else node.orelse)
        yes, no, done = self.new("yes"), self.new("no"), self.new("done")
        self.fork(test.code, yes, no)
        self.start(yes)
        a = self.value(node.body)
        of_a, end_of_yes = self.flat(a), self.block
        self.go(done)
        self.start(no)
        b = self.fitted(node.orelse, self.value(node.orelse), a.kind, "the other branch")
        of_b, end_of_no = self.flat(b), self.block
        self.go(done)
        self.start(done)
        merged = [
            self.put(f"phi {leaf} [ {x}, %{end_of_yes} ], [ {y}, %{end_of_no} ]")
            for leaf, x, y in zip(leaves(a.kind), of_a, of_b, strict=True)
        ]
        return self.made(a.kind, iter(merged))
