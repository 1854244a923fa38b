"""Translate operations on numbers to LLVM IR.

Results are those of Python, except that a division by zero follows IEEE 754, and that ints have 64
bits and wrap.
"""

import ast
import operator
from collections.abc import Callable
from typing import Any, NoReturn

from ab_sim.engine.compiling.blocks import BlockWriter, Number, constant
from ab_sim.engine.compiling.source import BOOL, FLOAT, INT, FunctionSource, Scalar

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

    Args:
        source: source of the function.
    """

    def __init__(self, source: FunctionSource) -> None:
        super().__init__()
        self.source = source

    def fail(self, node: ast.AST, what: str, instead: str) -> NoReturn:
        """Raise an error that names a line of the function."""
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
