"""Layout of panels of several runs, side by side on shared axes."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ab_sim.show.reports.panels import KEYS, TIME, Panel

Limits = tuple[tuple[float, float], tuple[float, float]]
"""Limits of the horizontal and of the vertical axis."""

LEAST_HEIGHT = 0.1
"""Share of the height of shared axes that each panel's curves must fill.

Otherwise the panels have separate vertical axes.
"""


@dataclass(frozen=True)
class Grid:
    """Panels in a column for each run and a row for each kind of panel."""

    names: tuple[str, ...]
    rows: tuple[tuple[Panel | None, ...], ...]
    limits: tuple[tuple[Limits, ...], ...]
    """Limits of the panels of each row: shared, unless that would flatten a panel."""
    own: tuple[bool, ...]
    """True if the panels of each row have separate vertical scales."""


def grid_of(names: Sequence[str], runs: Sequence[Sequence[Panel]]) -> Grid:
    """Lay out panels.

    Args:
        names: names of the runs.
        runs: panels of each run.
    """
    keys = [key for key in KEYS if any(p.key == key for panels in runs for p in panels)]
    by_key = [{panel.key: panel for panel in panels} for panels in runs]
    rows = tuple(tuple(panels.get(key) for panels in by_key) for key in keys)
    drawn = [[panel for panel in row if panel is not None and not panel.note] for row in rows]
    joint = [_limits(row) for row in drawn]
    timed = [row and row[0].across == TIME for row in drawn]
    times = [
        edge for (across, _), over in zip(joint, timed, strict=True) if over for edge in across
    ]
    for at, over in enumerate(timed):
        if over:
            joint[at] = (min(times), max(times)), joint[at][1]
    own_scales = tuple(_flattens(row, shared) for row, shared in zip(drawn, joint, strict=True))
    limits = tuple(
        tuple(_alone(panel, shared) if apart and panel else shared for panel in row)
        for row, shared, apart in zip(rows, joint, own_scales, strict=True)
    )
    return Grid(tuple(names), rows, limits, own_scales)


def grid_title(panel: Panel, has_own_scale: bool) -> str:
    """Return the title of a panel, with a note if its scale differs from its neighbours'."""
    return f"{panel.title} (own scale)" if has_own_scale and not panel.note else panel.title


def _flattens(panels: Sequence[Panel], shared: Limits) -> bool:
    """Return whether shared axes would make a panel's curves too flat to read."""
    if len(panels) < 2 or panels[0].heat is not None:
        return False  # The vertical axis of a map is the speed, which is compared.

    def height(limits: Limits, log: bool) -> float:
        low, high = limits[1]
        return math.log(high / low) if log else high - low

    log = any(panel.log for panel in panels)
    whole = height(shared, log)
    # A constant curve, such as a held speed, is flat on its own axes, too.
    heights = [height(_limits([panel]), log) for panel in panels if _varies(panel)]
    return any(height < LEAST_HEIGHT * whole for height in heights)


def _varies(panel: Panel) -> bool:
    values = [part.y[np.isfinite(part.y)] for part in (*panel.curves, panel.cloud) if part]
    return any(len(value) and np.ptp(value) > 1e-6 * np.abs(value).max() for value in values)


def _alone(panel: Panel, shared: Limits) -> Limits:
    """Return a panel's own limits, with the shared time axis."""
    if panel.note:
        return shared
    across, up = _limits([panel])
    return (shared[0] if panel.across == TIME else across), up


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
