"""
Which balls, in which drag?
===========================

A sweep over the balls' mass and their drag. Where drag is small and balls are heavy they circulate:
they stall at the critical speed and go round the race. The best runs lie along a band.
"""

import ab_sim

scene = ab_sim.load_scene("balanced-start-up")
result = ab_sim.sweep(
    scene,
    {"balls.mass": "0.5 g..3 g:16", "effects.viscous_drag.coefficient": "log:0.1..10:16"},
    ["final_whirl_over_e", "peak_whirl_over_e"],
)
figure = result.plot()
