"""Picture and web page of an identification: signals, residuals, values, intervals."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from scipy.signal import periodogram

from ab_sim.base.presentation import number, titled
from ab_sim.identification.intervals import ProfilePoints
from ab_sim.identification.result import Identification, RecordingFit, share_words, shown_unit
from ab_sim.show.page import escaped, panel_html, write_page
from ab_sim.show.panels import TIME, Panel, PanelLine
from ab_sim.show.picture import draw_panel
from ab_sim.show.saved import ResultFigure
from ab_sim.show.styles import BLUE, GREY, RUN, SERIES, VERMILION

_POINTS = 3000
"""Largest number of points of a curve; longer curves are reduced to their extremes."""
QUANTILE = 3.84
"""Rise of the sum of squares at the ends of a 95 % interval, in noise variances."""
SMOOTH = 120
"""Number of points of a profile's curve."""
_BINS = 200
"""Approximate number of bins of a residual spectrum."""
Rows = Sequence[Sequence[str]]
"""Cells of a table by row."""


def identification_page(identification: Identification, path: Path) -> None:
    """Write an identification as a self-contained web page.

    Parameters
    ----------
    identification
        Identification to show.
    path
        File to write, with the ending .html.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    write_page(
        path,
        f"{identification.before.name}: {identification.verdict}",
        "".join(_sections(identification)),
    )


def _sections(identification: Identification) -> Iterator[str]:
    """Yield the sections of the page as HTML."""
    yield _list([*identification.reasons, *identification.notes])
    yield "<h2>Values with 95 % intervals</h2>\n"
    yield _table(("", "value", "from", "to", "start", "interval by"), _value_rows(identification))
    if identification.knowledge.open:
        yield "<h2>Parameters that these recordings do not determine</h2>\n"
        yield _list(
            [
                f"{direction.words}. {direction.advice}."
                for direction in identification.knowledge.open
            ]
        )
    if identification.tried:
        yield "<h2>Missing effects, tried one by one</h2>\n"
        yield _table(("tried", "explains", "Ljung-Box z with it"), _tried_rows(identification))
    if identification.proposals:
        yield "<h2>Proposed recordings</h2>\n"
        heads = ("recording", "how", "widest half interval now", "with it", "determines")
        yield _table(heads, _proposal_rows(identification))
    for comparison in identification.comparisons:
        yield f"<h2>{escaped(_recording(comparison))}</h2>\n"
        yield from map(_division, _panels(comparison))
    if identification.intervals.profiles:
        yield "<h2>Profiles: rise of the sum of squares with one value, others refitted</h2>\n"
        yield from map(_division, map(_profile, identification.intervals.profiles))
    if len(identification.intervals.names) > 1:
        yield "<h2>Correlations of the fitted values</h2>\n"
        count = len(identification.intervals.names)
        yield _table(("", *map(str, range(1, count + 1))), _correlations(identification))


def _list(texts: Sequence[str]) -> str:
    return "<ul>" + "".join(f"<li>{escaped(text)}</li>\n" for text in texts) + "</ul>\n"


def _table(heads: Sequence[str], rows: Rows) -> str:
    head = "".join(f"<th>{escaped(name)}</th>" for name in heads)
    body = "".join(
        "<tr>" + "".join(f"<td>{escaped(cell)}</td>" for cell in row) + "</tr>\n" for row in rows
    )
    return f"<table><tr>{head}</tr>\n{body}</table>\n"


def _value_rows(identification: Identification) -> Rows:
    """Return a row per estimate: name, value, interval, start, and origin of the interval."""
    return [
        (
            titled(estimate.name, estimate.unit),
            f"{estimate.value:.6g}", f"{estimate.low:.6g}", f"{estimate.high:.6g}",
            number(estimate.start),
            estimate.how + (", at its bound" if estimate.at_bound else ""),
        )
        for estimate in identification.estimates
    ]  # fmt: skip


def _tried_rows(identification: Identification) -> Rows:
    """Return a row per trial: name, fraction that it explains or its failure, and z."""
    return [
        (trial.name, trial.failure or f"{100 * trial.explains:.0f} %",
         "" if trial.failure else f"{trial.z:.1f}")
        for trial in identification.tried
    ]  # fmt: skip


def _proposal_rows(identification: Identification) -> Rows:
    return [
        (
            proposal.name,
            proposal.words,
            share_words(proposal.now),
            share_words(proposal.then),
            proposal.gains,
        )
        for proposal in identification.proposals
    ]


def _division(panel: Panel) -> str:
    """Return a panel and the panel's title as HTML."""
    return f"<div><h3>{escaped(panel.title)}</h3>{panel_html(panel)}</div>\n"


def _panels(recording_fit: RecordingFit) -> Iterator[Panel]:
    """Yield panels of a recording: signals by axis, residuals and their spectrum."""
    measured = recording_fit.measured
    time = measured.time
    unit, scale = shown_unit(measured.unit)
    signals, simulated, residuals = (
        scale * values
        for values in (measured.signals, recording_fit.simulated, recording_fit.residuals)
    )
    span = (0.0, float(time[-1]))
    for axis, direction in enumerate(measured.axes):
        name = f"{measured.kind} along {math.degrees(direction):.4g} deg"
        curves = (
            PanelLine("measured", *_decimated(time, signals[:, axis]), GREY, 2.0),
            PanelLine("fitted", *_decimated(time, simulated[:, axis]), RUN, 1.0),
        )
        most = 1.05 * float(np.nanmax(np.abs(signals[:, axis])))
        yield Panel("fit", name, TIME, f"[{unit}]", 1.0, curves, limits=(span, (-most, most)))
    lines = tuple(
        PanelLine(f"axis {axis + 1}", *_decimated(time, residuals[:, axis]), SERIES[axis], 1.0)
        for axis in range(residuals.shape[1])
    )
    most = 1.05 * float(np.nanmax(np.abs(residuals)))
    title = "residuals: measured minus fitted"
    limits = span, (-most, most)
    yield Panel("residuals", title, TIME, f"[{unit}]", 0.7, lines, limits=limits)
    yield _spectrum(recording_fit)


def _spectrum(recording_fit: RecordingFit) -> Panel:
    """Return the spectrum of residuals, which is level for white noise."""
    measured = recording_fit.measured
    unit, scale = shown_unit(measured.unit)
    rate = 1.0 / float(np.median(np.diff(measured.time)))
    curves = []
    for axis, column in enumerate(scale * recording_fit.residuals.T):
        frequencies, density = periodogram(column[np.isfinite(column)], rate)
        bins = max(1, len(density) // _BINS)
        whole = len(density) // bins * bins
        mean = density[:whole].reshape(-1, bins).mean(axis=1)
        middle = frequencies[:whole].reshape(-1, bins).mean(axis=1)
        root = np.sqrt(mean[1:])
        curves.append(PanelLine(f"axis {axis + 1}", middle[1:], root, SERIES[axis], 1.2))
    values = np.concatenate([curve.y for curve in curves])
    values = values[values > 0.0]
    ends = (float(values.min()), float(values.max())) if len(values) else (1e-12, 1.0)
    return Panel(
        "residual spectrum", "spectrum of the residuals, level for noise", "frequency [Hz]",
        f"[{unit}/sqrt(Hz)]", 0.8, tuple(curves), log=True,
        limits=((0.0, 0.5 * rate), (ends[0] / 2.0, ends[1] * 2.0)),
    )  # fmt: skip


def _profile(profile: ProfilePoints) -> Panel:
    """Return the panel of a parameter's profile, with the rise at the ends of the interval."""
    # The square root of a parabola is a straight line, so it is interpolated linearly.
    best = int(np.argmin(profile.rises))
    roots = np.sqrt(profile.rises) * np.sign(np.arange(len(profile.rises)) - best)
    values = np.linspace(min(profile.values), max(profile.values), SMOOTH)
    rises = np.interp(values, profile.values, roots) ** 2
    curve = PanelLine(profile.name, values, rises, BLUE, 1.8)
    return Panel(
        "profile", profile.name, profile.name, "rise [noise variance]", 0.8, (curve,),
        ((QUANTILE, "95 %"),),
        limits=((float(values.min()), float(values.max())), (0.0, 3.0 * QUANTILE)),
    )  # fmt: skip


def _correlations(identification: Identification) -> Rows:
    """Return a row of correlations per fitted parameter."""
    return [
        (f"{k}: {name}", *(f"{coefficient:.2f}" for coefficient in row))
        for k, (name, row) in enumerate(
            zip(identification.intervals.names, identification.intervals.correlation, strict=True),
            1,
        )
    ]


def _decimated(time: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return at most about ``_POINTS`` points of a curve, with all peaks."""
    if len(time) <= _POINTS:
        return time, values
    width = math.ceil(2 * len(time) / _POINTS)
    whole = len(time) // width * width
    parts = values[:whole].reshape(-1, width)
    with np.errstate(all="ignore"):
        ends = np.stack([np.nanmin(parts, axis=1), np.nanmax(parts, axis=1)], axis=1)
    at = time[:whole].reshape(-1, width)
    return at[:, [0, width // 2]].reshape(-1), ends.reshape(-1)


def drawn_identification(identification: Identification) -> ResultFigure:
    """Return the figure of measured and fitted signals, residuals, and intervals."""
    panels = [
        replace(panel, title=f"{_recording(comparison)}: {panel.title}")
        for comparison in identification.comparisons
        for panel in _panels(comparison)
    ]
    heights = [2.3 * panel.height for panel in panels]
    heights.append(0.6 + 0.3 * len(_shares(identification)))
    figure = ResultFigure(figsize=(10, 1.2 + sum(heights)), layout="constrained")
    *above, last = figure.subplots(len(heights), 1, height_ratios=heights, squeeze=False).ravel()
    figure.suptitle(f"{identification.before.name}: {identification.verdict}", fontsize=13)
    for axes, panel in zip(above, panels, strict=True):
        draw_panel(figure, axes, panel)
    _draw_intervals(last, identification)
    return figure


def _recording(recording_fit: RecordingFit) -> str:
    return recording_fit.measured.name + (", held out" if recording_fit.held_out else "")


def _shares(identification: Identification) -> list[tuple[str, float, float]]:
    """Return the name and the relative interval ends of each parameter of the scene."""
    return [
        (estimate.name, estimate.low / estimate.value - 1.0, estimate.high / estimate.value - 1.0)
        for estimate in identification.estimates
        if not estimate.per_recording
        and estimate.value
        and np.isfinite([estimate.low, estimate.high]).all()
    ]


def _draw_intervals(axes: Axes, identification: Identification) -> None:
    """Draw the interval of each of the scene's parameters, relative to the fitted value."""
    rows = _shares(identification)
    for place, (_, low, high) in enumerate(rows):
        axes.plot([100 * low, 100 * high], [place, place], color=VERMILION, lw=3)
    axes.set_yticks(range(len(rows)), [name for name, _, _ in rows], fontsize=8)
    axes.set_ylim(-0.7, len(rows) - 0.3)
    axes.invert_yaxis()
    axes.axvline(0.0, color=GREY, lw=1)
    axes.set_xlabel("95 % interval relative to the value [%]", fontsize=9)
    axes.grid(alpha=0.3, axis="x")
