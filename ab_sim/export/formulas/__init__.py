"""Print the model's formulas as LaTeX and plain text, derived from the code that computes them.

symbols      symbols of docs/equations.md for the code's names
lines        lines of a traced formula, with named intermediate quantities if they are long
methods      arguments and equation of each method of an effect
effects      formulas of an effect
planar       equations of motion of a deck in the plane
page         generated parts of docs/equations.md
"""
