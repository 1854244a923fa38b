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
from ab_sim.dynamics.race.table import table_width
from ab_sim.dynamics.system import Room, ball_number

ALIGNMENT = 64


@intrinsic
def trial_of(typing_context, system, work):  # type: ignore[no-untyped-def]
    """Where a stepper keeps the state of a stage, shape (states,); ``(system, work)``.

    On the stack it lasts as long as the function that asks for it.
    """
    size, kind = states_in(system), part_of(work, "trial")

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        if size is None:
            return builder.extract_value(arguments[1], work.fields.index("trial"))
        return _on_stack(context, builder, kind, (size,))

    return kind(system, work), generate


@intrinsic
def room_of(typing_context, system, work):  # type: ignore[no-untyped-def]
    """The Room of the evaluation at hand; as ``trial_of``."""
    owned, n = part_of(work, "room"), ball_number(system)
    if n is None:

        def owned_by_caller(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
            return builder.extract_value(arguments[1], work.fields.index("room"))

        return owned(system, work), owned_by_caller

    every = effect_class(part_of(system, "carrier")).UNKNOWNS + 1
    # By columns: what is known of neighbouring balls then lies side by side.
    shapes = {
        "table": ((n, table_width(every)), "F"),
        "block": ((every, every + 1), "C"),
        "reduced": ((every, every + 1), "C"),
        "acceleration": ((every,), "C"),
        "motor": ((3,), "C"),
    }
    kinds = [part_of(owned, name).copy(layout=shapes[name][1]) for name in Room._fields]
    room = NamedTuple(kinds, Room)

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        arrays = [
            _on_stack(context, builder, kind, shapes[name][0])
            for name, kind in zip(Room._fields, kinds, strict=True)
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
