"""A number for each of eight runs side by side: the same formulas, eight results at once.

Compiled code that is given lanes where it otherwise has floats becomes vector instructions,
each doing the arithmetic of all lanes; nothing has to be written twice, and no compiler has to
find out by itself that it may do so. Lanes take arithmetic, abs, max, roots, cosine and sine;
what chooses a branch by a number cannot be done side by side, as the lanes would part. What is not
a float is the same in all lanes, and may choose.
"""

import math
import operator
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import types
from numba.core.imputils import lower_cast
from numba.extending import intrinsic, overload

from ab_sim.dynamics.dispatch import INLINED
from ab_sim.dynamics.numbers.cos_sin import cos_sin
from ab_sim.dynamics.numbers.exponential import exp
from ab_sim.dynamics.numbers.kinds import (
    EIGHT,
    Call,
    call_of,
    converted,
    in_all,
    lanes,
    rule,
    viewed_as,
)
from ab_sim.dynamics.numbers.multiply_add import multiply_add
from ab_sim.dynamics.numbers.tables import leaves, pattern, spread

__all__ = ["LANES", "as_lanes", "leaves", "pattern", "spread", "where_less"]

LANES = EIGHT

as_lanes = viewed_as(lanes, aligned=True)
"""An array of floats whose last axis is that of the lanes, as an array of lanes.

It must be C-contiguous and begin at a multiple of 64 bytes: see ``integrate.workspace.aligned``.
"""


@lower_cast(types.Float, lanes)
@lower_cast(types.Integer, lanes)
def _in_all_lanes(context: Any, builder: Any, kind: Any, to: Any, value: Any) -> Any:
    return in_all(builder, context.cast(builder, value, kind, types.float64))


def _arithmetic(instruction: str, *operations: Any) -> None:
    @rule(lanes, 2, *operations)
    def generate(call: Call, *numbers: Any) -> Any:
        vectors = converted(call, lanes, numbers)
        return getattr(call.builder, instruction)(*vectors, flags=["contract", "nsz"])


_arithmetic("fadd", operator.add, operator.iadd)
_arithmetic("fsub", operator.sub, operator.isub)
_arithmetic("fmul", operator.mul, operator.imul)
_arithmetic("fdiv", operator.truediv, operator.itruediv)


@rule(lanes, 1, operator.neg)
def _negative(call: Call, x: Any) -> Any:
    return call.builder.fneg(x)


@rule(lanes, 1, abs)
def _magnitude(call: Call, x: Any) -> Any:
    return call_of(call.builder, "fabs", x)


@rule(lanes, 1, math.sqrt)
def _root(call: Call, x: Any) -> Any:
    return call_of(call.builder, "sqrt", x)


@rule(lanes, 2, max)
def _larger(call: Call, *numbers: Any) -> Any:
    x, y = converted(call, lanes, numbers)
    return call.builder.select(call.builder.fcmp_ordered(">", y, x), y, x)


@rule(lanes, 3, multiply_add)
def _fused(call: Call, *numbers: Any) -> Any:
    return call_of(call.builder, "fma", *converted(call, lanes, numbers))


def _by_arithmetic(body: Any, *functions: Any) -> None:
    """What functions of one number are in lanes: made of what lanes have."""
    for function in functions:
        overload(function, jit_options=INLINED, strict=False)(
            lambda x: body if x == lanes else None
        )


_by_arithmetic(cos_sin, cos_sin)
_by_arithmetic(exp, math.exp, np.exp)
_by_arithmetic(lambda x: cos_sin(x)[0], math.cos, np.cos)
_by_arithmetic(lambda x: cos_sin(x)[1], math.sin, np.sin)


@intrinsic
def zero_in_lanes(typing_context):  # type: ignore[no-untyped-def]
    """A zero that the compiler knows as such: to add it costs nothing."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        return in_all(builder, ir.Constant(ir.DoubleType(), 0.0))

    return lanes(), generate


@intrinsic
def where_less(typing_context, x, y, yes, no):  # type: ignore[no-untyped-def]
    """In each lane ``yes`` where x < y, else ``no``; so also where one of them is not a number."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        call = Call(context, builder, signature.args)
        x, y, yes, no = converted(call, lanes, arguments)
        return builder.select(builder.fcmp_ordered("<", x, y), yes, no)

    return lanes(x, y, yes, no), generate
