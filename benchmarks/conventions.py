"""Drawing of docs/conventions.md: definitions of angles, whirl, eccentricity and heights.

    python benchmarks/conventions.py [--out docs]

writes conventions.png.
"""

import argparse
import sys
from math import atan2, cos, degrees, radians, sin
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from arguments import folder  # noqa: E402
from matplotlib.axes import Axes  # noqa: E402
from matplotlib.figure import Figure  # noqa: E402
from matplotlib.patches import Arc, Circle, FancyArrowPatch, Rectangle  # noqa: E402

from ab_sim.show.styles import BLUE, GREEN, GREY, PURPLE, VERMILION  # noqa: E402

PSI, THETA = 40.0, -130.0
"""Drawn spindle and ball angle [deg]."""
SHAFT, RACE, ECCENTRICITY = (0.55, 0.3), 1.6, 0.75


def draw_above(axes: Axes) -> None:
    """Draw the view from +z: the displaced shaft, the unbalance and a ball."""
    cx, cy = SHAFT
    axes.set_title("from +z", fontsize=11)
    for end, name in (((2.75, 0.0), "x"), ((0.0, 2.3), "y")):
        _arrow(axes, (0, 0), end, GREY, 1.0)
        axes.text(end[0] + 0.05, end[1] + 0.05, name, color=GREY, fontsize=12)
    axes.text(-0.12, -0.1, "O", ha="right", va="top", fontsize=12, color=GREY)
    axes.add_patch(Circle(SHAFT, RACE, fill=False, lw=1.2, color="0.3"))
    axes.text(cx - 1.15, cy + 1.3, "race, R", fontsize=10, ha="right", color="0.3")
    _arrow(axes, (0, 0), SHAFT, BLUE, 2.0)
    axes.text(0.2, 0.24, "W", color=BLUE, fontsize=12)
    axes.plot(*SHAFT, "o", color="k", ms=6)
    axes.text(cx + 0.02, cy - 0.24, "C, the shaft", fontsize=10)
    _ray(axes, 0.0, 2.1, GREY, "parallel to x")
    _ray(axes, PSI, 2.15, VERMILION, "axis 1: the unbalance")
    _ray(axes, PSI + 90.0, 0.95, VERMILION, "axis 2")
    at = _from_shaft(PSI, ECCENTRICITY)
    axes.plot(*at, "o", color=VERMILION, ms=13, zorder=3)
    axes.text(at[0] - 0.1, at[1] + 0.14, "M0", color=VERMILION, fontsize=11, ha="right")
    axes.text(*_from_shaft(PSI - 20.0, 0.42), "e", color=VERMILION, fontsize=12, ha="center")
    ball = _from_shaft(PSI + THETA, RACE)
    axes.plot(*zip(SHAFT, ball, strict=True), color=GREEN, lw=1.2)
    axes.plot(*ball, "o", color=GREEN, ms=16, zorder=3)
    axes.text(ball[0] + 0.2, ball[1] - 0.3, "ball, m", color=GREEN, fontsize=11)
    _angle(axes, 1.05, 0.0, PSI, VERMILION, "psi", 0.82)
    _angle(axes, 1.3, PSI, THETA, GREEN, f"theta\n(here {THETA:g} deg)", 1.75)
    opposite = _from_shaft(PSI + 180.0, RACE)
    axes.plot(*opposite, "x", color=PURPLE, ms=10, mew=2)
    axes.text(
        opposite[0] - 0.12, opposite[1] - 0.1, "opposite the unbalance:\ntheta = -180 or +180 deg",
        color=PURPLE, fontsize=9, ha="right", va="top",
    )  # fmt: skip
    axes.set_xlim(-2.75, 3.6)
    axes.set_ylim(-2.0, 2.6)


def draw_side(axes: Axes) -> None:
    """Draw the view across the shaft: quantities that count from C."""
    axes.set_title("a deck in space, from the side", fontsize=11)
    axes.add_patch(Rectangle((-1.2, -0.13), 3.6, 0.26, color="0.85"))
    axes.add_patch(Rectangle((-1.5, 0.75), 3.0, 0.12, color=VERMILION, alpha=0.35))
    axes.plot([0, 0], [-0.6, 1.75], color=GREY, lw=1.0, ls="-.")
    axes.text(0.06, 1.72, "z, the shaft", color=GREY, fontsize=10)
    axes.plot(0, 0, "o", color="k", ms=6)
    axes.text(-0.08, -0.2, "C", fontsize=12, ha="right", va="top")
    axes.plot(0.35, 0.81, "o", color=VERMILION, ms=11)
    axes.text(0.45, 0.98, "M0 at e, rotor.height", color=VERMILION, fontsize=10)
    for side in (-1.3, 1.3):
        axes.plot(side, 0.45, "o", color=GREEN, ms=10)
    axes.text(1.45, 0.4, "ball at R, race.height", color=GREEN, fontsize=10)
    axes.plot(1.2, 0.0, "P", color=BLUE, ms=11)
    axes.text(
        1.2, -0.2, "deck.center\n(default: C)", color=BLUE, fontsize=10, ha="center", va="top"
    )
    for side in (-1.05, 2.25):
        axes.plot([side, side], [-0.13, -0.6], color="0.3", lw=3, ls=(0, (0.6, 0.4)))
    axes.text(2.32, -0.4, "mounts.position", fontsize=10, color="0.3")
    axes.set_xlim(-1.7, 3.8)
    axes.set_ylim(-0.9, 2.0)


def _from_shaft(angle: float, length: float) -> tuple[float, float]:
    turned = radians(angle)
    return SHAFT[0] + length * cos(turned), SHAFT[1] + length * sin(turned)


def _arrow(axes: Axes, start: tuple, end: tuple, color: str, width: float) -> None:
    axes.add_patch(
        FancyArrowPatch(
            start,
            end,
            arrowstyle="-|>",
            mutation_scale=12,
            lw=width,
            color=color,
            shrinkA=0,
            shrinkB=0,
        )  # fmt: skip
    )


def _ray(axes: Axes, angle: float, length: float, color: str, name: str) -> None:
    end = _from_shaft(angle, length)
    _arrow(axes, SHAFT, end, color, 1.0)
    side = "right" if cos(radians(angle)) < 0 else "left"
    axes.text(end[0], end[1] + 0.06, name, color=color, fontsize=10, ha=side)


def _angle(
    axes: Axes, size: float, start: float, by: float, color: str, name: str, away: float
) -> None:
    """Draw an arc with a head, from ``start`` by an angle [deg]."""
    low, high = sorted((start, start + by))
    axes.add_patch(Arc(SHAFT, 2 * size, 2 * size, theta1=low, theta2=high, color=color, lw=1.4))
    end, before = (_from_shaft(start + part * by, size) for part in (1.0, 0.97))
    direction = degrees(atan2(end[1] - before[1], end[0] - before[0]))
    axes.plot(*end, marker=(3, 0, direction - 90.0), color=color, ms=9)
    middle = _from_shaft(start + 0.5 * by, away)
    axes.text(*middle, name, color=color, fontsize=11, va="center")


def main() -> None:
    """Draw both views."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=folder, default=Path(__file__).resolve().parents[1] / "docs")
    given = parser.parse_args()
    figure = Figure(figsize=(12, 4.9), layout="constrained")
    above, side = figure.subplots(1, 2, width_ratios=(6.35, 5.5))
    draw_above(above)
    draw_side(side)
    for axes in (above, side):
        axes.set_aspect("equal")
        axes.set_axis_off()
    figure.savefig(given.out / "conventions.png", dpi=90)


if __name__ == "__main__":
    main()
