"""Figure 4: the change of the spindle's speed."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ab_sim.model.spindle import SpeedSchedule
from gallery.page import PageSection
from gallery.relative_stability.cases import Tell, cases, written


def speed_section(folder: Path, tell: Tell) -> PageSection:
    """The raised cosine as the scenes have it."""
    tell("figure 4", 0, 1)
    profile = SpeedSchedule.of_scene(cases()[0].scene)
    begin, end = profile.breakpoints
    times = np.linspace(begin - 0.1, end + 0.1, 1001)
    figure = Figure(figsize=(7, 3), layout="constrained")
    axes = figure.subplots()
    axes.plot(times, [profile.speed(time) for time in times], color="tab:blue")
    for time in (begin, end):
        axes.axvline(time, color="0.6", lw=0.8, ls=":")
    axes.set_xlabel("time [s]")
    axes.set_ylabel("spindle speed [rad/s]")
    axes.grid(alpha=0.3)
    caption = (
        f"from {profile.speed(begin):g} to {profile.speed(end):g} rad/s "
        f"along half a cosine from {begin:g} to {end:g} s"
    )
    picture = written(figure, folder, 4, caption)
    text = (
        "Slip: (25) as printed oscillates for ever. It holds on [t_b, t_b + t_r] only: the "
        "speed drops once, from 1000 to 900 rad/s within 0.11 s (section 5.1).",
    )
    return PageSection("The change of speed: figure 4", text, (), (picture,))
