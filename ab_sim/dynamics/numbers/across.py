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


CHAINS = 4
"""Sums of a product's terms that are made side by side: each term waits for the one before."""


def _sum_of_terms(builder: Any, data: Any, first: Any, x: Any, onto: Any) -> Any:
    """M x, M's columns lying from ``first`` on, and what it is added to, if anything."""
    sums: list[Any] = [onto] + [None] * (CHAINS - 1)
    data = _asked_for_with(builder, data, x)
    for k in range(EIGHT):
        column = builder.load(builder.gep(data, [builder.add(first, first.type(k))]), align=BYTES)
        each, chain = in_all(builder, _at(builder, x, k)), k % CHAINS
        if sums[chain] is None:
            sums[chain] = builder.fmul(column, each)
        else:
            sums[chain] = call_of(builder, "fma", column, each, sums[chain])
    while len(sums) > 1:
        half = len(sums) // 2
        sums = [builder.fadd(sums[i], sums[i + half]) for i in range(half)]
    return sums[0]


def _asked_for_with(builder: Any, data: Any, x: Any) -> Any:
    """The pointer, but as one that is only known when x is.

    What is read through it in a loop is the same in each round. The compiler would read it before
    the loop, has far too few registers to keep it, and so copies a table to read the copy instead.
    """
    x = _at(builder, x, 0)
    kind = ir.FunctionType(data.type, [data.type, x.type])
    return builder.call(ir.InlineAsm(kind, "", "=r,0,X"), [data, x], attrs=["readnone", "nounwind"])


def _check(lines: Any, first: Any, *numbers: Any) -> None:
    sound = isinstance(lines, types.Array) and lines.dtype == lanes
    if not (sound and all(number == lanes for number in numbers)):
        raise TypingError(f"{lines}, {first}, {numbers}: has to be an array of lanes, and lanes")


@intrinsic
def product(typing_context, lines, first, x):  # type: ignore[no-untyped-def]
    """M x, M's columns being eight lines of an array of lanes from ``first`` on."""
    _check(lines, first, x)

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        data = make_array(signature.args[0])(context, builder, value=arguments[0]).data
        return _sum_of_terms(builder, data, arguments[1], arguments[2], None)

    return lanes(lines, types.intp, x), generate


@intrinsic
def product_onto(typing_context, lines, first, x, onto):  # type: ignore[no-untyped-def]
    """M x + ``onto``, M as of ``product``."""
    _check(lines, first, x, onto)

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        data = make_array(signature.args[0])(context, builder, value=arguments[0]).data
        return _sum_of_terms(builder, data, *arguments[1:])

    return lanes(lines, types.intp, x, onto), generate


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
