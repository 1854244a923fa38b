"""Picture of a recovery over drag: settling time, also over lambda_Rmax, amplitude and index."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from ab_sim.analysis.recovery import Recovery, RecoveryOverDrag, composite_of
from ab_sim.show.figures.saved import ResultFigure, save

COLOURS = ("tab:blue", "tab:orange")
"""Colours of the scene, and of one ball in place of its balls."""


def recovery_figure(recoveries: RecoveryOverDrag, path: Path) -> None:
    """Draw settling time, amplitude and composite index over drag, and write them to a file.

    Args:
        recoveries: recoveries of a scene over the drag.
        path: file to write; its ending sets the format (png, svg, pdf).
    """
    save(drawn_recovery(recoveries), path, 110)


def drawn_recovery(recoveries: RecoveryOverDrag) -> ResultFigure:
    """Return the figure of ``recovery_figure`` without writing it; arguments as there."""
    figure = ResultFigure(figsize=(9, 7), layout="constrained")
    figure.suptitle(
        f"{recoveries.scene}: recovery from {recoveries.from_speed:g} to "
        f"{recoveries.to_speed:g} rad/s",
        fontsize=13,
    )
    (times, amplitudes), (index, against) = figure.subplots(2, 2)
    several = "1 ball" if recoveries.balls == 1 else f"{recoveries.balls} balls"
    ways: list[tuple[str, Sequence[Recovery]]] = [(several, recoveries.over)]
    if recoveries.one_ball is not None:
        ways.append(("1 ball of their mass", recoveries.one_ball[1:]))
    for (name, runs), colour in zip(ways, COLOURS, strict=False):
        style = {"color": colour, "marker": "o", "ms": 4, "label": name}
        settling = _numbers([run.settling_time for run in runs])
        times.plot(recoveries.drags, settling, **style)
        amplitudes.plot(recoveries.drags, [1e3 * run.maximum_amplitude for run in runs], **style)
        if (
            runs is recoveries.over
        ):  # The report says that it does not compare drives with each other.
            against.plot(_numbers([run.lambda_max for run in runs]), settling, **style)
        composite = composite_of(runs)
        if composite is not None:
            values = _numbers(composite.index)
            index.plot(recoveries.drags, values, **style)
            best = recoveries.drags[composite.best]
            index.plot(best, values[composite.best], "*", color=colour, mec="k", ms=14, zorder=4)
    _name(times, "drag of the race [N s/m]", "settling time [s]")
    _name(amplitudes, "drag of the race [N s/m]", "maximum amplitude [mm]")
    _name(index, "drag of the race [N s/m]", "composite index [s], least: *")
    _name(against, "lambda_Rmax [1/s]", "settling time [s]")
    for axes in (times, amplitudes, index):
        axes.set_xlim(left=0.0)
    times.legend(fontsize=9)
    return figure


def _numbers(values: Sequence[float | None]) -> np.ndarray:
    """Return numbers with NaN, which is not drawn, for None."""
    return np.array(values, float)


def _name(axes: Axes, x: str, y: str) -> None:
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(alpha=0.3)
    axes.set_ylim(bottom=0.0)
