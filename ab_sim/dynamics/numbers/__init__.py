"""The kinds of number that the formulas run with, and one rule per operation and kind.

A formula is written once; compiled code that is given lanes or duals where it otherwise has floats
runs the same formula with these. A kind's file has all its rules:

    float     numba's own; ``multiply_add`` and ``cos_sin`` beyond these
    lanes     eight runs side by side (lanes.py): what has no branch
    duals     a value and its derivatives (duals.py): branches go by the value

Kinds do not mix: what would give a lane to a dual does not compile. A plain number is either.
"""
