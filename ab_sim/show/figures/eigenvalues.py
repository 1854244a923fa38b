"""Resting states at one speed: eigenvalues, and positions of the balls."""

import math
from typing import Any

import numpy as np

from ab_sim.analysis.equilibria import Equilibria
from ab_sim.show.figures.colours import distinct_colours
from ab_sim.show.figures.saved import ResultFigure

FIRST = ("tab:blue", "tab:orange", "tab:green", "tab:purple", "tab:brown", "tab:cyan")
MARKERS = {True: "o", False: "X", None: "D"}
"""Markers by the linear test's verdict."""


def drawn_states(equilibria: Equilibria) -> ResultFigure:
    """Return a figure of eigenvalues in the complex plane, and ball angles on a circle per state.

    Args:
        equilibria: resting states of one scene at one speed.
    """
    figure = ResultFigure(figsize=(11, 5.6), layout="constrained")
    figure.suptitle(
        f"Resting states of the balls of {equilibria.scene} at {equilibria.speed:g} rad/s"
    )
    plane = figure.add_subplot(1, 2, 1)
    ring = figure.add_subplot(1, 2, 2, projection="polar")
    colours = distinct_colours(len(equilibria.branches), FIRST, avoid=["k"])
    turned = np.linspace(0.0, 2.0 * math.pi, 181)
    for k, (state, colour) in enumerate(zip(equilibria.branches, colours, strict=True)):
        style: dict[str, Any] = {
            "color": colour,
            "marker": MARKERS[state.stable],
            "ls": "",
            "ms": 6,
        }
        values = state.eigenvalues
        plane.plot(values.real, values.imag, label=f"{state.label}: {state.verdict}", **style)
        radius = 1.0 + k
        ring.plot(turned, np.full_like(turned, radius), color=colour, lw=0.6)
        ring.plot(state.theta, np.full(len(state.theta), radius), **style)
    plane.axvline(0.0, color="k", lw=0.8)
    plane.set_xlabel("real part [1/s]; unstable to the right of 0")
    plane.set_ylabel("imaginary part [rad/s]")
    plane.grid(alpha=0.3)
    ring.set_yticks([])
    ring.set_ylim(0.0, 1.0 + len(equilibria.branches))
    ring.set_title("ball angles from the unbalance [deg]", fontsize=10)
    if equilibria.branches:
        figure.legend(loc="outside lower center", ncols=3, fontsize=8)
    return figure
