"""Compile typed Python functions to machine code, for control flow that cannot be traced.

Formulas are traced: they run once on expressions (``ab_sim.tracing``). Functions that branch and
loop on their numbers, such as drivers of steps and the location of events, are written in a small
subset of Python. It is translated from source and annotations to LLVM IR:

    class Row(NamedTuple):
        x: Floats
        first: int

    def above(row: Row, least: float) -> int:
        for i in range(row.first, row.x.size):
            if row.x[i] > least:
                return i
        return -1

    above(row, 0.5)                     # ordinary Python
    compiled(above)(row, 0.5)           # machine code, compiled at the first call
    again = compiled(above).bind(row)   # unpacks the first argument once
    again(0.5)                          # 0.5 us, with the interpreter's lock released

Modules, each building on those before it: ``kinds``, ``source``, ``blocks``, ``expressions``,
``intrinsics``, ``translate``, ``library``, ``calling``.

A function whose first argument is annotated with a Protocol is compiled once for each class of
records that it is called with. So one loop serves several methods, with direct calls of them.

The subset
----------
Kinds: float (64 bits), int (64 bits), bool; arrays Floats, Table, Cube (1, 2, 3 axes), Integers,
IntegerTable, all C-contiguous; NamedTuple classes of these and of each other; tuples; None as a
result. Every result and every argument except ``self`` is annotated; there are no defaults. A local
variable has the kind of its first assignment, and both values of a conditional expression have the
kind of the first. An int is converted to float where a float is required, never the other way
round.

Statements: assignment, also to several names and elements at once; augmented assignment (``+=``);
if, while, ``for i in range(...)`` with a constant step, ``for x in (a, b, c)``, which is unrolled;
break, continue, return, pass, calls.

Expressions: + - * /; // % of ints; comparisons, also chained; and, or, not;
``a if c else b``; elements ``a[i, j]``; views ``a[i]``, ``a[i:j]``, ``a[i, j:]``; ``a.size``,
``a.shape``; fields; new NamedTuples; global numbers, also of other modules (``math.pi``); calls
with positional arguments of functions of the subset, of records' methods, and of

    abs min max int float
    math.  sqrt isnan
    kinds. fma scratch call
    ab_sim.tracing.functions. cos_sin

Differences from Python
-----------------------
- There are no checks at run time. Indices must be within bounds and not negative. Ints wrap on
  overflow. Division by zero follows IEEE 754 for floats and is not allowed for ints.
- int() of a float beyond 64 bits gives the nearest int, and 0 for a NaN; sqrt of a negative number
  is a NaN.
- Arrays in records can be written to; records themselves cannot change.

All other results equal Python's bit by bit, including comparisons, min and max of NaNs. Products
are fused with sums only by ``fma``, and no sum is reordered. So results are bitwise the same on
every processor.
"""

from ab_sim.engine.compiling.calling import BoundFunction, Compiled, KeptArray, compiled
from ab_sim.engine.compiling.kinds import (
    Cube,
    Floats,
    Integers,
    IntegerTable,
    Table,
    call,
    fma,
    scratch,
)
from ab_sim.engine.compiling.library import Library
from ab_sim.engine.compiling.source import Untranslatable

__all__ = [
    "BoundFunction",
    "Compiled",
    "Cube",
    "Floats",
    "IntegerTable",
    "Integers",
    "KeptArray",
    "Library",
    "Table",
    "Untranslatable",
    "call",
    "compiled",
    "fma",
    "scratch",
]
