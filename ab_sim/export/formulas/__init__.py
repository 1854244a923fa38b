"""Print the model's formulas as LaTeX and plain text, derived from the code that computes them.

symbols      symbols of docs/equations.md for the code's names
lines        a traced formula as lines, long ones with named intermediate quantities
methods      arguments and equation of each method of an effect
effects      formulas of an effect
planar       equations of motion of a deck in the plane
page         generated parts of docs/equations.md
"""
