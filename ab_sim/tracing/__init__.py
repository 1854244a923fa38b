"""Trace formulas into expressions, and emit these as machine code, C, LaTeX and Python.

A formula is plain Python on numbers. Called with floats, it computes; called with expressions of a
``Graph``, it records its operations as nodes of that graph. The graph can be differentiated
(``derivatives``), printed (``latex``), and, once ``lowered``, emitted: as machine code for one run
or several in lanes (``llvm_text``), as C (``c_text``) or as Python (``plain``). All emitted forms
give bitwise the same results. ``tests/tracing/test_walk_through.py`` is an example.

Formulas may use ``+ - * /``, whole powers, ``abs``, comparisons, and ``cos``, ``sin``, ``sqrt``,
``where`` and ``total`` of this package. Both branches of a ``where`` are computed. An ``if`` on a
traced number is an error that names its line and shows the expression. An ``if`` on a count, a
choice or the presence of an effect is decided during tracing, and only the branch taken is emitted.
"""

from ab_sim.tracing.derivatives import derivatives
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
