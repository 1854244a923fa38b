"""
Where balls can rest
====================

All states in which deck and balls rest on the rotor, over speed; stable ones are solid. Where the
background is grey nothing is stable: a hold there does not help.
"""

import numpy as np

import ab_sim

result = ab_sim.branches("thesis-hold", speeds=np.linspace(60, 200, 71))
figure = result.plot()

# %%
# The speeds without a stable state:

for low, high in result.over_speed.without_stable_state:
    print(f"{low:.1f} to {high:.1f} rad/s")
