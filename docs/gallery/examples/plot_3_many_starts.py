"""
The same start-up from many starts
==================================

Where balls lie when a drive is switched on is chance. 200 runs from random start angles show how
much the final whirl owes to it. With the hold just above the critical speed nearly all end better.
"""

import matplotlib.pyplot as plt
import numpy as np

import ab_sim

hold = ab_sim.load_scene("balanced-start-up")
plain = ab_sim.load_scene("balanced-start-up", ["profile.variable_speed_period=null"])
angles = np.random.default_rng(1).uniform(-np.pi, np.pi, (200, 2))
starts = [{"start.ball_angles": pair.tolist()} for pair in angles]

figure, axes = plt.subplots(figsize=(6.4, 3.6), layout="constrained")
for scene, label in ((hold, "with the hold"), (plain, "without")):
    runs = ab_sim.simulate_batch(scene, starts, every=50).runs
    whirls = [run.trajectory.whirl[-10:].mean() / scene.rotor.eccentricity for run in runs]
    axes.hist(whirls, bins=np.linspace(0, 2, 41), alpha=0.6, label=label)
axes.set(xlabel="W/e at the end", ylabel="runs of 200")
axes.legend()
