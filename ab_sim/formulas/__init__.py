"""The model's formulas in print, made from the code that computes: LaTeX and plain text.

symbols      how docs/equations.md writes what the code calls otherwise
lines        a traced formula as lines, long ones with named intermediate quantities
methods      what each method of an effect stands for
effects      an effect's formulas
planar       the equations of motion of a deck in the plane
page         the parts of docs/equations.md that are made from these
"""
