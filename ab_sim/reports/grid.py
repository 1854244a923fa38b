"""Panels of several runs, side by side on the same axes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ab_sim.reports.panels import Panel

Limits = tuple[tuple[float, float], tuple[float, float]]
"""From and to, across and up."""


@dataclass(frozen=True)
class Grid:
    """A column for each run, a row for each kind of panel that any of them has."""

    names: tuple[str, ...]
    rows: tuple[tuple[Panel | None, ...], ...]
    limits: tuple[Limits, ...]
    """Of each row; the same for all of its panels."""


def grid_of(names: Sequence[str], runs: Sequence[Sequence[Panel]]) -> Grid:
    """Lay panels out.

    Args:
        names: of the runs.
        runs: the panels of each.
    """
    longest = max(runs, key=len)
    keys = [panel.key for panel in longest]
    keys += [p.key for panels in runs for p in panels if p.key not in keys]
    keys = list(dict.fromkeys(keys))
    by_key = [{panel.key: panel for panel in panels} for panels in runs]
    rows = tuple(tuple(panels.get(key) for panels in by_key) for key in keys)
    limits = tuple(_limits([panel for panel in row if panel is not None]) for row in rows)
    return Grid(tuple(names), rows, limits)


def _limits(panels: Sequence[Panel]) -> Limits:
    across, up = [], []
    for panel in panels:
        for part in (*panel.curves, panel.cloud, panel.heat):
            if part is not None:
                across.append(part.x)
                up.append(part.y)
        up.append(np.array([value for value, _ in panel.levels]))
    log = any(panel.log for panel in panels)
    x, y = _span(across, 0.0 if not panels[0].equal else 0.05, False), _span(up, 0.05, log)
    if any(panel.equal for panel in panels):
        most = max(map(abs, (*x, *y)))
        return (-most, most), (-most, most)
    return x, y


def _span(values: Sequence[np.ndarray], margin: float, log: bool) -> tuple[float, float]:
    joined = np.concatenate([np.empty(0), *values])
    joined = joined[np.isfinite(joined)]
    if len(joined) == 0:
        return 0.0, 1.0
    low, high = float(joined.min()), float(joined.max())
    if log and low > 0:
        factor = max((high / low) ** margin, 1.2)
        return low / factor, high * factor
    if not high > low:
        aside = max(0.05 * abs(high), 1e-9)
        return low - aside, high + aside
    return low - margin * (high - low), high + margin * (high - low)
