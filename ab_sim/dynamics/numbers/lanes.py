"""A number for each of eight runs side by side: the same formulas, eight results at once.

Compiled code that is given lanes where it otherwise has floats becomes vector instructions,
each doing the arithmetic of all lanes; nothing has to be written twice, and no compiler has to
find out by itself that it may do so. Lanes take arithmetic, abs, cosine and sine; what chooses a
branch by a number cannot be done side by side, as the lanes would part. What is not a float is the
same in all lanes, and may choose.
"""

import math
import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.imputils import lower_builtin, lower_cast
from numba.core.typeconv import Conversion
from numba.core.types.containers import BaseNamedTuple, BaseTuple
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import intrinsic, models, overload, register_model
from numba.np.arrayobj import make_array, populate_array

from ab_sim.dynamics.dispatch import INLINED
from ab_sim.dynamics.numbers.cos_sin import cos_sin

LANES = 8


class LanesType(types.Type):
    """Numba's type of such a number."""

    def __init__(self) -> None:
        super().__init__("lanes")

    def can_convert_from(self, typing_context: Any, other: Any) -> Any:
        """A plain number is the same in all lanes."""
        return Conversion.safe if isinstance(other, types.Number) else None

    def unify(self, typing_context: Any, other: Any) -> Any:
        """What a variable is that is sometimes a plain number."""
        return self if isinstance(other, types.Number) else None


lanes = LanesType()
_VECTOR = ir.VectorType(ir.DoubleType(), LANES)
_BYTES = 8 * LANES


@register_model(LanesType)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)


@lower_cast(types.Float, LanesType)
@lower_cast(types.Integer, LanesType)
def _in_all_lanes(context: Any, builder: Any, kind: Any, to: Any, value: Any) -> Any:
    number = context.cast(builder, value, kind, types.float64)
    first = ir.Constant(ir.IntType(32), 0)
    one = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), number, first)
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
    return builder.shuffle_vector(one, ir.Constant(_VECTOR, ir.Undefined), zeros)


def _arithmetic(operation: Any, instruction: str) -> None:
    @infer_global(operation)
    class _Typing(ConcreteTemplate):  # type: ignore[misc]
        cases = [signature(lanes, lanes, lanes)]

    @lower_builtin(operation, lanes, lanes)
    def _lower(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return getattr(builder, instruction)(*arguments, flags=["contract"])


for _operation, _inplace, _instruction in (
    (operator.add, operator.iadd, "fadd"),
    (operator.sub, operator.isub, "fsub"),
    (operator.mul, operator.imul, "fmul"),
    (operator.truediv, operator.itruediv, "fdiv"),
):
    _arithmetic(_operation, _instruction)
    _arithmetic(_inplace, _instruction)


def _of_one(operation: Any, generate: Callable[[Any, Any], Any]) -> None:
    @infer_global(operation)
    class _Typing(ConcreteTemplate):  # type: ignore[misc]
        cases = [signature(lanes, lanes)]

    @lower_builtin(operation, lanes)
    def _lower(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return generate(builder, arguments[0])


def _fabs(builder: Any, value: Any) -> Any:
    kinds = ir.FunctionType(_VECTOR, [_VECTOR])
    fabs = cgutils.get_or_insert_function(builder.module, kinds, f"llvm.fabs.v{LANES}f64")
    return builder.call(fabs, [value])


_of_one(operator.neg, lambda builder, value: builder.fneg(value))
_of_one(abs, _fabs)


def _cosine(x):  # type: ignore[no-untyped-def]
    return (lambda x: cos_sin(x)[0]) if isinstance(x, LanesType) else None


def _sine(x):  # type: ignore[no-untyped-def]
    return (lambda x: cos_sin(x)[1]) if isinstance(x, LanesType) else None


for _function, _resolve in (
    (math.cos, _cosine),
    (np.cos, _cosine),
    (math.sin, _sine),
    (np.sin, _sine),
):
    overload(_function, jit_options=INLINED, strict=False)(_resolve)


@intrinsic
def where_less(typing_context, x, y, yes, no):  # type: ignore[no-untyped-def]
    """In each lane ``yes`` where x < y, else ``no``; so also where one of them is not a number."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        x, y, yes, no = (
            context.cast(builder, value, kind, lanes)
            for value, kind in zip(arguments, signature.args, strict=True)
        )
        return builder.select(builder.fcmp_ordered("<", x, y), yes, no)

    return lanes(x, y, yes, no), generate


@intrinsic
def as_lanes(typing_context, array):  # type: ignore[no-untyped-def]
    """An array of floats whose last axis is that of the lanes, as an array of lanes.

    Its memory must be aligned to 64 bytes: see ``integrate.workspace.aligned``.
    """
    kind = types.Array(lanes, array.ndim - 1, "C")

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        source = make_array(signature.args[0])(context, builder, value=arguments[0])
        result = make_array(kind)(context, builder)
        populate_array(
            result,
            data=builder.bitcast(source.data, _VECTOR.as_pointer()),
            shape=cgutils.unpack_tuple(builder, source.shape)[:-1],
            strides=cgutils.unpack_tuple(builder, source.strides)[:-1],
            itemsize=context.get_constant(types.intp, _BYTES),
            meminfo=None,
        )
        return result._getvalue()

    return kind(array), generate


@intrinsic
def spread(typing_context, pattern, table):  # type: ignore[no-untyped-def]
    """A nested tuple like ``pattern`` with lanes for its floats.

    Args:
        pattern: its values are of no account.
        table: array of lanes, shape (floats in the pattern,): see ``leaves``.
    """

    def wide(kind: Any) -> Any:
        if isinstance(kind, BaseNamedTuple):
            return BaseTuple.from_types([wide(k) for k in kind.types], kind.instance_class)
        if isinstance(kind, BaseTuple):
            return BaseTuple.from_types([wide(k) for k in kind.types])
        return lanes if isinstance(kind, types.Float) else kind

    result = wide(pattern)

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        entries = make_array(signature.args[1])(context, builder, value=arguments[1])
        place = 0

        def fill(kind: Any, value: Any) -> Any:
            nonlocal place
            if isinstance(kind, BaseTuple):
                parts = [
                    fill(part, builder.extract_value(value, i)) for i, part in enumerate(kind.types)
                ]
                return context.make_tuple(builder, wide(kind), parts)
            if not isinstance(kind, types.Float):
                return value
            at = builder.gep(entries.data, [context.get_constant(types.intp, place)])
            place += 1
            return builder.load(at, align=_BYTES)

        return fill(signature.args[0], arguments[0])

    return result(pattern, table), generate


def leaves(values: Any) -> list[float]:
    """The floats of nested tuples, in the order in which ``spread`` reads them."""
    if isinstance(values, tuple):
        return [leaf for value in values for leaf in leaves(value)]
    return [values] if isinstance(values, float) else []


def pattern(values: Any) -> Any:
    """What of nested tuples is the same in all lanes: their kinds, and all that is not a float."""
    if isinstance(values, tuple):
        return type(values), *map(pattern, values)
    return float if isinstance(values, float) else (type(values), values)
