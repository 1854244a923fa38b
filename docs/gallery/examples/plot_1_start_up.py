"""
A start-up
==========

A drive runs up through its critical speed, holds its speed there for half a second, and is
compared with the same drive without that hold and without balls. The whirl at the end, beside
that without balls, says whether the balls help.
"""

import ab_sim

scene = ab_sim.load_scene("balanced-start-up")
run = ab_sim.simulate(scene)
figure = run.plot(ab_sim.compare_run(run))

# %%
# The main numbers of the run:

run
