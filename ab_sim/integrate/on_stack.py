"""Arrays of a known size on the stack of a kernel that is compiled for a number of balls.

The compiler keeps in registers what it can see whole: an array that the caller owns it has to
write and read back, because another one might be the same memory.
"""

from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.types.containers import NamedTuple
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
"""Where a stepper keeps the state of a stage, shape (states,); ``(system, work)``.

On the stack it lasts as long as the function that asks for it."""
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
    return _room(system, work, n)


@intrinsic
def stage_room_of(typing_context, system, work):  # type: ignore[no-untyped-def]
    """A Room of which nobody but a step looks at more than the table.

    The rest is on the stack whether or not the number of balls is known; as ``trial_of``.
    """
    return _room(system, work, ball_number(system))


def _room(system: Any, work: Any, n: int | None) -> Any:
    """Signature and generator of a Room with as many lines of its table on the stack, or none."""
    owned, every = part_of(work, "room"), effect_class(part_of(system, "carrier")).UNKNOWNS + 1
    shapes: dict[str, tuple[tuple[int, ...], str]] = {
        "block": ((every, every + 1), "C"),
        "reduced": ((every, every + 1), "C"),
        "acceleration": ((every,), "C"),
        "motor": ((3,), "C"),
    }
    if n is not None:
        # By columns: what is known of neighbouring balls then lies side by side.
        shapes["table"] = (n, table_width(every)), "F"
    kinds = [
        part_of(owned, name).copy(layout=shapes[name][1])
        if name in shapes
        else part_of(owned, name)
        for name in Room._fields
    ]
    room = NamedTuple(kinds, Room)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        caller = builder.extract_value(arguments[1], work.fields.index("room"))
        arrays = [
            _on_stack(context, builder, kind, shapes[name][0])
            if name in shapes
            else builder.extract_value(caller, at)
            for at, (name, kind) in enumerate(zip(Room._fields, kinds, strict=True))
        ]
        return context.make_tuple(builder, room, arrays)

    return room(system, work), generate


def _on_stack(context: Any, builder: Any, kind: Any, shape: tuple[int, ...]) -> Any:
    number, whole = context.get_value_type(kind.dtype), context.get_value_type(types.intp)
    item = context.get_abi_sizeof(number)
    strides, size = [], 1
    for length in reversed(shape) if kind.layout == "C" else shape:
        strides.append(size)
        size *= length
    if kind.layout == "C":
        strides.reverse()
    room = cgutils.alloca_once(builder, ir.ArrayType(number, max(1, size)))
    room.align = ALIGNMENT
    array = make_array(kind)(context, builder)
    populate_array(
        array,
        data=builder.bitcast(room, number.as_pointer()),
        shape=[whole(length) for length in shape],
        strides=[whole(item * stride) for stride in strides],
        itemsize=whole(item),
        meminfo=None,
    )
    return array._getvalue()
