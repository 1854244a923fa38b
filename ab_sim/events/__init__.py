"""Events: where a set-valued law of friction, contact or a motor's limit takes another branch.

All of it is in the subset of Python that ``ab_sim.compiling`` translates, and depends on no scene:
what a scene says is called at addresses.

run                a scene's functions, its balls, and the arrays to work with
balls              balls along the race: neighbours, gaps, and the branches that a scene reads
reactions          forces that the equations of motion leave out
event_functions    smooth functions that are positive while a branch holds
rows               balls in contact at one instant: an isotonic regression
impact             balls that hit each other
complementarity    the branches that hold just after an instant
cubics             functions between two instants, by their values and rates there
location           steps that are cut at events
"""
