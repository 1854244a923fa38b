"""Panels of recorded runs, independent of the renderer, and the layout of runs side by side."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ab_sim.show.curves import in_degrees
from ab_sim.show.gather import TURNS, RunData
from ab_sim.show.run import OPPOSITE
from ab_sim.show.styles import (
    COMMANDED,
    DASHES,
    RUN,
    SERIES,
    SKY,
    VERMILION,
    WITHOUT_BALLS,
    ball_styles,
)

_KEYS = (
    "speed", "whirl", "force", "angles", "tilt", "torque", "orbit", "last orbit", "spectrum",
    "waterfall",
)  # fmt: skip
"""Keys of panels, from top to bottom."""
TIME = "time [s]"
"""Title of the horizontal axis of panels over time; panels with this title share the axis."""
_DASHED = DASHES[1]
ORDERS = {1: VERMILION, 2: SKY}
"""Colours of the lines at multiples of the spindle frequency, by multiple."""
_WATERFALL_DECADES = 4.0
"""Range of a waterfall below the largest amplitude [decades]; smaller values look alike."""
_LEAST = 1e-4
"""Fraction of the peak below which the whirl is not drawn."""
_SPECTRUM_LEAST = 1e-6
"""Fraction of the largest density below which a density is not drawn."""
COLUMNS = 300
"""Largest number of columns of a waterfall."""
LEAST_HEIGHT = 0.1
"""Fraction of the height of shared axes that each panel's curves must fill; otherwise the panels
have separate vertical axes."""
Cells = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Cells of a map: x of the centres, y of the centres, and values."""
Limits = tuple[tuple[float, float], tuple[float, float]]
"""Limits of the horizontal and of the vertical axis."""


@dataclass(frozen=True)
class PanelLine:
    """Curve of a panel, in the units of the panel's axes."""

    name: str
    x: np.ndarray
    y: np.ndarray
    colour: str
    width: float = 1.3
    """Width of the line [pt]."""
    dashes: tuple[float, ...] = ()
    """Alternating lengths of dashes and gaps, in line widths; empty for a solid line."""


@dataclass(frozen=True)
class Cloud:
    """Points coloured by time."""

    x: np.ndarray
    y: np.ndarray
    time: np.ndarray


@dataclass(frozen=True)
class Heat:
    """Map of values, NaN where missing; x and y are the centres of its cells."""

    x: np.ndarray
    y: np.ndarray
    values: np.ndarray
    label: str


@dataclass(frozen=True)
class Panel:
    """Content of one pair of axes; panels of several runs with the same key share limits."""

    key: str
    """Kind of the panel, one of ``_KEYS`` in a report."""
    title: str
    across: str
    """Title of the horizontal axis, with the unit."""
    up: str
    """Title of the vertical axis, with the unit."""
    height: float = 1.0
    """Height, as a multiple of a usual panel's."""
    curves: tuple[PanelLine, ...] = ()
    levels: tuple[tuple[float, str], ...] = ()
    """Horizontal lines: position on the vertical axis, and name."""
    cloud: Cloud | None = None
    heat: Heat | None = None
    log: bool = False
    """True if the vertical axis is logarithmic."""
    equal: bool = False
    """True if both axes have the same scale."""
    note: str = ""
    """Reason for an empty panel."""
    limits: Limits = (0.0, 1.0), (0.0, 1.0)


def panels_of(data: RunData) -> list[Panel]:
    """Return all panels of a run, from top to bottom."""
    return [panel for panel in _panels(data) if panel.curves or panel.cloud or panel.note]


def _panels(data: RunData) -> Iterator[Panel]:
    """Yield all kinds of panels for which a run has data; some are empty."""
    have = data.curves.channels
    whirl, unit, scale = whirl_scale(data)
    speeds = [
        PanelLine("commanded", *data.curves.curve("command"), COMMANDED, 0.9, _DASHED)
        if "command" in have
        else None,
        PanelLine("spindle", *data.curves.curve("speed"), RUN, 1.8) if "speed" in have else None,
    ]
    critical = None if data.scene is None else data.scene.critical_speed
    levels = () if critical is None else ((critical, "critical speed"),)
    drawn = tuple(curve for curve in speeds if curve)
    yield Panel("speed", "Spindle speed", TIME, "speed [rad/s]", 0.8, drawn, levels)
    if "whirl" in have:
        whirls = [PanelLine("this run", *data.curves.curve("whirl"), RUN)]
        if data.without_balls is not None:
            curve = data.without_balls.curve("whirl")
            whirls.insert(0, PanelLine("without balls", *curve, WITHOUT_BALLS))
        most = max(float(line.y.max(initial=0.0)) for line in whirls)
        title, up = "Whirl radius of the deck", f"{whirl} [{unit}]"
        if most > 0:
            curves = tuple(
                replace(line, y=np.where(line.y > _LEAST * most, scale * line.y, np.nan))
                for line in whirls
            )
            yield Panel("whirl", title, TIME, up, 1.2, curves, log=True)
        else:
            yield Panel("whirl", title, TIME, up, 1.2, note="the deck does not move")
    yield from _of_balls(data)
    yield from _tilt(data)
    if "motor_torque" in have:
        torque = PanelLine("torque", *data.curves.curve("motor_torque"), RUN)
        yield Panel("torque", "Motor torque", TIME, "torque [N m]", 0.7, (torque,))
    yield from _orbits(data)
    yield from _spectra(data)


def whirl_scale(data: RunData) -> tuple[str, str, float]:
    """Return name and unit of the whirl in pictures, and the factor from m to the unit."""
    e = data.eccentricity
    return ("W/e", "1", 1.0 / e) if e > 0 else ("W", "mm", 1e3)


def _of_balls(data: RunData) -> Iterator[Panel]:
    """Yield the panels of driving forces on the balls and of ball angles."""
    forces = [name for name in data.curves.channels if name.startswith("force_")]
    angles = [name for name in data.curves.channels if name.startswith("ball_")]
    if forces:
        curves = _ball_lines(data, forces)
        title = "Driving force on the balls"
        yield Panel("force", title, TIME, "force [N]", 0.8, curves)
    if angles:
        curves = tuple(replace(line, y=in_degrees(line.y)) for line in _ball_lines(data, angles))
        levels = ((OPPOSITE, "opposite the unbalance"),)
        yield Panel(
            "angles", "Balls, from the unbalance", TIME, "ball angle [deg]", 1.0, curves, levels
        )


def _ball_lines(data: RunData, names: list[str]) -> tuple[PanelLine, ...]:
    """Return a curve for each ball from the channels ``names``, in the styles of all pictures."""
    return tuple(
        PanelLine(
            f"ball {ball}", *data.curves.curve(name), style["color"], float(style["lw"]),
            style["dashes"],
        )
        for ball, (name, style) in enumerate(zip(names, ball_styles(len(names)), strict=True))
    )  # fmt: skip


def _tilt(data: RunData) -> Iterator[Panel]:
    """Yield the panel of the deck's tilt, for a deck in space."""
    if "alpha" not in data.curves.channels:
        return
    names = {"alpha": "about x", "beta": "about y", "gamma": "about the shaft"}
    curves = []
    for (name, axis), colour in zip(names.items(), SERIES, strict=True):
        time, values = data.curves.curve(name)
        curves.append(PanelLine(f"{name}, {axis}", time, 1e3 * values, colour))
    yield Panel("tilt", "Tilt of the deck", TIME, "tilt [mrad]", 0.8, tuple(curves[::-1]))


def _orbits(data: RunData) -> Iterator[Panel]:
    """Yield the panels of the deck's path: of the whole run, and of the last turns."""
    if len(data.orbit):
        time, x, y = data.orbit.T
        cloud = Cloud(1e3 * x, 1e3 * y, time)
        yield Panel(
            "orbit", "Path of the deck, whole run", "x [mm]", "y [mm]", 1.8, cloud=cloud, equal=True
        )
    if len(data.last_orbit):
        time, x, y = data.last_orbit.T
        cloud = Cloud(1e3 * x, 1e3 * y, time)
        title = f"Path of the deck, last {TURNS} turns of the spindle"
        if time[0] == data.run.extent.first.time:
            title = f"Path of the deck; the spindle made less than {TURNS} turns"
        yield Panel("last orbit", title, "x [mm]", "y [mm]", 1.8, cloud=cloud, equal=True)


def _spectra(data: RunData) -> Iterator[Panel]:
    """Yield the panels of spectrum and waterfall; without data, a note states why one is empty."""
    title = f"Vibration, last tenth of the run: {data.vibrating}"
    density, frequencies = data.spectrum.density, data.spectrum.frequencies
    if len(density):
        # The constant part at 0 is left out. Values below the rounding error of the largest one
        # are gaps, because a line there would look like data.
        root = np.sqrt(density[1:])
        root = np.where(root > _SPECTRUM_LEAST * root.max(), root, np.nan)
        curve = PanelLine("spectrum", frequencies[1:], root, RUN, 1.0)
        up = "density [(m/s^2)/sqrt(Hz)]"
        curves = (curve, *_orders_at(data, root)) if np.isfinite(root).any() else ()
        note = "" if curves else "there is no vibration"
        yield Panel("spectrum", title, "frequency [Hz]", up, 1.0, curves, log=True, note=note)
    else:
        note = "too few samples for a spectrum"
        yield Panel("spectrum", title, "frequency [Hz]", "", 1.0, note=note)
    fall = data.waterfall
    title = "Largest vibration over frequency and spindle speed"
    across, up = "frequency [Hz]", "spindle speed [rad/s]"
    low, high = fall.edges[[0, -1]]
    if fall.amplitudes.size and high - low > 0.02 * high:
        values = 20.0 * np.log10(np.maximum(fall.amplitudes, 1e-300))
        values = np.maximum(values, np.nanmax(values) - 20.0 * _WATERFALL_DECADES)
        middles = 0.5 * (fall.edges[1:] + fall.edges[:-1])
        top = min(fall.frequencies[-1], 8.0 * high / (2.0 * math.pi))
        visible = fall.frequencies <= top
        label = "amplitude [dB of 1 m/s^2]"
        heat = Heat(*_pooled(fall.frequencies[visible], middles, values[:, visible]), label)
        orders = []
        for order, colour in ORDERS.items():
            ends = np.array([low, min(high, 2.0 * math.pi * top / order)])
            line = order * ends / (2.0 * math.pi)
            orders.append(PanelLine(f"{order}x", line, ends, colour, 1.5, _DASHED))
        yield Panel("waterfall", title, across, up, 1.4, tuple(orders), heat=heat)
    else:
        note = "the spindle's speed hardly changes, or there are too few samples"
        yield Panel("waterfall", title, across, up, 0.6, note=note)


def _orders_at(data: RunData, root: np.ndarray) -> Iterator[PanelLine]:
    """Yield lines at one and two times the final spindle frequency, as high as ``root``."""
    if "speed" not in data.curves.channels:
        return
    speed = abs(float(data.curves.curve("speed")[1][-1])) / (2.0 * math.pi)
    drawn = root[np.isfinite(root)]
    ends = np.array([drawn.min(), drawn.max()])
    for order, colour in ORDERS.items():
        if 0 < order * speed < data.spectrum.frequencies[-1]:
            line = np.full(2, order * speed)
            yield PanelLine(f"{order}x, {order * speed:.4g} Hz", line, ends, colour, 1.5, _DASHED)


def _pooled(x: np.ndarray, y: np.ndarray, values: np.ndarray) -> Cells:
    """Return a map with at most ``COLUMNS`` columns; each is the largest of its neighbours.

    Parameters
    ----------
    x
        Centres of the columns.
    y
        Centres of the rows.
    values
        Values, shape (rows, columns).
    """
    many = -(-len(x) // COLUMNS)
    starts = np.arange(0, len(x), many)
    return (
        x[np.minimum(starts + many // 2, len(x) - 1)],
        y,
        np.fmax.reduceat(values, starts, axis=1),
    )


@dataclass(frozen=True)
class Grid:
    """Panels in a column for each run and a row for each kind of panel."""

    names: tuple[str, ...]
    rows: tuple[tuple[Panel | None, ...], ...]
    """Panels with shared limits in each row, unless that would flatten a panel."""


def grid_of(names: Sequence[str], runs: Sequence[Sequence[Panel]]) -> Grid:
    """Lay out panels.

    Parameters
    ----------
    names
        Names of the runs.
    runs
        Panels of each run.
    """
    keys = [key for key in _KEYS if any(p.key == key for panels in runs for p in panels)]
    by_key = [{panel.key: panel for panel in panels} for panels in runs]
    rows = [[panels.get(key) for panels in by_key] for key in keys]
    drawn = [[panel for panel in row if panel is not None and not panel.note] for row in rows]
    joint = [_limits(row) for row in drawn]
    timed = [row and row[0].across == TIME for row in drawn]
    times = [
        edge for (across, _), over in zip(joint, timed, strict=True) if over for edge in across
    ]
    for at, over in enumerate(timed):
        if over:
            joint[at] = (min(times), max(times)), joint[at][1]
    return Grid(tuple(names), tuple(map(_with_limits, rows, drawn, joint)))


def _with_limits(
    row: Sequence[Panel | None], drawn: Sequence[Panel], shared: Limits
) -> tuple[Panel | None, ...]:
    """Return a row of panels with shared limits, or separate ones if a panel would be too flat.

    Parameters
    ----------
    row
        Panels of a kind, None for a run without it.
    drawn
        Panels of the row that are not empty.
    shared
        Limits that fit all of them.
    """
    flat = _flattens(drawn, shared)

    def place(panel: Panel) -> Panel:
        if panel.note or not flat:
            return replace(panel, limits=shared)
        limits = _separate_limits(panel, shared)
        return replace(panel, limits=limits, title=f"{panel.title} (own scale)")

    return tuple(panel and place(panel) for panel in row)


def _flattens(panels: Sequence[Panel], shared: Limits) -> bool:
    """Return whether with shared limits a panel's curves would be too flat to read."""
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
    """Return whether a curve or cloud of a panel varies by more than rounding."""
    values = [part.y[np.isfinite(part.y)] for part in (*panel.curves, panel.cloud) if part]
    return any(len(value) and np.ptp(value) > 1e-6 * np.abs(value).max() for value in values)


def _separate_limits(panel: Panel, shared: Limits) -> Limits:
    """Return the limits that fit a single panel, except a time axis, which stays shared."""
    across, up = _limits([panel])
    return (shared[0] if panel.across == TIME else across), up


def _limits(panels: Sequence[Panel]) -> Limits:
    """Return the limits that fit all curves, clouds, maps and levels of some panels."""
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
    """Return the ends of an axis: the range of all finite values, with a relative margin."""
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
