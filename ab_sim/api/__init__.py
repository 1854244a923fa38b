"""Public functions of ``ab_sim`` that adapt the interface of internal code.

Users import them from ``ab_sim``; the content of this package may change.
"""
