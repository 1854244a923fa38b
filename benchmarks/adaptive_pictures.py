"""Pictures of docs/adaptive.md."""

from pathlib import Path
from typing import Any

import numpy as np
from adaptive_page import LIMITS, NAMES
from matplotlib.figure import Figure

from ab_sim.control import State
from ab_sim.design.statistics import share_of
from ab_sim.show.styles import BLUE, GREEN, GREY, ORANGE, VERMILION


def demo_picture(shown: dict[str, Any], path: Path) -> None:
    """Draw the readings, estimates and commands of the demo."""
    rows = np.array(shown["rows"])
    rows = rows[rows[:, 0] <= min(2.0 + shown["decisions"][-1][0], rows[-1, 0])]
    time, speed, critical, deviation, net, uncertain, true, whirl, state = rows.T
    figure = Figure(figsize=(9.0, 7.2), layout="constrained")
    above, middle, below = figure.subplots(3, sharex=True)
    for axes in (above, middle, below):
        dwelling = state == State.DWELL
        axes.fill_between(
            time, 0, 1, where=dwelling, transform=axes.get_xaxis_transform(), color=ORANGE,
            alpha=0.25, lw=0, label="dwell",
        )  # fmt: skip
        axes.grid(alpha=0.3)
    above.plot(time, speed, color=BLUE, label="spindle's speed")
    above.plot(time, critical, color=VERMILION, label="critical speed, believed, +- 2 deviations")
    above.fill_between(
        time, critical - 2 * deviation, critical + 2 * deviation, color=VERMILION, alpha=0.25, lw=0
    )
    above.set(ylabel="rad/s", ylim=(0, 260))
    above.legend(loc="lower right")
    middle.plot(time, 1e6 * true, color=GREY, lw=2.5, label="net unbalance, true")
    middle.plot(time, 1e6 * net, color=GREEN, lw=1.0, label="believed, +- 2 deviations")
    middle.fill_between(
        time, 1e6 * (net - 2 * uncertain), 1e6 * (net + 2 * uncertain), color=GREEN, alpha=0.2, lw=0
    )
    middle.set(ylabel="um", ylim=(0, 1.5e6 * float(true.max())))
    middle.legend(loc="upper right")
    below.plot(time, 1e6 * whirl, color=BLUE, label="whirl, largest of 5 ms")
    below.set(ylabel="um", xlabel="s", ylim=(0, None))
    below.legend(loc="upper right")
    for when, text in shown["decisions"]:
        above.axvline(when, color=GREY, lw=0.7, ls=":")
        word = text.partition(":")[0]
        above.text(when, 212, f"{word} ", rotation=90, fontsize=8, va="top", color="0.25")
    figure.savefig(path, dpi=110)


def strategies_picture(report: dict[str, Any], path: Path) -> None:
    """Draw the shares of the strategies with their intervals."""
    figure = Figure(figsize=(8.6, 3.9), layout="constrained")
    axes = figure.subplots()
    names = list(NAMES)[::-1]
    for offset, limit, colour in ((0.14, LIMITS[0], BLUE), (-0.14, LIMITS[1], VERMILION)):
        for place, name in enumerate(names):
            residual = np.array([row[0] for row in report["outcomes"][name]])
            share = share_of(residual < limit)
            reach = [[share.value - share.low], [share.high - share.value]]
            axes.errorbar(
                share.value, place + offset, xerr=reach, fmt="o", color=colour, capsize=3,
                label=f"whirl below {limit:g} of that without balls" if not place else None,
            )  # fmt: skip
    axes.set_yticks(range(len(names)), [NAMES[n].replace("*", "").replace("`", "") for n in names])
    axes.set(xlabel=f"share of {report['drives']} random drives, 95 % intervals", xlim=(0, 1.02))
    axes.grid(alpha=0.3)
    axes.legend(loc="lower left")
    figure.savefig(path, dpi=110)
