"""Print the model's formulas as LaTeX and plain text, derived from the code that computes them.

lines        symbols of docs/equations.md, and lines of a traced formula
effects      arguments, equation and formulas of each method of an effect
planar       equations of motion of a deck in the plane
page         generated parts of docs/equations.md
"""
