"""Typed Python functions translated to machine code: for what formulas (ab_sim.tracing) are not."""

from ab_sim.compiling.calling import Bound, Compiled, compiled
from ab_sim.compiling.kinds import (
    Cube,
    Floats,
    Integers,
    IntegerTable,
    Table,
    call,
    float_from_bits,
    fma,
    scratch,
)
from ab_sim.compiling.source import Untranslatable

__all__ = [
    "Bound",
    "Compiled",
    "Cube",
    "Floats",
    "IntegerTable",
    "Integers",
    "Table",
    "Untranslatable",
    "call",
    "compiled",
    "float_from_bits",
    "fma",
    "scratch",
]
