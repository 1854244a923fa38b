"""The balls' equations and laws as plain Python: what is compiled, before numba has seen it.

A kernel takes half a minute to compile, so few scenes can be tried, and never a change of one line.
Python runs the same functions at once: against dense matrices and against the reference, at random
states that runs seldom meet. ``test_uncompiled.py`` starts a Python for it, because numba leaves
functions alone only from the very first import on.
"""
