"""Elementary functions by arithmetic alone, in the subset: the same bits on every machine."""

import math


def modulo(a: float, b: float) -> float:
    """a % b of floats as Python has it: with the sign of b."""
    rest = math.fmod(a, b)
    if rest == 0.0:
        return math.copysign(0.0, b)
    return rest + b if (rest < 0.0) != (b < 0.0) else rest


def floor_divided(a: float, b: float) -> float:
    """a // b of floats as Python has it."""
    rest = math.fmod(a, b)
    quotient = (a - rest) / b
    if rest != 0.0 and (rest < 0.0) != (b < 0.0):
        quotient -= 1.0
    if quotient == 0.0:
        return math.copysign(0.0, a / b)
    down = float(math.floor(quotient)) if abs(quotient) < 4503599627370496.0 else quotient
    return down + 1.0 if quotient - down > 0.5 else down
