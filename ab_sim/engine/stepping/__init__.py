"""Drivers along a speed profile, in the subset of Python of ``ab_sim.engine.compiling``.

advance            the loops over steps, for one run and for eight, with any method
plan               ranges of equal steps, and the times of steps and samples
fixed_step         steps of explicit methods, cut at events where there are set-valued laws
implicit           steps of an implicit method
side_by_side       steps of eight runs at once, without events
over_events        steps of eight runs at once, with events
emitted            emitted code for eight runs: results of a step, test for possible events
assemble           build a Run from a system and its machine code
"""
