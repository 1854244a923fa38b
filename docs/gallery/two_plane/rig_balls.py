"""Figures 12 and 14 of 2010: the rig with two balls in one race."""

import math
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ab_sim.analysis import run_scene
from gallery.page import Cell, PageSection, Table
from gallery.two_plane.rig import BEARINGS_AT, RPM, TABLE_2, Unbalance, rig
from gallery.two_plane.rig_identified import CURVE, identified, misfits
from gallery.two_plane.rig_levels import balanced, plain, together
from gallery.two_plane.rotor import Tell, alphas, scene_of, vibration, written


class Held(NamedTuple):
    """What figure 14 shows at a speed, with two washers and with balls."""

    rpm: float
    level: float
    """[mm]."""
    angles: tuple[float, float]
    """Of the balls, from the light spot [deg]."""
    together: bool = False
    """Both at one place."""


FIGURE_14 = (
    Held(990, 0.0380, (176.1, 176.1), True),
    Held(1200, 0.0903, (169.0, 169.0), True),
    Held(2010, 0.0497, (-45.2, 48.8)),
    Held(3000, 0.0137, (-51.3, 46.1)),
    Held(3990, 0.0092, (-50.7, 47.1)),
    Held(5010, 0.0079, (-50.5, 47.3)),
)
FIGURE_12 = {0: (0.0107, 0.0107), 1: (0.0151, 0.0079), 2: (0.0274, 0.0079), 3: (0.0397, 0.0079),
             4: (0.0520, 0.0180)}  # fmt: skip
"""Theoretical level without balls and with, by washers [mm]."""
AT = 4500.0
"""Speed at which figure 12 is taken here, in the middle of its range [rpm]."""
RUNS = np.concatenate([np.arange(700.0, 2600.0, 75.0), np.arange(2600.0, 5101.0, 250.0)])
OVER = np.arange(600.0, 5201.0, 25.0)
LONG, LAST = 6.0, 0.25
"""Of a run, and of its end, [s]."""
APART = 1e-3
"""By how much balls that start at the heavy spot are moved apart [rad]."""


def ball_section(folder: Path, tell: Tell) -> PageSection:
    """Levels and ball positions, printed and ours."""
    fitted = identified()
    unbalances = TABLE_2[2], fitted
    rows: list[tuple[Cell, ...]] = []
    for held in FIGURE_14:
        find = together if held.together else balanced
        found = [find(unbalance, held.rpm) for unbalance in unbalances]
        levels = [None if each is None else 1e3 * each.of_mean for each in found]
        angles = [None if each is None else _texts(np.degrees(each.angles)) for each in found]
        rows.append((f"{held.rpm:g}", held.level, *levels, _texts(held.angles), *angles))
    names = (
        *("speed [rpm]", "level, printed [mm]", "by table 2", "by the curve"),
        *("balls, printed [deg]", "by table 2", "by the curve"),
    )
    table = Table("Figure 14: two washers, c_b / (m R^2 Omega_cyl,X) = .1", names, tuple(rows), 3)
    fit = Table(
        "Unbalance with two washers",
        ("", "eps [mm]", "chi [1e-5 rad]", "beta [deg]", "largest misfit of the curve [%]"),
        tuple(
            (
                *(name, 1e3 * each.eccentricity, 1e5 * each.misalignment, each.phase),
                100.0 * float(np.abs(misfits(each)).max()),
            )
            for name, each in zip(("table 2", "by the curve"), unbalances, strict=True)
        ),
        4,
    )
    text = (
        "Angles are measured from the light spot. The balls bring their own plane to rest; a "
        "couple remains. Below the first critical speed they add to the unbalance, above the "
        "last they balance, as printed. Between, runs end in many ways, as the paper also "
        "reports.",
        "Slip: figure 14 seems to use two sets of parameters. Its curve without balls is not "
        "that of table 2. An unbalance fitted to this curve gives the printed ball angles to "
        ".3 deg above 1000 rpm (table 2: 3 to 5 deg off), but the printed levels with balls "
        "are those of table 2, within 2.5 %.",
        "In figure 12 the printed levels with balls are flat, as if the washers lay in the "
        "balls' plane; by table 2 ours fall with the number of washers. The speed is not "
        "printed; ours is the middle of its range.",
    )
    figure = Figure(figsize=(9.0, 7.5), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    _draw_runs(above, below, tell)
    for unbalance, line in zip(unbalances, ("-", ":"), strict=True):
        _draw_balanced(above, below, unbalance, line)
    _draw_printed(above, below)
    caption = (
        "Figure 14, two washers: level and ball positions. Dots: our runs from rest, balls at the "
        "heavy spot, by table 2; lines: without balls (grey), and balanced (blue), by table 2, "
        "dotted by the unbalance that fits the printed curve; crosses: printed simulation, without "
        "balls black, with them red"
    )
    picture = written(figure, folder, "rig-balls", caption)
    return PageSection(
        "The rig with balls: figures 12 and 14", text, (fit, table, _figure_12()), (picture,)
    )


def _figure_12() -> Table:
    rows: list[tuple[Cell, ...]] = []
    for row in TABLE_2:
        bare_printed, printed = FIGURE_12[row.washers]
        bare, found = plain(row, AT), balanced(row, AT)
        with_balls = None if found is None else 1e3 * found.of_maxima
        rows.append((row.washers, bare_printed, 1e3 * bare.of_maxima, printed, with_balls))
    names = "washers", "without balls, printed", "ours", "with balls, printed", "ours"
    return Table(f"Figure 12, theory, ours at {AT:g} rpm [mm]", names, tuple(rows), 3)


def _texts(angles: Iterable[float]) -> str:
    return ", ".join(f"{angle:.1f}" for angle in angles)


def ended(rpm: float) -> tuple[float, np.ndarray, bool]:
    """A run from rest: its last level [mm], the balls' last angles [deg], and whether they rest."""
    p = rig(TABLE_2[2])
    scene = scene_of(p, rpm * RPM, (p.phase, p.phase + APART), duration=LONG)
    run = run_scene(scene).trajectory
    end = run["time"] >= LONG - LAST
    level = 1e3 * float(vibration(run, BEARINGS_AT)[end].max())
    angles = alphas(p, run)[end] - p.phase + math.pi
    return level, np.degrees(np.angle(np.exp(1j * angles[-1]))), bool(np.ptp(angles, 0).max() < 0.1)


def _draw_runs(above: Axes, below: Axes, tell: Tell) -> None:
    for k, rpm in enumerate(RUNS.tolist()):
        tell("runs of the rig", k, len(RUNS))
        level, angles, rest = ended(rpm)
        above.plot(rpm, level, "o", color="tab:blue" if rest else "tab:orange", ms=4)
        if rest:
            below.plot([rpm, rpm], angles, "o", color="tab:blue", ms=4)
    for label, color in (("balls at rest", "tab:blue"), ("balls moving", "tab:orange")):
        above.plot([], [], "o", color=color, ms=4, label=label)


def _draw_balanced(above: Axes, below: Axes, unbalance: Unbalance, line: str) -> None:
    bare = [1e3 * plain(unbalance, rpm).of_mean for rpm in OVER.tolist()]
    above.semilogy(OVER, bare, color="0.6", lw=1.0, ls=line)
    high = OVER[OVER > 2450.0]
    found = [balanced(unbalance, rpm) for rpm in high.tolist()]
    levels = [math.nan if each is None else 1e3 * each.of_mean for each in found]
    above.semilogy(high, levels, color="tab:blue", lw=1.0, ls=line)
    for side in (0, 1):
        aside = [math.nan if each is None else math.degrees(each.angles[side]) for each in found]
        below.plot(high, aside, color="tab:blue", lw=1.0, ls=line)


def _draw_printed(above: Axes, below: Axes) -> None:
    above.plot([*CURVE], [*CURVE.values()], "x", color="k", ms=5)
    for held in FIGURE_14:
        above.plot(held.rpm, held.level, "x", color="tab:red")
        below.plot([held.rpm] * 2, held.angles, "x", color="tab:red")
    above.set_ylabel("vibration [mm]")
    above.legend(fontsize=9)
    below.set_ylabel("balls from the light spot [deg]")
    below.set_ylim(-180.0, 185.0)
    below.set_xlabel("spindle speed [rpm]")
    for axes in (above, below):
        axes.grid(alpha=0.3)
