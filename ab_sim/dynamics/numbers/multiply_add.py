"""Multiply and add, rounded once, where the time goes.

Leaving it to the compiler (`contract`) is as quick, but then two copies of the same formula may
round differently, and a run would depend on how its steps are grouped. (Runs side by side, which
promise no bits, leave it to the compiler all the same: see lanes.py.)
"""

from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic, overload

from ab_sim.dynamics.dispatch import INLINED


def multiply_add(x: Any, y: Any, z: Any) -> Any:
    """x y + z, in compiled code rounded once."""
    return x * y + z


@intrinsic
def _fused(typing_context, x, y, z):  # type: ignore[no-untyped-def]
    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        number = context.get_value_type(signature.return_type)
        # llvmlite's own way to declare it knows no vectors.
        name = "llvm.fma." + (f"v{number.count}f64" if isinstance(number, ir.VectorType) else "f64")
        kinds = ir.FunctionType(number, [number] * 3)
        fma = cgutils.get_or_insert_function(builder.module, kinds, name)
        return builder.call(
            fma,
            [
                context.cast(builder, value, kind, signature.return_type)
                for value, kind in zip(arguments, signature.args, strict=True)
            ],
        )

    kind = next((k for k in (x, y, z) if not isinstance(k, types.Number)), types.float64)
    return kind(x, y, z), generate


@overload(multiply_add, jit_options=INLINED, strict=False)
def _multiply_add(x, y, z):  # type: ignore[no-untyped-def]
    return lambda x, y, z: _fused(x, y, z)
