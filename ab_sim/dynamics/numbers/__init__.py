"""The kinds of number that the formulas run with, and one rule per operation and kind."""
