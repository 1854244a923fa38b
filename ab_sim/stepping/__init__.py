"""Drivers along a speed profile, in the subset of Python that ``ab_sim.compiling`` translates.

fixed_step         one step after the other, cut at events where there are set-valued laws
side_by_side       steps of eight runs at once, without events
over_events        the same with events
settle             emitted: what becomes of the results of eight steps
watch              emitted: whether events may be in eight steps
assemble           a Run of a system and its machine code
"""
