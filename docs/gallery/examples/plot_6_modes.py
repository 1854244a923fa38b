"""
Natural frequencies
===================

Frequencies and damping of a deck in space over spindle speed. Balls balance a motion only above
its critical speed, where its line meets "once per revolution".
"""

import ab_sim

found = ab_sim.modes("couple-unbalance", speed=500.0)
figure = found.plot()

# %%
# The table at 500 rad/s:

found
