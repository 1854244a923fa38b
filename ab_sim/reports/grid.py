"""Panels of several runs, side by side on the same axes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ab_sim.reports.panels import KEYS, TIME, Panel

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
    keys = [key for key in KEYS if any(p.key == key for panels in runs for p in panels)]
    by_key = [{panel.key: panel for panel in panels} for panels in runs]
    rows = tuple(tuple(panels.get(key) for panels in by_key) for key in keys)
    drawn = [[panel for panel in row if panel is not None and not panel.note] for row in rows]
    limits = [_limits(row) for row in drawn]
    timed = [row and row[0].across == TIME for row in drawn]
    times = [
        edge for (across, _), over in zip(limits, timed, strict=True) if over for edge in across
    ]
    for at, over in enumerate(timed):
        if over:
            limits[at] = (min(times), max(times)), limits[at][1]
    return Grid(tuple(names), rows, tuple(limits))


def _limits(panels: Sequence[Panel]) -> Limits:
    across, up = [], []
    for panel in panels:
        for part in (*panel.curves, panel.cloud, panel.heat):
            if part is not None:
                across.append(part.x)
                up.append(part.y)
        up.append(np.array([value for value, _ in panel.levels]))
    log = any(panel.log for panel in panels)
    equal = any(panel.equal for panel in panels)
    x, y = _span(across, 0.05 if equal else 0.0, False), _span(up, 0.05, log)
    if equal:
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
