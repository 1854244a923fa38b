"""
What a step costs in accuracy
=============================

The error of the balls' angles over the step, for three methods, against a run with a much shorter
step. The steeper a line, the more a shorter step gains; a scene may also name the accuracy it
wants and leave the method to ab_sim.
"""

import matplotlib.pyplot as plt
import numpy as np

import ab_sim

SCENE = ["duration=1", "start.ball_angles=[2.0, 4.0]"]


def last_angles(stepper: str, step: float) -> np.ndarray:
    """Where the balls are in the end [rad]."""
    changes = [*SCENE, f"solver.stepper={stepper}", f"solver.step={step}"]
    return ab_sim.simulate(ab_sim.load_scene("nsc-case-1", changes)).trajectory.ball_angles[-1]


right = last_angles("rk8", 1e-4)
steps = np.array([2e-3, 1e-3, 5e-4, 2.5e-4, 2e-4])
figure, axes = plt.subplots(figsize=(6.4, 3.6), layout="constrained")
for stepper in ("rk4", "tsit5", "rk8"):
    errors = [np.abs(last_angles(stepper, float(step)) - right).max() for step in steps]
    axes.loglog(1e3 * steps, np.maximum(errors, 1e-16), "o-", label=stepper)
axes.set_xticks(1e3 * steps, [f"{1e3 * step:g}" for step in steps])
axes.minorticks_off()
axes.set(xlabel="step [ms]", ylabel="largest error of an angle [rad]")
axes.legend()
