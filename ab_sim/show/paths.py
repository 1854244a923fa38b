"""Pictures of samples without a scene: panels of one trajectory, or the whirl of many runs."""

import numpy as np
from matplotlib import colormaps

from ab_sim.base.errors import InputError
from ab_sim.design.batch import Batch
from ab_sim.drive.trajectory import Trajectory
from ab_sim.show.curves import draw_curve, in_degrees, write_conventions
from ab_sim.show.saved import ResultFigure
from ab_sim.show.styles import RUN, ball_styles

_MOST_NAMED = 10
"""Largest number of runs of a batch that a legend names."""


def drawn_trajectory(path: Trajectory) -> ResultFigure:
    """Return a figure of speed, whirl and ball angles over time, without knowledge of the scene.

    Parameters
    ----------
    path
        Consecutive samples from any part of a run.
    """
    channels = {*path.channels}
    panels = {
        "speed [rad/s]": path["speed"] if "speed" in channels else None,
        "whirl W [m]": path.whirl if {"x", "y"} <= channels else None,
        "ball angles [deg],\nfrom the unbalance": in_degrees(path.ball_angles)
        if path.balls
        else None,
    }
    there = {name: values for name, values in panels.items() if values is not None}
    figure = ResultFigure(figsize=(9, 1.2 + 2.2 * max(1, len(there))), layout="constrained")
    axes = figure.subplots(max(1, len(there)), 1, sharex=True, squeeze=False)[:, 0]
    for panel, (name, values) in zip(axes, there.items(), strict=False):
        if values.ndim == 1:
            draw_curve(panel, path["time"], values, color=RUN, lw=1.3)
        else:
            for ball, style in enumerate(ball_styles(path.balls)):
                draw_curve(panel, path["time"], values[:, ball], **style)
        panel.set_ylabel(name)
        panel.grid(alpha=0.3)
    axes[-1].set_xlabel("time [s]")
    figure.align_ylabels(axes)
    write_conventions(figure)
    return figure


def drawn_batch(batch: Batch) -> ResultFigure:
    """Return a figure of the whirl of every run over time, coloured in order.

    Parameters
    ----------
    batch
        Batch of at least one run.

    Raises
    ------
    InputError
        The batch has metrics only.
    """
    if not batch.runs:
        raise InputError(
            "batch: has no samples to be drawn, only metrics; run it with samples=True"
        )
    figure = ResultFigure(figsize=(9, 5), layout="constrained")
    axes = figure.subplots()
    shades = colormaps["viridis"](np.linspace(0.0, 0.9, len(batch.runs)))
    for number, (run, shade) in enumerate(zip(batch.runs, shades, strict=True)):
        path = run.trajectory
        if not len(path):
            continue
        name = _name(batch, number) + (", diverged" if run.failure else "")
        axes.plot(path["time"], path.whirl, color=shade, lw=1.0, label=name)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("whirl W [m]")
    axes.set_title(f"{batch.runs[0].scene.name}: {len(batch.runs)} runs", fontsize=13)
    axes.grid(alpha=0.3)
    if len(batch.runs) <= _MOST_NAMED:
        figure.legend(loc="outside right upper", fontsize=8)
    write_conventions(figure)
    return figure


def _name(batch: Batch, number: int) -> str:
    """Return the name of a run in the legend: the values that vary, or its number."""
    varied = batch.variations[number] if batch.variations else {}
    return ", ".join(f"{key} = {value}" for key, value in varied.items()) or f"run {number}"
