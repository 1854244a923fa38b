"""
How heavy must balls be?
========================

One start-up for each mass of a ball, all in one batch. Balls that are too light leave a part of
the unbalance; from the dashed line on, two balls can cancel all of it.
"""

import matplotlib.pyplot as plt
import numpy as np

import ab_sim

scene = ab_sim.load_scene("balanced-start-up", ["effects.rolling_friction.arm=1e-6"])
masses = np.linspace(2e-4, 10e-4, 33)
batch = ab_sim.simulate_batch(scene, [{"balls.mass": float(mass)} for mass in masses], every=10)
final = [np.sqrt(np.mean(run.trajectory.whirl[-100:] ** 2)) for run in batch.runs]

M, e, R = scene.rotor.total_mass, scene.rotor.eccentricity, scene.race.radius
enough = M * e / (2 * (R + e))  # 2 m R = M0 e, and M0 is M less the balls

figure, axes = plt.subplots(figsize=(6.4, 3.6), layout="constrained")
axes.plot(1e3 * masses, np.array(final) / e, "o-")
axes.axvline(1e3 * enough, color="grey", linestyle="--")
axes.set(xlabel="mass of a ball [g]", ylabel="W/e at the end", ylim=(0, None))
