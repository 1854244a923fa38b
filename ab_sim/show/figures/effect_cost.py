"""Picture of the cost of effects: bars with their spread."""

from pathlib import Path

from matplotlib.axes import Axes

from ab_sim.analysis.effect_cost import ALL, BASE, EffectCost
from ab_sim.show.figures.saved import ResultFigure, save

COLOURS = {BASE: "tab:gray", ALL: "tab:red"}


def cost_figure(costs: list[EffectCost], path: Path) -> None:
    """Draw time per step of every variant, one panel per scene, and write them to a file.

    Args:
        costs: measured costs.
        path: file to write; its ending sets the format (png, svg, pdf).
    """
    save(drawn_cost(costs), path, 120)


def drawn_cost(costs: list[EffectCost]) -> ResultFigure:
    """Return the figure of ``cost_figure`` without writing it; arguments as there."""
    heights = [1.2 + 0.34 * len(cost.rows) for cost in costs]
    figure = ResultFigure(figsize=(9, sum(heights)), layout="constrained")
    panels = figure.subplots(len(costs), 1, squeeze=False, height_ratios=heights)
    for axes, cost in zip(panels[:, 0], costs, strict=True):
        _panel(axes, cost)
    panels[-1, 0].set_xlabel("time per step [µs]: median, and quartiles of interleaved repeats")
    return figure


def _panel(axes: Axes, cost: EffectCost) -> None:
    most = max(row.ns_per_step.upper for row in cost.rows if row.ns_per_step)
    for at, row in enumerate(cost.rows):
        if row.ns_per_step is None or row.ratio is None:
            axes.text(0, at, " cannot run", va="center", fontsize=8)
            continue
        time = row.ns_per_step
        spread = [[1e-3 * (time.median - time.lower)], [1e-3 * (time.upper - time.median)]]
        axes.barh(
            at,
            1e-3 * time.median,
            xerr=spread,
            color=COLOURS.get(row.name, "tab:blue"),
            alpha=0.8,
            capsize=3,
        )
        axes.text(
            1e-3 * (time.upper + 0.01 * most),
            at,
            f" {1e-3 * time.median:.2f} µs, {row.ratio.median:.2f}x",
            va="center",
            fontsize=8,
        )
    names = [row.name + "".join(f"\n+ {name}" for name in row.added) for row in cost.rows]
    axes.set_yticks(range(len(names)), names, fontsize=8)
    axes.invert_yaxis()
    axes.set_xlim(0, 1.2e-3 * most)
    balls = f"{cost.balls} ball{'' if cost.balls == 1 else 's'}"
    axes.set_title(f"{cost.scene}: {balls}, {cost.stepper}, step {cost.step:g} s", fontsize=11)
    axes.grid(axis="x", alpha=0.3)
