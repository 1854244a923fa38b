"""Figures 11 and 12 of 2008: runs at a held speed from rest, with balls and without."""

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ab_sim import Trajectory, simulate_batch
from ab_sim.analysis import run_scene
from ab_sim.show.curves import draw_curve
from gallery.page import PageSection, Table
from gallery.two_plane.long_rotor import DYNAMIC, MEASURED_AT, OPPOSITE, long_rotor, long_scene
from gallery.two_plane.rotor import (
    RigidRotor,
    Tell,
    alphas,
    balanced_alphas,
    sorted_in_planes,
    vibration,
    written,
)

APART = 1e-9
"""By how much balls that start at one place are moved apart [rad]: else they stay together."""
MOVED, MOVED_RUNS, MOVED_LAST = 1e-3, 12, 550.0
"""By how much starts are moved [rad], how many, and how long they run [1/Omega_1]."""
LAST = 50.0
"""Of a run, that its end is [1/Omega_1]."""


class LongRun(NamedTuple):
    """A run of the figures."""

    name: str
    rotor: RigidRotor
    speed: float
    duration: float
    starts: tuple[float, ...]
    printed: str
    """What becomes of it."""


def _static(eccentricity: float, ball_mass: float) -> RigidRotor:
    return long_rotor(eccentricity=eccentricity, ball_mass=ball_mass)


_THIRD = math.pi / 3.0
_DYNAMIC = long_rotor(**DYNAMIC, ball_mass=0.005)
RUNS = (
    LongRun("11 (i)", _static(0.01, 0.025), 2.0, 800.0, OPPOSITE, "balances"),
    LongRun("11 (ii)", _static(0.01, 0.005), 2.5, 800.0, OPPOSITE, "low, then .11 to .14"),
    LongRun("11 (iii)", _static(0.01, 0.005), 4.0, 800.0, OPPOSITE, "balances by t = 400"),
    LongRun("11 (iv)", _static(0.025, 0.025), 1.5, 800.0, OPPOSITE, "chaotic, .1 to .35"),
    LongRun("12 (a)", _DYNAMIC, 3.5, 1200.0, OPPOSITE, "balances"),
    LongRun(
        "12 (b)", _DYNAMIC, 3.5, 550.0, (_THIRD, -_THIRD, 2.0 * _THIRD, -2.0 * _THIRD),
        "twice that without balls, one ball lags",
    ),
    LongRun(
        "12 (c)", _DYNAMIC, 3.5, 550.0, (0.0, APART, math.pi, math.pi + 2.0 * APART),
        "chaotic, up to .06",
    ),
)  # fmt: skip
PLAIN = {"11 (i)": 0.0133, "11 (ii)": 0.0119, "11 (iii)": 0.0107, "11 (iv)": 0.045}
"""Level that the figure shows without balls; of figure 12 it is .0084."""


def run_section(folder: Path, tell: Tell) -> PageSection:
    """The runs, and what becomes of them."""
    figure = Figure(figsize=(12.0, 14.0), layout="constrained")
    figure.suptitle("Vibration with balls (blue) and without (grey), from rest at a held speed")
    panels = figure.subplots(4, 2).flat
    rows, last = [], np.zeros(4)
    for k, each in enumerate(RUNS):
        tell("runs of 2008", k, len(RUNS))
        balls, bare = computed(each)
        _draw(panels[k], each, balls, bare)
        end, level = _end(each, balls), _end(each, bare).mean()
        lag = lags(each, balls)
        behind = ", ".join(f"{rate:.3f}" for rate in lag if abs(rate) > 0.05) or "none"
        rows.append(
            (each.name, PLAIN.get(each.name, 0.0084), level, each.printed, end.mean(), behind)
        )
        if each.name == "12 (a)":
            last = np.angle(np.exp(1j * alphas(each.rotor, balls)[-1]))
    _draw_balls(panels[len(RUNS)], balanced_alphas(_DYNAMIC), last)
    names = (
        *("figure", "A without balls, printed", "ours", "A with balls, printed", "ours, mean"),
        "balls that lag, alpha'/Omega",
    )
    table = Table(f"The last {LAST:g} time units", names, tuple(rows), 3)
    at_end = balanced_alphas(_DYNAMIC), sorted_in_planes(last)
    beside = Table(
        "Figure 12 (a): balls [rad]",
        ("ball", "balanced, (16)", "at the end of our run"),
        tuple((k + 1, float(a), float(b)) for k, (a, b) in enumerate(zip(*at_end, strict=True))),
        4,
    )
    text = (
        "Figures 11 and 12 (a) end as printed. Chaotic runs cannot agree in time: 11 (ii) "
        "leaves its symmetry by rounding errors, and 12 (b) and (c) pass through chaos. In 12 "
        f"(c) the balls start in pairs, here {APART:g} rad apart.",
        f"How 12 (b) and (c) end is therefore chance: starts moved by {MOVED:g} rad leave from "
        "none to three lagging balls (table in the JSON). Balls that do not balance lag at "
        "half the spindle speed. With one such ball the level of 12 (b) is the printed one.",
        "Slip: for 12 (b) the text gives alpha' = -Omega and also one revolution per two of "
        "the rotor. Only the second, -Omega/2, agrees with the figure.",
    )
    caption = (
        "Figures 11 and 12, vibration A (23) in race radii; last panel: where the balls of 12 (a) "
        "end (dots), and the balanced positions (16) (lines)"
    )
    picture = written(figure, folder, "runs", caption)
    return PageSection("Runs of the long rotor", text, (table, beside, _moved(tell)), (picture,))


def computed(each: LongRun) -> tuple[Trajectory, Trajectory]:
    """With balls, and without."""
    with_balls, bare = (
        run_scene(long_scene(each.rotor, each.speed, each.duration, starts)).trajectory
        for starts in (each.starts, ())
    )
    return with_balls, bare


def lags(each: LongRun, run: Trajectory) -> np.ndarray:
    """The balls' mean rates over the end of a run [Omega]."""
    first = int(np.searchsorted(run["time"], each.duration - LAST))
    turned = run.ball_angles[-1] - run.ball_angles[first]
    return np.asarray(turned / (run["time"][-1] - run["time"][first]) / each.speed)


def moved_runs(each: LongRun, count: int) -> list[tuple[int, float]]:
    """Balls that lag at the end, and the mean level there, from starts moved a little."""
    moved = np.random.default_rng(0).uniform(-MOVED, MOVED, (count, len(each.starts)))
    angles = np.array(each.starts) - each.rotor.phase + moved
    scene = long_scene(each.rotor, each.speed, MOVED_LAST, each.starts)
    batch = simulate_batch(scene, [{"start.ball_angles": row.tolist()} for row in angles], every=5)
    short = each._replace(duration=MOVED_LAST)
    return [
        (int(np.sum(np.abs(lags(short, run)) > 0.2)), float(_end(short, run).mean()))
        for run in (one.trajectory for one in batch.runs)
    ]


def _moved(tell: Tell) -> Table:
    rows: list[tuple[str | int | float | None, ...]] = []
    for k, each in enumerate(RUNS[-3:]):
        tell("starts moved a little", k, 3)
        found = moved_runs(each, MOVED_RUNS)
        for number in sorted({lagging for lagging, _ in found}):
            levels = [level for lagging, level in found if lagging == number]
            rows.append((each.name, number, len(levels), min(levels), max(levels)))
    title = f"{MOVED_RUNS} starts moved by at most {MOVED:g} rad, to t = {MOVED_LAST:g}"
    names = ("start", "balls that lag", "runs", "least A", "largest A")
    return Table(title, names, tuple(rows), 3, on_page=False)


def _end(each: LongRun, run: Trajectory) -> np.ndarray:
    return vibration(run, MEASURED_AT)[run["time"] >= each.duration - LAST]


def _draw(axes: Axes, each: LongRun, balls: Trajectory, bare: Trajectory) -> None:
    for run, color in ((bare, "0.7"), (balls, "tab:blue")):
        draw_curve(axes, run["time"], vibration(run, MEASURED_AT), color=color, lw=0.8)
    axes.set_title(
        f"Figure {each.name}: Omega = {each.speed:g}, m = {each.rotor.ball_mass:g}",
        fontsize=10, loc="left",
    )  # fmt: skip
    axes.set_xlabel("time [1/Omega_1]")
    axes.set_ylabel("A [R]")
    axes.set_ylim(bottom=0.0)
    axes.grid(alpha=0.3)


def _draw_balls(axes: Axes, balanced: np.ndarray, last: np.ndarray) -> None:
    around = np.linspace(0.0, 2.0 * math.pi, 200)
    for x, balls in ((-1.3, slice(0, 2)), (1.3, slice(2, 4))):
        axes.plot(x + np.cos(around), np.sin(around), color="0.7", lw=1.0)
        for angle in balanced[balls]:
            axes.plot([x, x + math.cos(angle)], [0.0, math.sin(angle)], color="0.4", lw=1.0)
        axes.plot(x + np.cos(last[balls]), np.sin(last[balls]), "o", color="tab:red", ms=7)
    for x, name in ((-1.3, "z = 2"), (1.3, "z = -2")):
        axes.text(x, -1.3, name, ha="center", fontsize=9)
    axes.set_aspect("equal")
    axes.set_axis_off()
