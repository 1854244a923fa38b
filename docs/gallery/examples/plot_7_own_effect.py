"""
An effect of your own
=====================

A damper that gets stiffer with speed is added in a few lines, which become machine code like the
effects that are there. It takes much from the peak at the critical speed and little from the rest.
"""

from typing import Any, NamedTuple

import matplotlib.pyplot as plt

import ab_sim
from ab_sim.tracing import sqrt


@ab_sim.register_effect("square_damper", equation="f = -d |v| v", source="this page")
class SquareDamper(NamedTuple):
    """A damper whose force grows with the square of the speed."""

    coefficient: float

    def deck_force(self, deck: Any) -> tuple[Any, Any]:
        """Force on the deck [N]."""
        speed = sqrt(deck.vx**2 + deck.vy**2 + 1e-12)
        return -self.coefficient * speed * deck.vx, -self.coefficient * speed * deck.vy


figure, axes = plt.subplots(figsize=(6.4, 3.6), layout="constrained")
for d in (0.0, 0.5, 2.0):
    change = f"effects.square_damper.coefficient={d}"
    run = ab_sim.simulate(ab_sim.load_scene("thesis-baseline", [change, "duration=5"]))
    axes.plot(run.trajectory["time"], 1e3 * run.trajectory.whirl, label=f"d = {d} N s²/m²")
axes.set(xlabel="time [s]", ylabel="W [mm]")
axes.legend()
