"""Emit LLVM code for the length of a Taylor step, from its last two coefficients.

The length is the largest at which both terms are within the tolerance: Jorba and Zou (2005), Exp.
Math. 14, 99-117, 3.2. Logarithms and powers are accurate to a few thousandths, which is enough for
a length, and give the same bits on every machine, in lanes or not.
"""

from ab_sim.tracing.llvm_text import Function, kind, literal

SHORTEST, LONGEST = -60.0, 10.0
"""Base-2 logarithms of the shortest and longest length [s]."""
_FRACTION, _ONE = 0xFFFFFFFFFFFFF, 0x3FF0000000000000
"""Bit mask of a double's fraction, and the bits of 1.0."""


def step_length(into: Function, aim: str, squares: dict[int, str]) -> str:
    """Emit the length of a step [s] and return its name.

    Args:
        into: function to extend.
        aim: name of the tolerance's base-2 logarithm.
        squares: names of the squared norms of coefficients, by order.
    """
    lanes = into.shape.lanes
    of, logarithms = kind(lanes), []
    # |coefficient| length^order = tolerance, solved for the length in logarithms.
    for order, square in squares.items():
        half = literal(-0.5, lanes)
        missing = into.call("fma", lanes, half, _log2(into, square), aim)
        logarithms.append(into.put(f"fmul {of} {missing}, {literal(1.0 / order, lanes)}"))
    least = logarithms[0]
    for logarithm in logarithms[1:]:
        least = _less(into, logarithm, least)
    return _exp2(into, least)


def _log2(into: Function, x: str) -> str:
    """Emit the base-2 logarithm of a number that is not negative; for 0 it is about -1023."""
    lanes = into.shape.lanes
    of, bits_of = kind(lanes), kind(lanes, "i64")
    bits = into.put(f"bitcast {of} {x} to {bits_of}")
    exponent = into.put(f"lshr {bits_of} {bits}, {_whole(52, lanes)}")
    exponent = into.put(f"sub {bits_of} {exponent}, {_whole(1023, lanes)}")
    exponent = into.put(f"sitofp {bits_of} {exponent} to {of}")
    fraction = into.put(f"and {bits_of} {bits}, {_whole(_FRACTION, lanes)}")
    fraction = into.put(f"or {bits_of} {fraction}, {_whole(_ONE, lanes)}")
    fraction = into.put(f"bitcast {bits_of} {fraction} to {of}")
    return into.put(
        f"fadd {of} {exponent}, {_quadratic(into, fraction, -0.33582878, 2.0, -1.65871022)}"
    )


def _exp2(into: Function, x: str) -> str:
    """Emit 2 to the power x, with x limited to SHORTEST .. LONGEST; for NaN to LONGEST."""
    lanes = into.shape.lanes
    of, bits_of = kind(lanes), kind(lanes, "i64")
    x = _less(into, x, literal(LONGEST, lanes))
    above = into.put(f"fcmp ogt {of} {x}, {literal(SHORTEST, lanes)}")
    x = _chosen(into, above, x, literal(SHORTEST, lanes))
    whole = into.call("floor", lanes, x)
    rest = into.put(f"fsub {of} {x}, {whole}")
    power = into.put(f"fptosi {of} {whole} to {bits_of}")
    power = into.put(f"add {bits_of} {power}, {_whole(1023, lanes)}")
    power = into.put(f"shl {bits_of} {power}, {_whole(52, lanes)}")
    power = into.put(f"bitcast {bits_of} {power} to {of}")
    return into.put(f"fmul {of} {power}, {_quadratic(into, rest, 0.33977, 0.65723, 1.00249)}")


def _quadratic(into: Function, x: str, a: float, b: float, c: float) -> str:
    lanes = into.shape.lanes
    slope = into.call("fma", lanes, literal(a, lanes), x, literal(b, lanes))
    return into.call("fma", lanes, slope, x, literal(c, lanes))


def _less(into: Function, a: str, b: str) -> str:
    lanes = into.shape.lanes
    return _chosen(into, into.put(f"fcmp olt {kind(lanes)} {a}, {b}"), a, b)


def _chosen(into: Function, which: str, a: str, b: str) -> str:
    lanes = into.shape.lanes
    of = kind(lanes)
    return into.put(f"select {kind(lanes, 'i1')} {which}, {of} {a}, {of} {b}")


def _whole(value: int, lanes: int) -> str:
    return f"splat (i64 {value})" if lanes > 1 else str(value)
