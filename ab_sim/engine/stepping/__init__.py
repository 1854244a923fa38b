"""Drivers along a speed profile, in the subset of Python of ``ab_sim.engine.compiling``.

fixed_step         one step after the other, cut at events where there are set-valued laws
implicit           one step of an implicit method
side_by_side       steps of eight runs at once, without events
over_events        steps of eight runs at once, with events
settle             emitted: new states of eight runs from the results of a step
event_test         emitted: test for possible events in the steps of eight runs
assemble           build a Run from a system and its machine code
"""
