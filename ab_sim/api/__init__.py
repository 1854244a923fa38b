"""The calls behind the names of ``ab_sim`` that had no function of that shape of their own.

Users take them from ``ab_sim`` itself: what is here, and where, may change.
"""
