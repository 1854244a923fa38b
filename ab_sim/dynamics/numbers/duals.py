"""A value and its derivatives in seven directions: the same formulas, and their exact derivatives.

A dual number is x + sum_k x_k e_k with e_j e_k = 0, of which any formula makes
f(x) + sum_k f'(x) x_k e_k: the chain rule, operation by operation, so that the derivatives are
those of the code that runs, to rounding (Griewank and Walther, Evaluating Derivatives (2008),
ch. 3). The value is what a float would be, to the bit: each rule takes it from the same operation
on floats. Branches go by the value, and the derivatives are those of the branch taken; at a kink
they are of one side.

In memory a dual is eight floats: the value, and behind it the derivatives. An array of duals is an
array of floats with a last axis of that length, seeded by whoever calls.
"""

import math
import operator
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.errors import TypingError
from numba.core.imputils import lower_cast
from numba.extending import intrinsic, overload, register_jitable

from ab_sim.dynamics.dispatch import INLINED
from ab_sim.dynamics.numbers.cos_sin import cos_sin
from ab_sim.dynamics.numbers.kinds import (
    EIGHT,
    FIRST,
    VECTOR,
    Call,
    call_of,
    converted,
    duals,
    in_all,
    kind_among,
    rule,
    viewed_as,
)
from ab_sim.dynamics.numbers.multiply_add import multiply_add

PARTIALS = EIGHT - 1
"""How many directions a dual has derivatives in; along the last axis they follow the value."""

as_duals = viewed_as(duals, aligned=False)
"""An array of floats, whose last axis is (value, derivatives), as an array of duals.

It must be C-contiguous.
"""

_ONE, _MINUS_ONE = (ir.Constant(ir.DoubleType(), number) for number in (1.0, -1.0))
_BEHIND_VALUE = ir.Constant(ir.IntType(64), 1)


@lower_cast(types.Float, duals)
@lower_cast(types.Integer, duals)
def _constant(context: Any, builder: Any, kind: Any, to: Any, value: Any) -> Any:
    number = context.cast(builder, value, kind, types.float64)
    return builder.insert_element(ir.Constant(VECTOR, [0.0] * EIGHT), number, FIRST)


def _values(call: Call, numbers: tuple[Any, ...]) -> list[Any]:
    return [
        call.builder.extract_element(number, FIRST)
        if kind == duals
        else call.context.cast(call.builder, number, kind, types.float64)
        for number, kind in zip(numbers, call.kinds, strict=True)
    ]


def _chained(call: Call, value: Any, slopes: tuple[Any, ...], numbers: tuple[Any, ...]) -> Any:
    """The dual of a function's value, given its partial derivatives and its arguments."""
    builder, total = call.builder, None
    for slope, number, kind in zip(slopes, numbers, call.kinds, strict=True):
        if kind == duals:
            each = in_all(builder, slope)
            if total is None:
                total = builder.fmul(each, number)
            else:
                total = call_of(builder, "fma", each, number, total)
    return builder.insert_element(total, value, FIRST)


def _differentiable(count: int, *operations: Any) -> Any:
    """Decorator of ``f(builder, *values)``: value and partial derivatives of the operations."""

    def register(f: Any) -> None:
        @rule(duals, count, *operations)
        def generate(call: Call, *numbers: Any) -> Any:
            value, slopes = f(call.builder, *_values(call, numbers))
            return _chained(call, value, slopes, numbers)

    return register


@_differentiable(2, operator.add, operator.iadd)
def _sum(builder: Any, x: Any, y: Any) -> Any:
    return builder.fadd(x, y), (_ONE, _ONE)


@_differentiable(2, operator.sub, operator.isub)
def _difference(builder: Any, x: Any, y: Any) -> Any:
    return builder.fsub(x, y), (_ONE, _MINUS_ONE)


@_differentiable(2, operator.mul, operator.imul)
def _product(builder: Any, x: Any, y: Any) -> Any:
    return builder.fmul(x, y), (y, x)


@_differentiable(2, operator.truediv, operator.itruediv)
def _quotient(builder: Any, x: Any, y: Any) -> Any:
    value, inverse = builder.fdiv(x, y), builder.fdiv(_ONE, y)
    return value, (inverse, builder.fneg(builder.fmul(value, inverse)))


@_differentiable(1, operator.neg)
def _negative(builder: Any, x: Any) -> Any:
    return builder.fneg(x), (_MINUS_ONE,)


@_differentiable(1, abs)
def _magnitude(builder: Any, x: Any) -> Any:
    falls = builder.fcmp_ordered("<", x, ir.Constant(ir.DoubleType(), 0.0))
    return call_of(builder, "fabs", x), (builder.select(falls, _MINUS_ONE, _ONE),)


@_differentiable(3, multiply_add)
def _fused(builder: Any, x: Any, y: Any, z: Any) -> Any:
    return call_of(builder, "fma", x, y, z), (y, x, _ONE)


def _comparison(operation: Any, sign: str) -> None:
    @rule(duals, 2, operation, result=types.boolean)
    def generate(call: Call, *numbers: Any) -> Any:
        # As for floats: what is not a number differs from everything, and is not ordered.
        compare = call.builder.fcmp_unordered if sign == "!=" else call.builder.fcmp_ordered
        return compare(sign, *_values(call, numbers))


def _choice(operation: Any, sign: str) -> None:
    @rule(duals, 2, operation)
    def generate(call: Call, *numbers: Any) -> Any:
        x, y = _values(call, numbers)
        second = call.builder.fcmp_ordered(sign, y, x)
        first_dual, second_dual = converted(call, duals, numbers)
        return call.builder.select(second, second_dual, first_dual)


_comparison(operator.lt, "<")
_comparison(operator.le, "<=")
_comparison(operator.gt, ">")
_comparison(operator.ge, ">=")
_comparison(operator.eq, "==")
_comparison(operator.ne, "!=")
_choice(max, ">")
_choice(min, "<")


@rule(duals, 1, int, result=types.intp)
def _whole(call: Call, x: Any) -> Any:
    # float(x) does not compile: it would drop the derivatives. What is whole has none.
    return call.context.cast(call.builder, *_values(call, (x,)), types.float64, types.intp)


@intrinsic
def value_of(typing_context, x):  # type: ignore[no-untyped-def]
    """The value of a dual; a plain number's is itself, as a float."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        return _values(Call(context, builder, signature.args), arguments)[0]

    return types.float64(x), generate


@intrinsic
def partial_of(typing_context, x, direction):  # type: ignore[no-untyped-def]
    """The derivative of a dual in a direction, 0 .. PARTIALS - 1; a plain number's is 0."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        number = context.cast(builder, arguments[0], signature.args[0], duals)
        return builder.extract_element(number, builder.add(arguments[1], _BEHIND_VALUE))

    return types.float64(x, types.intp), generate


@intrinsic
def dual(typing_context, value, direction):  # type: ignore[no-untyped-def]
    """A plain number as a dual: its derivative is 1 in a direction, 0 .. PARTIALS - 1, else 0."""
    if not isinstance(value, types.Number):
        raise TypingError(f"dual({value}, ..): takes a plain number; take the value_of a dual")

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        number = context.cast(builder, arguments[0], value, duals)
        return builder.insert_element(number, _ONE, builder.add(arguments[1], _BEHIND_VALUE))

    return duals(value, types.intp), generate


@intrinsic
def _with_slopes(typing_context, value, slopes, numbers):  # type: ignore[no-untyped-def]
    """The dual of a function's value, given its partial derivatives and its arguments."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        value, slopes, numbers = arguments
        call = Call(context, builder, tuple(signature.args[2]))
        unpacked = (tuple(cgutils.unpack_tuple(builder, each)) for each in (slopes, numbers))
        return _chained(call, value, *unpacked)

    return duals(value, slopes, numbers), generate


@overload(cos_sin, jit_options=INLINED, strict=False)
def _cos_sin(x):  # type: ignore[no-untyped-def]
    # Not through its formula: there a constant rounds, whose derivative vanishes.
    def compiled(x):  # type: ignore[no-untyped-def]
        c, s = cos_sin(value_of(x))
        return _with_slopes(c, (-s,), (x,)), _with_slopes(s, (c,), (x,))

    return compiled if x == duals else None


def _of_one(slope: Any, *functions: Any) -> None:
    """Functions f(x), given ``slope(f, x)``, their derivative."""
    slope = register_jitable(**INLINED)(slope)

    def register(function: Any) -> None:
        def compiled(x):  # type: ignore[no-untyped-def]
            at = value_of(x)
            value = function(at)
            return _with_slopes(value, (slope(value, at),), (x,))

        overload(function, jit_options=INLINED, strict=False)(
            lambda x: compiled if x == duals else None
        )

    for function in functions:
        register(function)


def _of_two(slopes: Any, *functions: Any) -> None:
    """Functions f(x, y), given ``slopes(f, x, y)``, their partial derivatives."""
    slopes = register_jitable(**INLINED)(slopes)

    def register(function: Any) -> None:
        def compiled(x, y):  # type: ignore[no-untyped-def]
            at_x, at_y = value_of(x), value_of(y)
            value = function(at_x, at_y)
            return _with_slopes(value, slopes(value, at_x, at_y), (x, y))

        overload(function, jit_options=INLINED, strict=False)(
            lambda x, y: compiled if kind_among((x, y)) == duals else None
        )

    for function in functions:
        register(function)


_of_one(lambda f, x: 0.5 / f, math.sqrt, np.sqrt)
_of_one(lambda f, x: f, math.exp, np.exp)
_of_one(lambda f, x: 1.0 / x, math.log, np.log)
_of_one(lambda f, x: -cos_sin(x)[1], math.cos, np.cos)
_of_one(lambda f, x: cos_sin(x)[0], math.sin, np.sin)
_of_one(lambda f, x: 1.0 + f * f, math.tan, np.tan)
_of_one(lambda f, x: 1.0 - f * f, math.tanh, np.tanh)
_of_one(lambda f, x: -1.0 / math.sqrt((1.0 - x) * (1.0 + x)), math.acos, np.arccos)
_of_one(lambda f, x: 1.0 / math.sqrt((1.0 - x) * (1.0 + x)), math.asin, np.arcsin)
_of_one(lambda f, x: 1.0 / (1.0 + x * x), math.atan, np.arctan)
_of_two(lambda f, y, x: (x / (x * x + y * y), -y / (x * x + y * y)), math.atan2, np.arctan2)
_of_two(lambda f, x, y: (x / f, y / f), math.hypot, np.hypot)


@overload(operator.pow, jit_options=INLINED, strict=False)
@overload(operator.ipow, jit_options=INLINED, strict=False)
def _power(x, y):  # type: ignore[no-untyped-def]
    # y as it is: a whole number is multiplied out, as for floats.
    def compiled(x, y):  # type: ignore[no-untyped-def]
        base = value_of(x)
        slope = y * base ** (y - 1) if y != 0 else 0.0
        return _with_slopes(base**y, (slope,), (x,))

    return compiled if x == duals and isinstance(y, types.Number) else None
