"""Panel of a run's balls: their angles, or their speeds if balls circulate."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MultipleLocator

from ab_sim.analysis.metrics import Metrics
from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene.model import Scene
from ab_sim.show.figures.colours import LIMIT, RUN, ball_colours
from ab_sim.show.figures.curves import draw_curve, in_degrees
from ab_sim.show.figures.dashes import dashes_of
from ab_sim.show.figures.labels import Label, label_at_right

OPPOSITE = -180.0
"""Angle of the side opposite the unbalance [deg]."""
MOST_LABELS = 8
"""Largest number of balls with names."""


def draw_balls(axes: Axes, path: Trajectory, scene: Scene, metrics: Metrics) -> None:
    """Draw ball angles, or speeds if balls circulate, because many turns of angle are illegible.

    Args:
        axes: axes to draw on.
        path: consecutive samples, from the start to the end.
        scene: scene of the run.
        metrics: metrics of the run.
    """
    if metrics.circulating is None:
        _draw_angles(axes, path, metrics)
    else:
        _draw_speeds(axes, path, scene, metrics)


def _draw_speeds(axes: Axes, path: Trajectory, scene: Scene, metrics: Metrics) -> None:
    time, circulation = path["time"], metrics.circulating
    assert circulation is not None
    labels = [Label(path["speed"][-1], "spindle", RUN)]
    axes.plot(time, path["speed"], color=RUN, lw=1.0, ls="--", zorder=3)
    for ball, style in enumerate(ball_styles(path.balls)):
        draw_curve(axes, time, path["speed"] + path.ball_rates[:, ball], **style)
        if path.balls <= MOST_LABELS and ball not in circulation.balls:
            labels.append(Label(path["speed"][-1], f"ball {ball}", style["color"]))
    for speed in sorted({float(f"{speed:.3g}") for speed in circulation.speeds}):
        many = sum(
            float(f"{circulating_speed:.3g}") == speed for circulating_speed in circulation.speeds
        )
        what = "ball circulates" if many == 1 else "balls circulate"
        labels.append(Label(speed, f"{many} {what}\nat {speed:g} rad/s"))
    if scene.critical_speed is not None:
        axes.axhline(scene.critical_speed, color=LIMIT, lw=0.8, ls=":")
        labels.append(Label(scene.critical_speed, "critical speed", LIMIT))
    axes.set_ylabel("speed of the balls\n[rad/s]")
    label_at_right(axes, labels[:MOST_LABELS])


def _draw_angles(axes: Axes, path: Trajectory, metrics: Metrics) -> None:
    time, angles = path["time"], in_degrees(path.ball_angles)
    labels = []
    for ball, style in enumerate(ball_styles(path.balls)):
        axes.plot(time, angles[:, ball], **style)
        if path.balls <= MOST_LABELS:
            labels.append(Label(angles[-1, ball], f"ball {ball}", style["color"]))
    low, high = min(np.nanmin(angles), OPPOSITE), max(np.nanmax(angles), OPPOSITE)
    margin = max(0.06 * (high - low), 15.0)
    low, high = low - margin, high + margin
    axes.axhline(OPPOSITE, color=LIMIT, lw=0.9, ls=":")
    labels.append(Label(OPPOSITE, "opposite the unbalance", LIMIT))
    axes.set_ylim(low, high)
    ticks = next((base for base in (15, 30, 45) if high - low <= 8 * base), 90)
    axes.yaxis.set_major_locator(MultipleLocator(ticks, offset=0))
    axes.set_ylabel("ball angle from\nthe unbalance [deg]")
    passed = metrics.first_passage_of_opposite
    if passed is not None and passed > 0:
        axes.plot(passed, OPPOSITE, "ko", ms=5, zorder=4)
        # Curves come from above and continue to the right: there is room below on the left, or
        # above.
        late = passed > 0.3 * time[-1]
        axes.annotate(
            f"all balls at -180 deg first: {passed:.3f} s", (passed, OPPOSITE), fontsize=8,
            xytext=(-8, -10) if late else (8, 8), textcoords="offset points",
            ha="right" if late else "left",
        )  # fmt: skip
    label_at_right(axes, labels)


def ball_styles(balls: int) -> list[dict[str, Any]]:
    """Return a style per ball; later ones are thinner, so that coinciding curves remain visible."""
    widths = np.linspace(3.0, 1.0, balls) if balls > 1 else [1.8]
    return [
        {"color": colour, "lw": width, "dashes": dashes_of(ball)}
        for ball, (colour, width) in enumerate(zip(ball_colours(balls), widths, strict=True))
    ]
