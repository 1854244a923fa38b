"""Typed Python functions as machine code: for control, which cannot be traced.

Formulas are run once on expressions (``ab_sim.tracing``). What branches and loops on its numbers,
as drivers of steps and the location of events do, is written in a small subset of Python and
translated from its source and annotations to LLVM's language:

    class Row(NamedTuple):
        x: Floats
        first: int

    def above(row: Row, least: float) -> int:
        for i in range(row.first, row.x.size):
            if row.x[i] > least:
                return i
        return -1

    above(row, 0.5)                     # ordinary Python
    compiled(above)(row, 0.5)           # machine code, made at the first call
    again = compiled(above).bind(row)   # looks at the first argument once
    again(0.5)                          # 0.5 us, without holding up Python's other threads

Modules, in the order in which they build on each other: ``kinds``, ``source``, ``blocks``,
``operations``, ``expressions``, ``conditions``, ``products``, ``intrinsics``, ``translate``,
``library``, ``calling``; and ``elementary``, which is written in the subset.

What there is
-------------
Kinds: float (64 bits), int (64 bits), bool; arrays Floats, Table, Cube (1, 2, 3 axes), Integers,
IntegerTable, all C-contiguous; NamedTuple classes of these and of each other; tuples; None as a
result. Every argument and result is annotated; there are no defaults. A local variable has the kind
of its first assignment, and both values of a choice have that of the first; an int becomes a float
where one is due, never the other way round.

Statements: assignment, to several names and elements at once, too; ``+=`` and the like; if, while,
``for i in range(...)`` with a constant step, ``for x in (a, b, c)``, which is written out for each;
break, continue, return, pass, calls.

Expressions: + - * /; // % << >> & | ^ of ints; comparisons, also in a row; and, or, not;
``a if c else b``; elements ``a[i, j]``; views ``a[i]``, ``a[i:j]``, ``a[i, j:]``; ``a.size``,
``a.shape``; fields; new NamedTuples; global numbers, also of other modules (``math.pi``); calls of
functions of the subset, arguments by place;

    abs min max int float
    math.  sqrt isnan
    kinds. fma put_product float_from_bits scratch call
    elementary. exp expm1 power_of_two
    ab_sim.tracing.cosine. cos_sin

What differs from Python
------------------------
- Nothing is checked while it runs: no bounds of indices (which are not negative), no overflow of
  ints, which wrap. Division by zero is IEEE 754's of floats, and not allowed of ints; so is a shift
  by less than 0 or more than 63.
- int() of what has no 64 bits gives the nearest int, 0 of a NaN; sqrt of less than 0 is a NaN.
- Arrays that records hold can be written to, records cannot change.

All else is the same, digit by digit, NaNs that are compared, in min and in max included: sums of
products are fused only where ``fma`` says so, and no sum is taken in another order. So results have
the same bits on every processor.
"""

from ab_sim.compiling.calling import BoundFunction, Compiled, KeptArray, compiled
from ab_sim.compiling.kinds import (
    Cube,
    Floats,
    Integers,
    IntegerTable,
    Table,
    call,
    float_from_bits,
    fma,
    put_product,
    scratch,
)
from ab_sim.compiling.library import Library
from ab_sim.compiling.source import Untranslatable

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
    "float_from_bits",
    "fma",
    "put_product",
    "scratch",
]
