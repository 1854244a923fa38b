"""Multiply and add, rounded once, where the time goes.

Leaving it to the compiler (`contract`) is as quick, but then two copies of the same formula may
round differently, and a run would depend on how its steps are grouped. (Runs side by side, which
promise no bits, leave it to the compiler all the same: see lanes.py.)
"""

from typing import Any

from numba.core import types
from numba.extending import intrinsic, overload

from ab_sim.dynamics.dispatch import INLINED
from ab_sim.dynamics.numbers.kinds import call_of


def multiply_add(x: Any, y: Any, z: Any) -> Any:
    """x y + z, in compiled code rounded once."""
    return x * y + z


@intrinsic
def _fused(typing_context, x, y, z):  # type: ignore[no-untyped-def]
    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        numbers = (
            context.cast(builder, value, kind, types.float64)
            for value, kind in zip(arguments, signature.args, strict=True)
        )
        return call_of(builder, "fma", *numbers)

    return types.float64(x, y, z), generate


@overload(multiply_add, jit_options=INLINED, strict=False)
def _multiply_add(x, y, z):  # type: ignore[no-untyped-def]
    if all(isinstance(kind, types.Number) for kind in (x, y, z)):
        return lambda x, y, z: _fused(x, y, z)
    return None
