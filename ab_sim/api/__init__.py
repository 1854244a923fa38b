"""Calls behind the names of ``ab_sim`` that need an interface of their own.

Users import them from ``ab_sim``; the content of this package may change.
"""
