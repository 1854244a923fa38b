"""Drawing of docs/explanation/balancer.md: motion of balls below and above the critical speed.

    python benchmarks/balancer.py [--out docs/explanation]

writes balancer.png: the rotor seen along the shaft, on axes that turn with it. Directions of the
whirl are those of a rotor on springs (damping ratio 0.1); its size is exaggerated.
"""

import argparse
import sys
from math import acos, atan2, cos, degrees, pi, sin
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from arguments import folder  # noqa: E402
from matplotlib.axes import Axes  # noqa: E402
from matplotlib.figure import Figure  # noqa: E402
from matplotlib.patches import Circle, FancyArrowPatch  # noqa: E402

from ab_sim.show.styles import BLUE, GREEN, GREY, VERMILION  # noqa: E402

DAMPING = 0.1
WHIRL, ECCENTRICITY = 0.3, 0.5
"""Drawn whirl and eccentricity, in race radii."""
BALANCED = acos(-1.0 / 1.6)
"""Angle of the balls in the last drawing [rad]; they are 1.6 times as heavy as needed."""


def phase(speed: float) -> float:
    """Return the direction of the whirl from the unbalance [rad], at a speed over the critical."""
    return -atan2(2.0 * DAMPING * speed, 1.0 - speed**2)


def draw(axes: Axes, title: str, speed: float | None) -> None:
    """Draw the rotor at a speed over the critical one; None: balanced."""
    direction = phase(speed) if speed else 0.0
    whirl = WHIRL if speed else 0.0
    x, y = whirl * cos(direction), whirl * sin(direction)
    axes.add_patch(Circle((x, y), 1.0, fill=False, lw=1.4, color="0.3"))
    axes.plot(x + ECCENTRICITY, y, "o", color=VERMILION, ms=13, zorder=3)
    over = cos(direction) > 0.0  # beside the dashed line or the axis, not on it
    axes.text(
        x + ECCENTRICITY, y + (0.14 if over else -0.14), "unbalance", color=VERMILION,
        ha="center", va="bottom" if over else "top", fontsize=10,
    )  # fmt: skip
    axes.plot([x, x + ECCENTRICITY], [y, y], color=VERMILION, lw=1.4)
    if speed:
        far = x + cos(direction), y + sin(direction)
        axes.plot([0.0, far[0]], [0.0, far[1]], color=GREY, lw=1.0, ls="--", zorder=1)
        axes.add_patch(
            FancyArrowPatch(
                (0.0, 0.0), (x, y), arrowstyle="-|>", mutation_scale=14, lw=2.2, color=BLUE,
                shrinkA=0, shrinkB=0, zorder=2,
            )
        )  # fmt: skip
        axes.text(0.5 * x, 0.5 * y + 0.1, "W", color=BLUE, ha="center", fontsize=12)
        for side in (-1.0, 1.0):
            _roll(axes, (x, y), direction + 1.1 * side, direction + 0.22 * side)
        axes.plot(*far, "o", color=GREEN, ms=15, zorder=3)
        axes.plot(0.0, 0.0, "P", color="k", ms=9, zorder=4)
        axes.plot(x, y, "o", color="k", ms=6, zorder=4)
    else:
        for angle in (BALANCED, -BALANCED):
            axes.plot(cos(angle), sin(angle), "o", color=GREEN, ms=15, zorder=3)
        axes.plot(0.0, 0.0, "P", color="k", ms=9, zorder=4)
    axes.set_title(title, fontsize=11)
    axes.set_xlim(-1.45, 1.45)
    axes.set_ylim(-1.3, 1.3)
    axes.set_aspect("equal")
    axes.set_axis_off()


def _roll(axes: Axes, center: tuple[float, float], start: float, end: float) -> None:
    """Draw the path of a ball along the race."""
    points = [start + (end - start) * k / 30.0 for k in range(31)]
    xs, ys = zip(
        *((center[0] + 1.12 * cos(p), center[1] + 1.12 * sin(p)) for p in points), strict=True
    )
    axes.plot(xs, ys, color=GREEN, lw=1.6)
    heading = degrees(end + (pi / 2.0 if end > start else -pi / 2.0)) - 90.0
    axes.plot(xs[-1], ys[-1], marker=(3, 0, heading), color=GREEN, ms=9)


def main() -> None:
    """Draw the three pictures."""
    docs = Path(__file__).resolve().parents[1] / "docs"
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=folder, default=docs / "explanation")
    given = parser.parse_args()
    figure = Figure(figsize=(11, 4.4), layout="constrained")
    below, above, balanced = figure.subplots(1, 3)
    draw(below, "0.8 of the critical speed:\nballs go to the unbalance", 0.8)
    draw(above, "1.5 times the critical speed:\nballs go to the other side", 1.5)
    draw(balanced, "balanced: the race is centred,\nand nothing moves the balls", None)
    figure.supxlabel(
        "+ axis of rotation, at rest     \u2022 shaft, displaced by W     "
        "green: balls, rolling to the point of the race farthest from the axis",
        fontsize=10,
    )
    figure.savefig(given.out / "balancer.png", dpi=90)


if __name__ == "__main__":
    main()
