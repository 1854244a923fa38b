"""The exponential in lanes, by arithmetic alone: the C library's takes one number at a time."""

from typing import Any

from llvmlite import ir
from numba.extending import intrinsic

from ab_sim.dynamics.numbers.cos_sin import ROUND
from ab_sim.dynamics.numbers.kinds import EIGHT, VECTOR, in_all, lanes
from ab_sim.dynamics.numbers.multiply_add import multiply_add

_LOG2_E = 1.4426950408889634
_LN2_HIGH, _LN2_LOW = 0.6931471803691238, 1.9082149292705877e-10
"""ln 2 in two pieces, the first of 32 bits, whose products with whole numbers are exact."""
_MOST = 700.0


def exp(x: Any) -> Any:
    """e^x to within two roundings, for x within -700 .. 700; beyond, that of the nearest there.

    Source: fdlibm's reduction (Sun Microsystems, 1993), and Taylor's series to the 13th power on
    -ln(2)/2 .. ln(2)/2, where the next term is less than a rounding.
    """
    x = max(-max(-x, -_MOST), -_MOST)
    twos = multiply_add(x, _LOG2_E, ROUND) - ROUND
    r = multiply_add(twos, -_LN2_LOW, multiply_add(twos, -_LN2_HIGH, x))
    e = multiply_add(r, 1.0 / 6227020800.0, 1.0 / 479001600.0)
    e = multiply_add(r, e, 1.0 / 39916800.0)
    e = multiply_add(r, e, 1.0 / 3628800.0)
    e = multiply_add(r, e, 1.0 / 362880.0)
    e = multiply_add(r, e, 1.0 / 40320.0)
    e = multiply_add(r, e, 1.0 / 5040.0)
    e = multiply_add(r, e, 1.0 / 720.0)
    e = multiply_add(r, e, 1.0 / 120.0)
    e = multiply_add(r, e, 1.0 / 24.0)
    e = multiply_add(r, e, 1.0 / 6.0)
    e = multiply_add(r, e, 0.5)
    e = multiply_add(r * r, e, r)
    return (1.0 + e) * _power_of_two(twos)


@intrinsic
def _power_of_two(typing_context, n):  # type: ignore[no-untyped-def]
    """2^n of whole numbers in lanes, within -1022 .. 1023."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        # The sum's lowest bits are n + 1023, which is what the exponent of 2^n is written as.
        words = ir.VectorType(ir.IntType(64), EIGHT)
        offset = in_all(builder, ir.Constant(ir.DoubleType(), ROUND + 1023.0))
        bits = builder.bitcast(builder.fadd(arguments[0], offset), words)
        places = ir.Constant(words, [52] * EIGHT)
        return builder.bitcast(builder.shl(bits, places), VECTOR)

    return lanes(n), generate
