"""Pictures of resting states, natural vibration and recovery."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from ab_sim.analysis.equilibria import Equilibria
from ab_sim.analysis.equilibria.over_speed import BranchInterval, OverSpeed
from ab_sim.analysis.modes import AVERAGING, Mode, NaturalVibration, moving
from ab_sim.analysis.recovery import Recovery, RecoveryOverDrag, composite_of
from ab_sim.scene.model import Scene
from ab_sim.show.curves import write_conventions
from ab_sim.show.labels import Label, label_at_right
from ab_sim.show.saved import ResultFigure
from ab_sim.show.styles import distinct_colours

_STATE_COLOURS = ("tab:blue", "tab:orange", "tab:green", "tab:purple", "tab:brown", "tab:cyan")
_MARKERS = {True: "o", False: "X", None: "D"}
"""Markers by the linear test's verdict."""


def drawn_states(equilibria: Equilibria) -> ResultFigure:
    """Return a figure of eigenvalues in the complex plane, and of ball angles.

    Each resting state has a colour, and its ball angles are on a separate circle.

    Parameters
    ----------
    equilibria
        Resting states of one scene at one speed.
    """
    figure = ResultFigure(figsize=(11, 5.6), layout="constrained")
    figure.suptitle(
        f"Resting states of the balls of {equilibria.scene} at {equilibria.speed:g} rad/s"
    )
    plane = figure.add_subplot(1, 2, 1)
    ring = figure.add_subplot(1, 2, 2, projection="polar")
    colours = distinct_colours(len(equilibria.branches), _STATE_COLOURS, avoid=["k"])
    turned = np.linspace(0.0, 2.0 * math.pi, 181)
    for k, (state, colour) in enumerate(zip(equilibria.branches, colours, strict=True)):
        style: dict[str, Any] = {
            "color": colour,
            "marker": _MARKERS[state.stable],
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


PATTERN_COLOURS = (
    "tab:blue",
    "tab:red",
    "tab:green",
    "tab:purple",
    "tab:brown",
    "tab:cyan",
    "tab:olive",
)
"""Colours of the first patterns; further ones have distinct colours."""
_VERDICT_STYLES: dict[bool | None, dict[str, Any]] = {
    True: {"ls": "-", "lw": 2.2},
    False: {"ls": (0, (4, 2)), "lw": 1.1},
    None: {"ls": ":", "lw": 1.1},
}
"""Line styles by the linear test's verdict."""
_MOST_LABELLED = 12
"""Largest number of patterns that the legend names; it counts the others."""


def drawn_branches(scene: Scene, equilibria: Equilibria, over_speed: OverSpeed) -> ResultFigure:
    """Return the branch diagram: W and ball angles of all branches over the spindle's speed.

    Parameters
    ----------
    scene
        Scene of the branches.
    equilibria
        Resting states at one speed, which is marked.
    over_speed
        Branches of resting states over the speed.
    """
    figure = ResultFigure(figsize=(10, 7.5), layout="constrained")
    figure.suptitle(f"Resting states of the balls of {scene.name}", fontsize=14)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(1.0, 0.9))
    length, symbol = scene.whirl_unit
    names = list(dict.fromkeys(_pattern(interval.label) for interval in over_speed.intervals))
    spread = distinct_colours(len(names), PATTERN_COLOURS, avoid=["k"])
    colours = {
        name: "k" if name == "balanced" else colour
        for name, colour in zip(names, spread, strict=True)
    }
    for interval in over_speed.intervals:
        colour = colours[_pattern(interval.label)]
        _draw_branch(above, interval, colour, lambda state: state.W / length)
        if "worst" not in interval.label and "best" not in interval.label:
            for i in range(len(interval.states[0].theta)):
                _draw_branch(
                    below, interval, colour, lambda s, i=i: math.degrees(s.theta[i]), breaks=True
                )
    for _, fold in over_speed.folds:
        above.plot(fold.speed, fold.W / length, "D", color="w", mec="k", ms=6, zorder=5)
    for crossing in over_speed.crossings:
        above.plot(crossing.speed, crossing.W / length, "o", color="gold", mec="k", ms=7, zorder=5)
    for low, high in over_speed.without_stable_state:
        for axes in (above, below):
            axes.axvspan(low, high, color="0.9", zorder=0)
    for axes in (above, below):
        axes.axvline(equilibria.speed, color="0.5", lw=0.8, ls="-.")
        axes.grid(alpha=0.3)
    sizes = [
        s.W / length for interval in over_speed.intervals for s in interval.states if s.W > 0.0
    ]
    floor = 0.1 * min(1.0, float(np.percentile(sizes, 10))) if sizes else 0.1
    above.set_yscale("symlog", linthresh=max(floor, 1e-6))
    above.set_ylim(bottom=-0.3 * max(floor, 1e-6))
    above.set_ylabel(f"W/{symbol}")
    below.set_ylabel("theta [deg]")
    below.set_ylim(-335, 35)
    below.set_yticks(range(-300, 1, 60))
    below.set_xlabel("spindle speed [rad/s]")
    below.set_xlim(0.0, over_speed.speeds[1])
    figure.legend(handles=_branch_legend(colours), loc="outside right upper", fontsize=8)
    write_conventions(figure)
    return figure


def _pattern(label: str) -> str:
    """Return a branch's label without the numbers of radius and position."""
    return label.split("/")[0].split(",")[0]


def _draw_branch(
    axes: Axes, interval: BranchInterval, colour: str, value: Callable, breaks: bool = False
) -> None:
    """Draw a value of a branch over the speed; the line style shows the stability.

    Parameters
    ----------
    axes
        Axes to draw on.
    interval
        Part of a branch.
    colour
        Colour of the curve.
    value
        Function of a state that returns the drawn number.
    breaks
        Whether to interrupt the curve at jumps of more than 180.
    """
    values = np.array([value(state) for state in interval.states])
    if breaks:
        values[1:][np.abs(np.diff(values)) > 180.0] = np.nan
    verdicts = [state.stable for state in interval.states]
    _draw_sections(axes, interval.speeds, values, verdicts, _VERDICT_STYLES, color=colour)


def _draw_sections(
    axes: Axes,
    x: np.ndarray,
    y: Sequence[float] | np.ndarray,
    kinds: Sequence[object],
    styles: Mapping[Any, dict[str, Any]],
    **style: Any,
) -> None:
    """Draw a curve in sections; ``kinds`` of the points select each section's style."""
    for kind, appearance in styles.items():
        # Each section is extended to the next point, where another may begin.
        here = np.array([kind == one for one in kinds])
        here[1:] |= here[:-1]
        if here.any():
            axes.plot(x, np.where(here, y, np.nan), **appearance, **style)


def _branch_legend(colours: dict[str, str]) -> list[Line2D]:
    """Return legend entries for patterns, by name with the colour, and for marks."""
    items = list(colours.items())
    if len(items) > _MOST_LABELLED:
        items = [item for item in items if item[0] == "balanced"]
        items.append((f"{len(colours) - len(items)} patterns", PATTERN_COLOURS[0]))
    lines = [Line2D([], [], color=colour, lw=2, label=name) for name, colour in items]
    parts = (
        ("stable", {"color": "k", **_VERDICT_STYLES[True]}),
        ("unstable", {"color": "k", **_VERDICT_STYLES[False]}),
        ("undecided", {"color": "k", **_VERDICT_STYLES[None]}),
        ("fold", {"color": "w", "marker": "D", "mec": "k", "ls": ""}),
        ("stability changes", {"color": "gold", "marker": "o", "mec": "k", "ls": ""}),
        ("no stable state", {"color": "0.9", "lw": 8}),
        ("speed of the table", {"color": "0.5", "lw": 0.8, "ls": "-."}),
    )
    return lines + [Line2D([], [], label=name, **style) for name, style in parts]


_SENSE_STYLES: dict[str | None, dict[str, Any]] = {
    "forward": {"color": "tab:red", "ls": "-", "lw": 1.6, "zorder": 2.1},
    "backward": {"color": "tab:blue", "ls": (0, (4, 3)), "lw": 1.6, "zorder": 2.2},
    None: {"color": "0.4", "ls": "-", "lw": 1.6, "zorder": 2.0},
}
"""Styles by the sense of whirl; one is dashed, so that both are visible where they coincide."""
_ONCE: dict[str, Any] = {"color": "tab:green", "ls": ":", "lw": 1.2}
RPM = 30.0 / math.pi


def drawn_campbell(vibration: NaturalVibration) -> ResultFigure:
    """Return the Campbell diagram: frequencies and damping ratios over speed.

    Parameters
    ----------
    vibration
        Natural vibration of a scene over the speed.
    """
    figure = ResultFigure(figsize=(9, 6.5), layout="constrained")
    figure.suptitle(f"Natural frequencies of {vibration.scene}", fontsize=14)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(1.0, 0.4))
    speeds, branches = vibration.over_speed.speeds, vibration.over_speed.branches
    for branch in branches:
        senses = [mode.sense for mode in branch]
        frequencies = [mode.frequency for mode in branch]
        _draw_sections(above, speeds, frequencies, senses, _SENSE_STYLES)
        ratios = _numbers([mode.damping_ratio for mode in branch])
        _draw_sections(below, speeds, ratios, senses, _SENSE_STYLES)
    above.plot(speeds, speeds, **_ONCE)
    for speed, mode in vibration.over_speed.critical:
        above.plot(
            speed, speed, "o", color=_SENSE_STYLES[mode.sense]["color"], mec="k", ms=5, zorder=4
        )
    most = max(mode.frequency for branch in branches for mode in branch)
    above.set_ylim(0, 1.1 * most if most > 0 else speeds[-1])
    above.set_xlim(0, speeds[-1])
    above.set_ylabel("frequency [rad/s]")
    below.set_ylabel("damping ratio [1]")
    below.set_xlabel("spindle speed [rad/s]")
    below.set_ylim(min(0.0, below.get_ylim()[0]), 1.1 * below.get_ylim()[1])
    above.secondary_xaxis("top", functions=(_times(RPM), _times(1.0 / RPM))).set_xlabel(
        "spindle speed [1/min]"
    )
    turn = 2.0 * math.pi
    above.secondary_yaxis("right", functions=(_times(1 / turn), _times(turn))).set_ylabel("[Hz]")
    for axes in (above, below):
        axes.grid(alpha=0.3)
    last = [branch[-1] for branch in branches]
    label_at_right(above, [_mode_label(vibration, mode) for mode in last], away=50.0)
    above.legend(handles=_mode_legend(vibration), loc="lower right", fontsize=8)
    figure.supxlabel(AVERAGING, fontsize=8, color="0.4")
    return figure


def _mode_label(vibration: NaturalVibration, mode: Mode) -> Label:
    """Return the label of a mode at the largest speed: its frequency [rad/s], and what moves."""
    what = ", ".join(moving(vibration.linearised, mode)[:2])
    return Label(
        mode.frequency, f"{mode.frequency:.4g}  {what}", _SENSE_STYLES[mode.sense]["color"]
    )


def _mode_legend(vibration: NaturalVibration) -> list[Line2D]:
    senses = {mode.sense for branch in vibration.over_speed.branches for mode in branch}
    names = {"forward": "forward whirl", "backward": "backward whirl", None: "back and forth"}
    lines = [
        Line2D([], [], label=name, **_SENSE_STYLES[sense])
        for sense, name in names.items()
        if sense in senses
    ]
    once = Line2D(
        [], [], label="once per revolution; critical speeds", marker="o", mec="k", **_ONCE
    )
    return [*lines, once]


def _times(factor: float) -> Callable[[np.ndarray], np.ndarray]:
    return lambda values: factor * values


_RECOVERY_COLOURS = ("tab:blue", "tab:orange")
"""Colours of the scene's curves, and of those with one ball in place of all balls."""


def drawn_recovery(recoveries: RecoveryOverDrag) -> ResultFigure:
    """Return the figure of settling time, amplitude and composite index over drag.

    Parameters
    ----------
    recoveries
        Recoveries of a scene over the drag.
    """
    figure = ResultFigure(figsize=(9, 7), layout="constrained")
    figure.suptitle(
        f"{recoveries.scene}: recovery from {recoveries.from_speed:g} to "
        f"{recoveries.to_speed:g} rad/s",
        fontsize=13,
    )
    (times, amplitudes), (index, against) = figure.subplots(2, 2)
    several = "1 ball" if recoveries.balls == 1 else f"{recoveries.balls} balls"
    ways: list[tuple[str, Sequence[Recovery]]] = [(several, recoveries.at_drags)]
    if recoveries.one_ball is not None:
        ways.append(("1 ball of their mass", recoveries.one_ball[1:]))
    for (name, runs), colour in zip(ways, _RECOVERY_COLOURS, strict=False):
        style = {"color": colour, "marker": "o", "ms": 4, "label": name}
        settling = _numbers([run.settling_time for run in runs])
        times.plot(recoveries.drags, settling, **style)
        amplitudes.plot(recoveries.drags, [1e3 * run.maximum_amplitude for run in runs], **style)
        # Lambda compares drags of one drive, not different drives.
        if runs is recoveries.at_drags:
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
    """Set the titles of both axes, a grid, and 0 as the lower end of the vertical axis."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(alpha=0.3)
    axes.set_ylim(bottom=0.0)
