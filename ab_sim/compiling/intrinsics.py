"""Functions that are written out instead of called: Python's own, math's, and ``kinds``'."""

import ast
import builtins
import math
from collections.abc import Callable
from typing import Any

from ab_sim.compiling import kinds
from ab_sim.compiling.blocks import ArrayView, Fields, Number, StoredRecord, Value, constant
from ab_sim.compiling.expressions import Expressions
from ab_sim.compiling.kinds import Array
from ab_sim.compiling.products import PUT_PRODUCT
from ab_sim.compiling.source import BOOL, FLOAT, INT

Values = list[Value]
Intrinsic = Callable[[Expressions, ast.Call, Values], Value | None]
MOST = 1 << 62


def _numbers(e: Expressions, node: ast.Call, values: Values, least: int, most: int) -> list[Number]:
    if not least <= len(values) <= most:
        e.fail(node, f"{len(values)} arguments of {ast.unparse(node.func)}", f"pass {least}")
    return [e.as_number(x, value) for x, value in zip(node.args, values, strict=True)]


def _of_floats(name: str, count: int) -> Intrinsic:
    def made(e: Expressions, node: ast.Call, values: Values) -> Value:
        given = [e.converted(x, FLOAT).code for x in _numbers(e, node, values, count, count)]
        return Number(FLOAT, e.llvm(f"{name}.f64", "double", *given))

    return made


def _rounded(name: str) -> Intrinsic:
    """To an int; beyond 64 bits to the nearest of these, 0 of a NaN, where Python raises."""

    def made(e: Expressions, node: ast.Call, values: Values) -> Value:
        (x,) = _numbers(e, node, values, 1, 1)
        if x.kind != FLOAT:
            return e.converted(x, INT)
        if x.constant is not None and name == "trunc" and abs(x.constant) < MOST:
            return constant(int(x.constant))
        code = x.code if name == "trunc" else e.llvm(f"{name}.f64", "double", x.code)
        return Number(INT, e.llvm("fptosi.sat.i64.f64", "i64", code, of="double"))

    return made


def _float(e: Expressions, node: ast.Call, values: Values) -> Value:
    return e.converted(_numbers(e, node, values, 1, 1)[0], FLOAT)


def _bool(e: Expressions, node: ast.Call, values: Values) -> Value:
    return e.truth(*_numbers(e, node, values, 1, 1))


def _abs(e: Expressions, node: ast.Call, values: Values) -> Value:
    (x,) = e.alike(*_numbers(e, node, values, 1, 1))
    if x.kind == FLOAT:
        return Number(FLOAT, e.llvm("fabs.f64", "double", x.code))
    e.declared.add("declare i64 @llvm.abs.i64(i64, i1)")
    return Number(INT, e.put(f"call i64 @llvm.abs.i64(i64 {x.code}, i1 false)"))


def _first_of(op: ast.cmpop) -> Intrinsic:
    """min or max as Python's: the first argument stays unless a later one compares as beyond it."""

    def made(e: Expressions, node: ast.Call, values: Values) -> Value:
        found, *others = e.alike(*_numbers(e, node, values, 2, len(values)))
        for x in others:
            beyond, kind = e.compared(op, x, found), found.kind
            text = f"select i1 {beyond.code}, {kind.llvm} {x.code}, {kind.llvm} {found.code}"
            found = Number(kind, e.put(text))
        return found

    return made


def _len(e: Expressions, node: ast.Call, values: Values) -> Value:
    if len(values) == 1 and isinstance(values[0], ArrayView):
        return Number(INT, values[0].shape[0])
    if len(values) == 1 and isinstance(values[0], Fields | StoredRecord):
        return constant(len(values[0].kind.kinds))
    e.fail(node, "len", "pass one array or tuple")


def _isnan(e: Expressions, node: ast.Call, values: Values) -> Value:
    (x,) = _numbers(e, node, values, 1, 1)
    return Number(BOOL, e.put(f"fcmp uno double {e.converted(x, FLOAT).code}, 0.0"))


def _against_infinity(how: str) -> Intrinsic:
    def made(e: Expressions, node: ast.Call, values: Values) -> Value:
        (x,) = _numbers(e, node, values, 1, 1)
        size = e.llvm("fabs.f64", "double", e.converted(x, FLOAT).code)
        return Number(BOOL, e.put(f"fcmp {how} double {size}, {constant(math.inf).code}"))

    return made


def _fmod(e: Expressions, node: ast.Call, values: Values) -> Value:
    a, b = (e.converted(x, FLOAT).code for x in _numbers(e, node, values, 2, 2))
    return Number(FLOAT, e.put(f"frem double {a}, {b}"))


def _from_bits(e: Expressions, node: ast.Call, values: Values) -> Value:
    (x,) = e.alike(*_numbers(e, node, values, 1, 1))
    if x.kind != INT:
        e.fail(node, "float_from_bits of a float", "pass an int")
    return Number(FLOAT, e.put(f"bitcast i64 {x.code} to double"))


def _scratch(e: Expressions, node: ast.Call, values: Values) -> Value:
    shape = e.alike(*_numbers(e, node, values, 1, 2))
    if any(x.kind != INT for x in shape):
        e.fail(node, "scratch of a float", "write int(...)")
    kind, lengths = Array(len(shape), float), tuple(x.code for x in shape)
    known = [int(x.constant) for x in shape if x.constant is not None]
    if len(known) == len(shape):
        made = "%" + e.new("scratch")
        e.entry.append(f"{made} = alloca [{math.prod(known)} x double], align 64")
        return ArrayView(kind, made, lengths)
    if e.loops:
        e.fail(node, "scratch of a run-time size in a loop", "take it out of the loop")
    size = lengths[0]
    for length in lengths[1:]:
        size = e.put(f"mul i64 {size}, {length}")
    return ArrayView(kind, e.put(f"alloca double, i64 {size}, align 64"), lengths)


def _put_product(e: Expressions, node: ast.Call, values: Values) -> None:
    kinds_given = [x.kind for x in values]
    if kinds_given != [Array(1, float), Array(1, float), Array(2, float)]:
        e.fail(node, "these arguments of put_product", "pass Floats, Floats and a Table")
    out, factors, rows = (x for x in values if isinstance(x, ArrayView))
    e.declared.add(PUT_PRODUCT)
    given = f"ptr {out.pointer}, i64 {out.shape[0]}, ptr {factors.pointer}, "
    given += f"i64 {factors.shape[0]}, ptr {rows.pointer}, i64 {rows.shape[1]}"
    e.lines.append(f"call void @put_product({given})")


def _call(e: Expressions, node: ast.Call, values: Values) -> None:
    """LLVM may take it that records are not touched: emitted code gets no pointers to them."""
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
    builtins.int: _rounded("trunc"),
    builtins.float: _float,
    builtins.bool: _bool,
    builtins.len: _len,
    math.sqrt: _of_floats("sqrt", 1),
    math.fabs: _of_floats("fabs", 1),
    math.copysign: _of_floats("copysign", 2),
    math.fmod: _fmod,
    math.floor: _rounded("floor"),
    math.ceil: _rounded("ceil"),
    math.trunc: _rounded("trunc"),
    math.isnan: _isnan,
    math.isinf: _against_infinity("oeq"),
    math.isfinite: _against_infinity("olt"),
    kinds.fma: _of_floats("fma", 3),
    kinds.float_from_bits: _from_bits,
    kinds.scratch: _scratch,
    kinds.call: _call,
    kinds.put_product: _put_product,
}
