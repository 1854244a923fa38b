"""Drivers along a speed profile, in the subset of Python of ``ab_sim.engine.compiling``.

fixed_step         one step after the other, cut at events where there are set-valued laws
implicit           one step of an implicit method
side_by_side       steps of eight runs at once, without events
over_events        steps of eight runs at once, with events
emitted            emitted code for eight runs: results of a step, test for possible events
assemble           build a Run from a system and its machine code
"""
