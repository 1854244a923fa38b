"""Functions that are expanded in place instead of called: builtins, math's, and ``kinds``'."""

import ast
import builtins
import math
from collections.abc import Callable
from typing import Any

from ab_sim.engine.compiling import kinds
from ab_sim.engine.compiling.blocks import ArrayView, Number, Value, constant
from ab_sim.engine.compiling.expressions import Expressions
from ab_sim.engine.compiling.kinds import Array
from ab_sim.engine.compiling.source import BOOL, FLOAT, INT

Values = list[Value]
Intrinsic = Callable[[Expressions, ast.Call, Values], Value | None]


def _numbers(e: Expressions, node: ast.Call, values: Values, least: int, most: int) -> list[Number]:
    """Return the arguments of a call as numbers; raise an error unless least to most are passed."""
    if not least <= len(values) <= most:
        e.fail(node, f"{len(values)} arguments of {ast.unparse(node.func)}", f"pass {least}")
    return [e.as_number(x, value) for x, value in zip(node.args, values, strict=True)]


def _of_floats(name: str, count: int) -> Intrinsic:
    """Return an intrinsic that calls LLVM's function of this name on ``count`` floats."""

    def made(e: Expressions, node: ast.Call, values: Values) -> Value:
        codes = [e.converted(x, FLOAT).code for x in _numbers(e, node, values, count, count)]
        return Number(FLOAT, e.llvm(f"{name}.f64", "double", *codes))

    return made


def _int(e: Expressions, node: ast.Call, values: Values) -> Value:
    """Convert to int; saturate beyond 64 bits, and return 0 for a NaN, where Python raises."""
    (x,) = _numbers(e, node, values, 1, 1)
    if x.kind != FLOAT:
        return e.converted(x, INT)
    return Number(INT, e.llvm("fptosi.sat.i64.f64", "i64", x.code, of="double"))


def _float(e: Expressions, node: ast.Call, values: Values) -> Value:
    return e.converted(_numbers(e, node, values, 1, 1)[0], FLOAT)


def _abs(e: Expressions, node: ast.Call, values: Values) -> Value:
    (x,) = e.alike(*_numbers(e, node, values, 1, 1))
    if x.kind == FLOAT:
        return Number(FLOAT, e.llvm("fabs.f64", "double", x.code))
    e.declared.add("declare i64 @llvm.abs.i64(i64, i1)")
    return Number(INT, e.put(f"call i64 @llvm.abs.i64(i64 {x.code}, i1 false)"))


def _first_of(op: ast.cmpop) -> Intrinsic:
    """Return an intrinsic for min or max with Python's rule for NaNs.

    The first argument is kept unless a later one compares as smaller or larger.
    """

    def made(e: Expressions, node: ast.Call, values: Values) -> Value:
        best, *others = e.alike(*_numbers(e, node, values, 2, len(values)))
        for x in others:
            beyond, kind = e.compared(op, x, best), best.kind
            text = f"select i1 {beyond.code}, {kind.llvm} {x.code}, {kind.llvm} {best.code}"
            best = Number(kind, e.put(text))
        return best

    return made


def _isnan(e: Expressions, node: ast.Call, values: Values) -> Value:
    (x,) = _numbers(e, node, values, 1, 1)
    return Number(BOOL, e.put(f"fcmp uno double {e.converted(x, FLOAT).code}, 0.0"))


def _scratch(e: Expressions, node: ast.Call, values: Values) -> Value:
    shape = e.alike(*_numbers(e, node, values, 1, 2))
    if any(x.kind != INT for x in shape):
        e.fail(node, "scratch of a float", "write int(...)")
    kind, lengths = Array(len(shape), float), tuple(x.code for x in shape)
    constants = [int(x.constant) for x in shape if x.constant is not None]
    if len(constants) == len(shape):
        name = "%" + e.new("scratch")
        e.entry.append(f"{name} = alloca [{math.prod(constants)} x double], align 64")
        return ArrayView(kind, name, lengths)
    if e.loops:
        e.fail(node, "scratch of a run-time size in a loop", "take it out of the loop")
    size = lengths[0]
    for length in lengths[1:]:
        size = e.put(f"mul i64 {size}, {length}")
    return ArrayView(kind, e.put(f"alloca double, i64 {size}, align 64"), lengths)


def _call(e: Expressions, node: ast.Call, values: Values) -> None:
    """Append a call of emitted code.

    Emitted code gets no pointers to records, so the call is marked as not touching them.
    """
    address, *others = values or [constant(0.0)]
    if not isinstance(address, Number) or address.kind != INT:
        e.fail(node, "call", "pass an address first, which is an int")
    arguments = []
    for x, value in zip(node.args[1:], others, strict=True):
        if isinstance(value, ArrayView):
            arguments.append(f"ptr {value.pointer}")
        elif isinstance(value, Number):
            number = e.converted(value, e.wider(value))
            arguments.append(f"{number.kind.llvm} {number.code}")
        else:
            e.fail(x, f"{ast.unparse(x)} goes to emitted code", "pass arrays, floats and ints")
    to = e.put(f"inttoptr i64 {address.code} to ptr")
    e.lines.append(f"call void {to}({', '.join(arguments)}) nounwind, !tbaa !4")


INTRINSICS: dict[Any, Intrinsic] = {
    builtins.abs: _abs,
    builtins.min: _first_of(ast.Lt()),
    builtins.max: _first_of(ast.Gt()),
    builtins.int: _int,
    builtins.float: _float,
    math.sqrt: _of_floats("sqrt", 1),
    math.isnan: _isnan,
    kinds.fma: _of_floats("fma", 3),
    kinds.scratch: _scratch,
    kinds.call: _call,
}
