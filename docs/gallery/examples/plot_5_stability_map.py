"""
Which states are stable
=======================

A small map over speed and the damping of the mounts: where balls can balance, and where they
gather on the wrong side. A designer sees how much damping the working speed needs.
"""

import ab_sim

result = ab_sim.stability_map(
    "thesis-hold",
    across=("speed", 50.0, 300.0, 51),
    up=("effects.suspension.damping", 0.1, 4.0, 27),
)
figure = result.plot()
