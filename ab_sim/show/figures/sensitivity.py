"""Effect of one percent of each number of a scene on a run's metrics, as bars."""

import numpy as np
from matplotlib.axes import Axes

from ab_sim.design.derivatives import MetricSensitivities
from ab_sim.show.figures.saved import ResultFigure

MORE, LESS = "#1f4e8c", "#c4622d"
MOST = 25
"""Largest number of bars in a panel, those with the most influence."""
SMALL = 1e-6
"""Percent per percent below which a bar is not drawn."""


def drawn_sensitivities(found: MetricSensitivities) -> ResultFigure:
    """Return a figure with a panel for each metric, without writing it."""
    count = len(found.metrics)
    shown = [_shown(found.elasticities[i]) for i in range(count)]
    rows = max([len(each) for each in shown] + [2])
    figure = ResultFigure(figsize=(1.5 + 5.0 * count, 1.4 + 0.26 * rows), layout="constrained")
    for i, axes in enumerate(figure.subplots(1, count, squeeze=False)[0]):
        _bars(found, i, shown[i], axes)
    figure.suptitle(f"{found.scene.name}: percent per percent", fontsize=11)
    return figure


def _shown(elasticities: np.ndarray) -> list[int]:
    sizes = np.nan_to_num(np.abs(elasticities))
    order = [int(k) for k in np.argsort(-sizes, kind="stable") if sizes[k] > SMALL]
    return order[:MOST][::-1]


def _bars(found: MetricSensitivities, metric: int, shown: list[int], axes: Axes) -> None:
    values = found.elasticities[metric, shown]
    colours = [MORE if value > 0 else LESS for value in values]
    errors = found.elasticity_uncertainties[metric, shown]
    axes.barh(range(len(shown)), values, xerr=errors, color=colours, capsize=3)
    axes.set_yticks(range(len(shown)), [found.keys[k] for k in shown], fontsize=8)
    unit = found.metric_units[metric]
    named = f"{found.metric_values[metric]:.4g}" + ("" if unit == "1" else f" {unit}")
    axes.set_title(f"{found.metrics[metric]} = {named}", fontsize=9)
    axes.axvline(0.0, color="black", lw=0.8)
    axes.grid(axis="x", alpha=0.25)
    if not shown:
        axes.text(0.5, 0.5, "no influence", ha="center", transform=axes.transAxes)
