"""What is done alike with several numbers, done at once by vector instructions.

The compiler finds out by itself that it may do so, or not, depending on what stands around. Bit for
bit the results are those of one number after the other.
"""

import operator
from typing import Any

from llvmlite import ir
from numba.core import types
from numba.core.imputils import lower_cast
from numba.core.types.containers import UniTuple
from numba.core.types.misc import NoneType
from numba.extending import intrinsic, overload
from numba.np.arrayobj import make_array

from ab_sim.dynamics.dispatch import INLINED, number_of
from ab_sim.dynamics.numbers.cos_sin import cos_sin
from ab_sim.dynamics.numbers.kinds import (
    Call,
    SeveralFloats,
    call_of,
    converted,
    in_all,
    rule,
)
from ab_sim.dynamics.numbers.multiply_add import multiply_add

PAIR, FOUR = SeveralFloats("pair", 2), SeveralFloats("four", 4)


def _give_rules(kind: SeveralFloats) -> None:
    @lower_cast(types.Float, kind)
    @lower_cast(types.Integer, kind)
    def _in_all(context: Any, builder: Any, given: Any, to: Any, value: Any) -> Any:
        return in_all(builder, context.cast(builder, value, given, types.float64), kind.width)

    for instruction, operation in (
        ("fadd", operator.add),
        ("fsub", operator.sub),
        ("fmul", operator.mul),
    ):

        @rule(kind, 2, operation)
        def _arithmetic(call: Call, *numbers: Any, instruction: str = instruction) -> Any:
            return getattr(call.builder, instruction)(*converted(call, kind, numbers))

    @rule(kind, 1, abs)
    def _magnitude(call: Call, x: Any) -> Any:
        return call_of(call.builder, "fabs", x)

    @rule(kind, 3, multiply_add)
    def _fused(call: Call, *numbers: Any) -> Any:
        return call_of(call.builder, "fma", *converted(call, kind, numbers))

    overload(cos_sin, jit_options=INLINED, strict=False)(lambda x: cos_sin if x == kind else None)


for _kind in (PAIR, FOUR):
    _give_rules(_kind)


@intrinsic
def abreast(typing_context, numbers):  # type: ignore[no-untyped-def]
    """A tuple of two or four floats as one number."""
    kind = {2: PAIR, 4: FOUR}[len(numbers)]

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        vector = ir.Constant(kind.vector, ir.Undefined)
        for at in range(kind.width):
            number = builder.extract_value(arguments[0], at)
            vector = builder.insert_element(vector, number, ir.Constant(ir.IntType(32), at))
        return vector

    return kind(numbers), generate


@intrinsic
def apart(typing_context, several):  # type: ignore[no-untyped-def]
    """Such a number as a tuple of floats."""
    floats = UniTuple(types.float64, several.width)

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        parts = [
            builder.extract_element(arguments[0], ir.Constant(ir.IntType(32), at))
            for at in range(several.width)
        ]
        return context.make_tuple(builder, floats, parts)

    return floats(several), generate


@intrinsic
def put(typing_context, several, array, first):  # type: ignore[no-untyped-def]
    """Such a number into consecutive entries of a contiguous array of floats, in one store.

    What is read in one piece soon after has to be written in one piece: else the processor waits
    until it is in its cache. Of fours the compiler may make two stores, of pairs it does not.
    """

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        data = make_array(signature.args[1])(context, builder, value=arguments[1]).data
        place = builder.gep(data, [arguments[2]])
        place = builder.bitcast(place, several.vector.as_pointer())
        builder.store(arguments[0], place, align=8)
        return context.get_dummy_value()

    return types.none(several, array, types.intp), generate


def cosines(angles: Any, first: int, count: Any, table: Any, cos: int, sin: int) -> None:
    """Cosine and sine of each of some angles into two columns of a table.

    Args:
        angles: array of numbers.
        first: where in it the angles begin.
        count: how many, see ``dispatch.number_of``.
        table: array with a line for each.
        cos, sin: which columns.
    """
    for i in range(number_of(count)):
        table[i, cos], table[i, sin] = cos_sin(angles[first + i])


def _of_floats(angles, first, count, table, cos, sin):  # type: ignore[no-untyped-def]
    balls = number_of(count)
    for i in range(0, balls - 3, 4):
        at = first + i
        c, s = cos_sin(abreast((angles[at], angles[at + 1], angles[at + 2], angles[at + 3])))
        table[i, cos], table[i + 1, cos], table[i + 2, cos], table[i + 3, cos] = apart(c)
        table[i, sin], table[i + 1, sin], table[i + 2, sin], table[i + 3, sin] = apart(s)
    i = balls - balls % 4
    if balls % 4 >= 2:
        c, s = cos_sin(abreast((angles[first + i], angles[first + i + 1])))
        table[i, cos], table[i + 1, cos] = apart(c)
        table[i, sin], table[i + 1, sin] = apart(s)
    if balls % 2 == 1:
        i = balls - 1
        table[i, cos], table[i, sin] = cos_sin(angles[first + i])


@overload(cosines, jit_options=INLINED, strict=False)
def _cosines(angles, first, count, table, cos, sin):  # type: ignore[no-untyped-def]
    return _of_floats if angles.dtype == types.float64 else cosines


def stepped(
    weights: Any,
    count: int,
    slopes: Any,
    length: Any,
    state: Any,
    out: Any,
    states: Any,
    several: Any,
) -> None:
    """state + length sum_e weights_e slopes_e, into ``out``; shape (states,).

    Args:
        weights: shape (at least count,).
        count: how many slopes.
        slopes: shape (at least count, at least states).
        length: of the step [s].
        state: shape (at least states,).
        out: not the state.
        states: how many, see ``dispatch.number_of``.
        several: room for as many pairs as there are in so many; or None, for one after the other.
    """
    for j in range(number_of(states)):
        out[j] = 0.0
    for e in range(count):
        if weights[e] != 0.0:
            for j in range(number_of(states)):
                out[j] = multiply_add(weights[e], slopes[e, j], out[j])
    for j in range(number_of(states)):
        out[j] = multiply_add(length, out[j], state[j])


def _by_pairs(weights, count, slopes, length, state, out, states, several):  # type: ignore[no-untyped-def]
    size = number_of(states)
    for b in range(size // 2):
        several[b] = abreast((0.0, 0.0))
    if size % 2 == 1:
        out[size - 1] = 0.0
    for e in range(count):
        if weights[e] != 0.0:
            for b in range(size // 2):
                pair = abreast((slopes[e, 2 * b], slopes[e, 2 * b + 1]))
                several[b] = multiply_add(weights[e], pair, several[b])
            if size % 2 == 1:
                out[size - 1] = multiply_add(weights[e], slopes[e, size - 1], out[size - 1])
    for b in range(size // 2):
        pair = abreast((state[2 * b], state[2 * b + 1]))
        out[2 * b], out[2 * b + 1] = apart(multiply_add(length, several[b], pair))
    if size % 2 == 1:
        out[size - 1] = multiply_add(length, out[size - 1], state[size - 1])


@overload(stepped, jit_options=INLINED, strict=False)
def _stepped(weights, count, slopes, length, state, out, states, several):  # type: ignore[no-untyped-def]
    return stepped if isinstance(several, NoneType) else _by_pairs


def copied(values: Any, out: Any, count: Any) -> None:
    """Copy the first numbers of an array to a contiguous one.

    Args:
        values: shape (at least count,).
        out: the same.
        count: how many, see ``dispatch.number_of``.
    """
    for j in range(number_of(count)):
        out[j] = values[j]


def _floats_copied(values, out, count):  # type: ignore[no-untyped-def]
    size = number_of(count)
    for b in range(size // 2):
        put(abreast((values[2 * b], values[2 * b + 1])), out, 2 * b)
    if size % 2 == 1:
        out[size - 1] = values[size - 1]


@overload(copied, jit_options=INLINED, strict=False)
def _copied(values, out, count):  # type: ignore[no-untyped-def]
    return _floats_copied if values.dtype == types.float64 else copied
