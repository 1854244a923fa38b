"""Arrays on the stack of a kernel, for as long as the function runs that asks for them.

Where a kernel is compiled for a number of balls, their sizes are known: the compiler keeps in
registers what it can see whole. An array that the caller owns it has to write and read back,
because another one might be the same memory.
"""

from collections.abc import Sequence
from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.types.containers import BaseTuple, NamedTuple, Tuple
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array

from ab_sim.dynamics.dispatch import effect_class, part_of
from ab_sim.dynamics.layout import states_in
from ab_sim.dynamics.numbers.abreast import PAIR
from ab_sim.dynamics.race.table import table_width
from ab_sim.dynamics.system import Room, ball_number

ALIGNMENT = 64


def _states_of(field: str) -> Any:
    @intrinsic
    def array_of(typing_context, system, work):  # type: ignore[no-untyped-def]
        size, kind = states_in(system), part_of(work, field)

        def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
            if size is None:
                return builder.extract_value(arguments[1], work.fields.index(field))
            return _on_stack(context, builder, kind, (size,))

        return kind(system, work), generate

    return array_of


trial_of = _states_of("trial")
"""Where a stepper keeps the state of a stage, shape (states,); ``(system, work)``."""
rates_of = _states_of("ahead")
"""Where it keeps the slope there; as ``trial_of``."""


@intrinsic
def pairs_of(typing_context, system, work):  # type: ignore[no-untyped-def]
    """Room for as many pairs as there are in a state, or None if that is not known or no floats."""
    size, kind = states_in(system), part_of(work, "trial")
    if size is None or kind.dtype != types.float64:
        return types.none(system, work), lambda context, *_: context.get_dummy_value()
    pairs = types.Array(PAIR, 1, "C")

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        return _on_stack(context, builder, pairs, (max(1, size // 2),))

    return pairs(system, work), generate


@intrinsic
def room_of(typing_context, system, work):  # type: ignore[no-untyped-def]
    """The Room of the evaluation at hand; as ``trial_of``."""
    owned, n = part_of(work, "room"), ball_number(system)
    if n is None:

        def owned_by_caller(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
            return builder.extract_value(arguments[1], work.fields.index("room"))

        return owned(system, work), owned_by_caller

    kind, shapes = _room(system, part_of(owned, "acceleration").dtype, n)

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        return _room_on_stack(context, builder, kind, shapes)

    return kind(system, work), generate


@intrinsic
def stage_room_of(typing_context, system, work):  # type: ignore[no-untyped-def]
    """A Room of which nobody but a step looks at more than the table.

    The rest is on the stack whether or not the number of balls is known.
    """
    owned, n = part_of(work, "room"), ball_number(system)
    kind, shapes = _room(system, part_of(owned, "acceleration").dtype, n)
    if n is None:
        kind = NamedTuple([part_of(owned, "table"), *kind.types[1:]], Room)

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        if n is not None:
            return _room_on_stack(context, builder, kind, shapes)
        caller = builder.extract_value(arguments[1], work.fields.index("room"))
        arrays = [
            _on_stack(context, builder, array, shape)
            for array, shape in zip(kind.types[1:], shapes[1:], strict=True)
        ]
        return context.make_tuple(builder, kind, [builder.extract_value(caller, 0), *arrays])

    return kind(system, work), generate


@intrinsic
def own_room(typing_context, system, balls, number):  # type: ignore[no-untyped-def]
    """A Room for numbers of the kind of ``number``; ``(system, how many balls, number)``."""
    kind, _ = _room(system, number, 0)

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        n = ball_number(system)
        shapes = _room(system, number, arguments[1] if n is None else n)[1]
        return _room_on_stack(context, builder, kind, shapes)

    return kind(system, types.intp, number), generate


@intrinsic
def own_array(typing_context, number, shape):  # type: ignore[no-untyped-def]
    """An array of numbers of the kind of ``number``; ``(number, shape)``, a tuple.

    Its content is arbitrary. To ask in a loop is to ask for ever more memory, but for a shape of
    lengths that are tuples: see ``dispatch.number_of``.
    """
    kind = types.Array(number, len(shape), "C")
    known = [isinstance(length, BaseTuple) for length in shape]
    lengths = Tuple([a if b else types.intp for a, b in zip(shape, known, strict=True)])

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        sizes = [
            len(length) if isinstance(length, BaseTuple) else builder.extract_value(arguments[1], i)
            for i, length in enumerate(lengths)
        ]
        return _on_stack(context, builder, kind, sizes)

    return kind(number, lengths), generate


def _room(system: Any, number: Any, balls: Any) -> tuple[Any, list[tuple[Any, ...]]]:
    """Numba's type of a Room on the stack, and the shapes of its arrays."""
    every = effect_class(part_of(system, "carrier")).UNKNOWNS + 1
    shapes: dict[str, tuple[Any, ...]] = {
        "table": (balls, table_width(every)),
        "block": (every, every + 1),
        "reduced": (every, every + 1),
        "acceleration": (every,),
        "motor": (3,),
    }
    # By columns: what is known of neighbouring balls then lies side by side.
    kinds = [
        types.Array(number, len(shapes[name]), "F" if name == "table" else "C")
        for name in Room._fields
    ]
    return NamedTuple(kinds, Room), [shapes[name] for name in Room._fields]


def _room_on_stack(context: Any, builder: Any, room: Any, shapes: list[tuple[Any, ...]]) -> Any:
    arrays = [
        _on_stack(context, builder, kind, shape)
        for kind, shape in zip(room.types, shapes, strict=True)
    ]
    return context.make_tuple(builder, room, arrays)


def _on_stack(context: Any, builder: Any, kind: Any, shape: Sequence[Any]) -> Any:
    """An array whose sizes are numbers, or values of the code that is made."""
    number, whole = context.get_value_type(kind.dtype), context.get_value_type(types.intp)
    item = context.get_abi_sizeof(number)

    def value(size: Any) -> Any:
        return whole(size) if isinstance(size, int) else size

    strides, size = [], item
    for length in reversed(shape) if kind.layout == "C" else shape:
        strides.append(value(size))
        known = isinstance(size, int) and isinstance(length, int)
        size = size * length if known else builder.mul(value(size), value(length))
    if kind.layout == "C":
        strides.reverse()
    if isinstance(size, int):
        room = cgutils.alloca_once(builder, ir.ArrayType(number, max(1, size // item)))
    else:
        room = builder.alloca(ir.IntType(8), size)
    room.align = ALIGNMENT
    array = make_array(kind)(context, builder)
    populate_array(
        array,
        data=builder.bitcast(room, number.as_pointer()),
        shape=[value(length) for length in shape],
        strides=strides,
        itemsize=whole(item),
        meminfo=None,
    )
    return array._getvalue()
