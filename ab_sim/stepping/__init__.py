"""Drivers along a speed profile, in the subset of Python that ``ab_sim.compiling`` translates.

fixed_step         one step after the other, cut at events where there are set-valued laws
assemble           a Run of a system and its machine code
"""
