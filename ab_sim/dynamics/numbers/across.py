"""What mixes the lanes of a number: matrices times it, its sum, and columns of tables as lanes.

Where the lanes are not eight runs but eight instants of one: see integrate.steppers.collocation.
Sums are fused and in a fixed order, so that the same numbers give the same bits.
"""

from typing import Any

from llvmlite import ir
from numba.core import types
from numba.core.errors import TypingError
from numba.extending import intrinsic, overload
from numba.np.arrayobj import make_array

from ab_sim.dynamics.dispatch import INLINED
from ab_sim.dynamics.numbers.kinds import BYTES, EIGHT, VECTOR, call_of, in_all, lanes


def _at(builder: Any, vector: Any, lane: int) -> Any:
    return builder.extract_element(vector, ir.Constant(ir.IntType(32), lane))


@intrinsic
def product(typing_context, lines, first, x):  # type: ignore[no-untyped-def]
    """M x, M's columns being eight lines of an array of lanes from ``first`` on."""
    if not (isinstance(lines, types.Array) and lines.dtype == lanes and x == lanes):
        raise TypingError(f"product({lines}, {first}, {x}): takes an array of lanes, and lanes")

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        data = make_array(signature.args[0])(context, builder, value=arguments[0]).data
        halves = [None, None]
        for k in range(EIGHT):
            place = builder.add(arguments[1], context.get_constant(types.intp, k))
            column = builder.load(builder.gep(data, [place]), align=BYTES)
            each = in_all(builder, _at(builder, arguments[2], k))
            # Two chains, which wait for each other less than one.
            half = halves[k % 2]
            if half is None:
                halves[k % 2] = builder.fmul(column, each)
            else:
                halves[k % 2] = call_of(builder, "fma", column, each, half)
        return builder.fadd(*halves)

    return lanes(lines, types.intp, x), generate


@intrinsic
def total(typing_context, x):  # type: ignore[no-untyped-def]
    """The sum of all lanes."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        parts = [_at(builder, arguments[0], lane) for lane in range(EIGHT)]
        while len(parts) > 1:
            half = len(parts) // 2
            parts = [builder.fadd(parts[i], parts[i + half]) for i in range(half)]
        return parts[0]

    return types.float64(lanes), generate


def whole(x: Any) -> Any:
    """A whole number that is the same in all lanes, or is a plain number or a dual, as an index."""
    return int(x)


@overload(whole, jit_options=INLINED, strict=False)
def _whole(x):  # type: ignore[no-untyped-def]
    return (lambda x: int(_first(x))) if x == lanes else (lambda x: int(x))


@intrinsic
def _first(typing_context, x):  # type: ignore[no-untyped-def]
    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        return _at(builder, arguments[0], 0)

    return types.float64(lanes), generate


def _entries(context: Any, builder: Any, kind: Any, table: Any, column: Any) -> list[Any]:
    """Pointers to the first eight entries of a column."""
    array = make_array(kind)(context, builder, value=table)
    width = builder.extract_value(array.shape, 1)
    return [
        builder.gep(
            array.data,
            [builder.add(builder.mul(context.get_constant(types.intp, row), width), column)],
        )
        for row in range(EIGHT)
    ]


@intrinsic
def column_of(typing_context, table, column):  # type: ignore[no-untyped-def]
    """The first eight entries of a column of a table of floats, as lanes."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        vector = ir.Constant(VECTOR, ir.Undefined)
        places = _entries(context, builder, signature.args[0], *arguments)
        for lane, place in enumerate(places):
            number = builder.load(place)
            vector = builder.insert_element(vector, number, ir.Constant(ir.IntType(32), lane))
        return vector

    return lanes(table, types.intp), generate


@intrinsic
def put_column(typing_context, x, table, column):  # type: ignore[no-untyped-def]
    """Lanes into the first eight entries of a column of a table of floats."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        places = _entries(context, builder, signature.args[1], *arguments[1:])
        for lane, place in enumerate(places):
            builder.store(_at(builder, arguments[0], lane), place)
        return context.get_dummy_value()

    return types.none(lanes, table, types.intp), generate
