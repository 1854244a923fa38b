"""
Natural frequencies
===================

Frequencies and damping of a deck in space over spindle speed. Balls balance a motion only above
its critical speed, where its line meets "once per revolution".
"""

import ab_sim

result = ab_sim.modes("couple-unbalance", speed=500.0)
figure = result.plot()

# %%
# The table at 500 rad/s:

result
