"""Implementations of names of ``ab_sim`` whose interface differs from the code behind them.

Users import them from ``ab_sim``; the content of this package may change.
"""
