"""Events, at which a set-valued law (friction, contact, a motor's limit) changes its branch.

These modules are in the subset of Python that ``ab_sim.engine.compiling`` translates. They do not
depend on a scene, whose emitted functions are called by their addresses.

run                functions of a scene, its balls, and the arrays of a run
balls              balls along the race: neighbours, gaps, branches that a scene reads, reactions
event_functions    smooth functions that are positive while a branch holds
rows               balls in contact at one instant: an isotonic regression
impact             collisions of balls
complementarity    branches that hold just after an instant
cubics             cubic interpolation between two instants from values and rates
location           location of events, and steps that are cut at them
"""
