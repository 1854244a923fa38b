"""Pictures of the thesis' figures, in the axes of the printed ones."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ab_sim.show.saved import save
from gallery.page import Picture
from gallery.thesis.claims import ODD
from gallery.thesis.drive import StartUp

NAME = "thesis"
BALLS = ("tab:blue", "tab:orange")
Panel = Callable[[Axes, StartUp], None]


def whirl_panel(axes: Axes, run: StartUp) -> None:
    """(a) Speed of the rotor and W/e."""
    time = run.trajectory["time"]
    axes.plot(time, run.whirl, color="tab:red", lw=1.0)
    axes.set_ylabel("W/e", color="tab:red")
    speed = axes.twinx()
    speed.plot(time, run.trajectory["speed"], color="0.4", lw=1.0)
    speed.set_ylabel("rotor [rad/s]", color="0.4")


def force_panel(axes: Axes, run: StartUp) -> None:
    """(b) Driving force on the balls."""
    _each(axes, run, run.forces)
    axes.set_ylabel("driving force [N]")


def speed_panel(axes: Axes, run: StartUp) -> None:
    """(b) of chapter 5: speed of the rotor, and of the balls themselves."""
    speed = run.trajectory["speed"]
    axes.plot(run.trajectory["time"], speed, color="0.4", lw=1.0, label="rotor")
    _each(axes, run, speed[:, None] + run.trajectory.ball_rates)
    axes.set_ylabel("speed [rad/s]")


def angle_panel(axes: Axes, run: StartUp) -> None:
    """(c) Where the balls are."""
    angles = np.degrees(run.trajectory.ball_angles)
    _each(axes, run, angles)
    # The next ones, too, where balls are more than half-way to them.
    for odd in ODD if angles.min() < -360.0 else ODD[:1]:
        axes.axhline(-180.0 * odd, color="0.6", lw=0.8, ls="--")
    axes.set_ylabel("ball angle [deg]")


FORCES = (whirl_panel, force_panel, angle_panel)
SPEEDS = (whirl_panel, speed_panel, angle_panel)


def histories(
    folder: Path, file: str, runs: Mapping[str, StartUp], panels: tuple[Panel, ...], caption: str
) -> Picture:
    """A column for each figure, with its panels (a), (b), (c) below each other.

    Parameters
    ----------
    folder
        Where the picture goes.
    file
        What tells it from others.
    runs
        By the figure's number.
    panels
        What is drawn.
    caption
        Below it.
    """
    figure = Figure(figsize=(4.6 * len(runs), 7.2), layout="constrained")
    grid = figure.subplots(3, len(runs), sharex="col", squeeze=False)
    for column, (number, run) in zip(grid.T, runs.items(), strict=True):
        column[0].set_title(f"Fig. {number}", fontsize=11)
        for axes, panel in zip(column, panels, strict=True):
            panel(axes, run)
            axes.grid(alpha=0.3)
            if run.period is not None:
                start = run.period.start
                axes.axvspan(start, start + run.period.duration, color="0.9", zorder=0)
        column[1].legend(fontsize=8, loc="upper left")
        column[2].set_xlabel("time [s]")
    return written(figure, folder, file, caption)


def written(figure: Figure, folder: Path, what: str, caption: str) -> Picture:
    """Write a picture into the folder."""
    file = f"{NAME}-{what}.png"
    save(figure, folder / file, 90)
    return Picture(file, caption)


def _each(axes: Axes, run: StartUp, values: np.ndarray) -> None:
    # The second dashed: balls that start side by side stay so.
    for ball, (color, style) in enumerate(zip(BALLS, ("-", "--"), strict=True)):
        axes.plot(
            run.trajectory["time"], values[:, ball], style, color=color, lw=1.2,
            label=f"ball {ball + 1}",
        )  # fmt: skip
