"""Picture of an identification: measured and fitted signals, residuals, and intervals."""

import numpy as np
from matplotlib.axes import Axes

from ab_sim.identification.result import Identification, RecordingFit, shown_unit
from ab_sim.show.figures.colours import GREY, RUN, VERMILION
from ab_sim.show.figures.saved import ResultFigure

MEASURED, FITTED, RESIDUAL = GREY, RUN, VERMILION
WORST = 1.0
"""Largest relative half-width of an interval that is drawn."""


def drawn_identification(identification: Identification) -> ResultFigure:
    """Return the figure of an identification without writing it."""
    rows = len(identification.comparisons)
    heights = [1.6, 0.8] * rows + [0.4 + 0.25 * len(_shares(identification))]
    figure = ResultFigure(figsize=(10, 1.2 + 1.3 * sum(heights)), layout="constrained")
    panels = figure.subplots(len(heights), 1, height_ratios=heights, squeeze=False).ravel()
    figure.suptitle(f"{identification.before.name}: {identification.verdict}", fontsize=13)
    for k, comparison in enumerate(identification.comparisons):
        _compare(panels[2 * k], panels[2 * k + 1], comparison)
    _intervals(panels[-1], identification)
    return figure


def _compare(above: Axes, below: Axes, recording_fit: RecordingFit) -> None:
    measured = recording_fit.measured
    unit, scale = shown_unit(measured.unit)
    time = measured.time
    above.plot(time, scale * measured.signals[:, 0], color=MEASURED, lw=1.6, label="measured")
    above.plot(time, scale * recording_fit.simulated[:, 0], color=FITTED, lw=0.7, label="fitted")
    above.set_ylabel(f"{measured.kind} [{unit}]", fontsize=9)
    suffix = ", held out" if recording_fit.held_out else ""
    above.set_title(f"{measured.name}{suffix}, first axis", fontsize=10, loc="left")
    # Above the axes, where there are no curves.
    above.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, fontsize=8, frameon=False)
    below.plot(time, scale * recording_fit.residuals[:, 0], color=RESIDUAL, lw=0.6)
    below.set_ylabel(f"residual [{unit}]", fontsize=9)
    below.set_xlabel("time [s]", fontsize=9)
    for axes in (above, below):
        axes.set_xlim(0.0, time[-1])
        axes.grid(alpha=0.3)


def _shares(identification: Identification) -> list[tuple[str, float, float]]:
    """Return the name and the relative interval ends of each parameter of the scene."""
    return [
        (estimate.name, estimate.low / estimate.value - 1.0, estimate.high / estimate.value - 1.0)
        for estimate in identification.estimates
        if not estimate.own and estimate.value and np.isfinite([estimate.low, estimate.high]).all()
    ]


def _intervals(axes: Axes, identification: Identification) -> None:
    rows = _shares(identification)
    for place, (_, low, high) in enumerate(rows):
        axes.plot([100 * low, 100 * high], [place, place], color=RESIDUAL, lw=3)
    axes.set_yticks(range(len(rows)), [name for name, _, _ in rows], fontsize=8)
    axes.set_ylim(-0.7, len(rows) - 0.3)
    axes.invert_yaxis()
    axes.axvline(0.0, color=MEASURED, lw=1)
    axes.set_xlabel("95 % interval relative to the value [%]", fontsize=9)
    axes.grid(alpha=0.3, axis="x")
