"""Arrays of a known size on the stack of a kernel that is compiled for a number of balls.

The compiler keeps in registers what it can see whole: an array that the caller owns it has to
write and read back, because another one might be the same memory.
"""

from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic, overload
from numba.np.arrayobj import make_array, populate_array

from ab_sim.dynamics.dispatch import INLINED
from ab_sim.dynamics.scratch import WIDTH
from ab_sim.dynamics.system import System, ball_number

ALIGNMENT = 64


def _sizes(system: Any) -> tuple[int, int] | None:
    """Balls and states, where the types say how many."""
    n = ball_number(system)
    if n is None:
        return None
    ledger = system.types[system.fields.index("ledger")]
    return n, 4 + 2 * n + 2 * len(ledger)


def state_size(system: System, state: Any) -> int:
    """Number of states, a constant where the kernel is compiled for a number of balls."""
    return len(state)


@overload(state_size, jit_options=INLINED, strict=False)
def _state_size(system, state):  # type: ignore[no-untyped-def]
    sizes = _sizes(system)
    if sizes is None:
        return lambda system, state: state.size
    states = sizes[1]
    return lambda system, state: states


@intrinsic
def trial_of(typing_context, system, work):  # type: ignore[no-untyped-def]
    """Where a stepper keeps the state of a stage, shape (states,); ``(system, work)``.

    On the stack it lasts as long as the function that asks for it.
    """
    sizes = _sizes(system)
    return _array(system, work, "trial", None if sizes is None else (sizes[1],))


@intrinsic
def scratch_of(typing_context, system, work):  # type: ignore[no-untyped-def]
    """Scratch of the right-hand side, shape (balls, WIDTH); as ``trial_of``."""
    sizes = _sizes(system)
    if sizes is None:
        return _array(system, work, "scratch", None)
    # By columns: what is known of neighbouring balls then lies side by side.
    return _array(system, work, "scratch", (sizes[0], WIDTH), "F")


def _array(
    system: Any, work: Any, field: str, shape: tuple[int, ...] | None, layout: str = "C"
) -> Any:
    place = work.fields.index(field)
    kind = work.types[place].copy(layout=layout)

    def owned_by_caller(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.extract_value(arguments[1], place)

    def on_stack(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        assert shape is not None
        number, whole = context.get_value_type(kind.dtype), context.get_value_type(types.intp)
        item = context.get_abi_sizeof(number)
        strides, size = [], 1
        for length in reversed(shape) if layout == "C" else shape:
            strides.append(size)
            size *= length
        if layout == "C":
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

    return kind(system, work), owned_by_caller if shape is None else on_stack
