"""Bars for the effect on a run's metrics of a change of each number of a scene by 1 %."""

import numpy as np
from matplotlib.axes import Axes

from ab_sim.design.derivatives import MetricSensitivities
from ab_sim.show.figures.saved import ResultFigure

MORE, LESS = "#1f4e8c", "#c4622d"
MOST = 25
"""Largest number of bars in a panel, those with the most influence."""
SMALL = 1e-6
"""Sensitivity [percent per percent] below which a bar is not drawn."""


def drawn_sensitivities(sensitivities: MetricSensitivities) -> ResultFigure:
    """Return a figure with a panel for each metric, without writing it."""
    count = len(sensitivities.metrics)
    chosen = [_shown(sensitivities.elasticities[i]) for i in range(count)]
    rows = max([len(keys) for keys in chosen] + [2])
    figure = ResultFigure(figsize=(1.5 + 5.0 * count, 1.4 + 0.26 * rows), layout="constrained")
    for i, axes in enumerate(figure.subplots(1, count, squeeze=False)[0]):
        _bars(sensitivities, i, chosen[i], axes)
    figure.suptitle(f"{sensitivities.scene.name}: percent per percent", fontsize=11)
    return figure


def _shown(elasticities: np.ndarray) -> list[int]:
    sizes = np.nan_to_num(np.abs(elasticities))
    order = [int(k) for k in np.argsort(-sizes, kind="stable") if sizes[k] > SMALL]
    return order[:MOST][::-1]


def _bars(sensitivities: MetricSensitivities, metric: int, keys: list[int], axes: Axes) -> None:
    values = sensitivities.elasticities[metric, keys]
    colours = [MORE if value > 0 else LESS for value in values]
    errors = sensitivities.elasticity_uncertainties[metric, keys]
    axes.barh(range(len(keys)), values, xerr=errors, color=colours, capsize=3)
    axes.set_yticks(range(len(keys)), [sensitivities.keys[k] for k in keys], fontsize=8)
    unit = sensitivities.metric_units[metric]
    named = f"{sensitivities.metric_values[metric]:.4g}" + ("" if unit == "1" else f" {unit}")
    axes.set_title(f"{sensitivities.metrics[metric]} = {named}", fontsize=9)
    axes.axvline(0.0, color="black", lw=0.8)
    axes.grid(axis="x", alpha=0.25)
    if not keys:
        axes.text(0.5, 0.5, "no influence", ha="center", transform=axes.transAxes)
