"""Formulas traced: run once on expressions, and written out as machine code, C, LaTeX and Python.

A formula is plain Python on numbers. Run on floats, it computes; run on expressions of a
``Graph``, it leaves behind what it is made of. That can be differentiated (``derivatives``),
printed (``latex``), and, once ``lowered``, emitted: for one run or several in lanes
(``llvm_text``), as C (``c_text``) or Python (``plain``). All of these have the same bits.
"""

from ab_sim.tracing.derivative import derivatives
from ab_sim.tracing.expression import Expression, Graph, Level
from ab_sim.tracing.functions import cos, sin, sqrt, total, where
from ab_sim.tracing.lowering import lowered

__all__ = [
    "Expression",
    "Graph",
    "Level",
    "cos",
    "derivatives",
    "lowered",
    "sin",
    "sqrt",
    "total",
    "where",
]
