"""An identification as one web page: measured and fitted signals, values, intervals."""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from scipy.signal import periodogram

from ab_sim.base.presentation import number, titled
from ab_sim.identification.intervals import ProfilePoints
from ab_sim.identification.result import Identification, RecordingFit, share_words, shown_unit
from ab_sim.show.figures.colours import BLUE, GREY, RUN, SERIES
from ab_sim.show.reports.grid import Limits
from ab_sim.show.reports.page import panel_html, shown, write_page
from ab_sim.show.reports.panels import TIME, Panel, PanelLine

POINTS = 3000
"""Largest number of points of a curve; larger ones are drawn by their extremes."""
QUANTILE = 3.84
"""Rise of the sum of squares at the ends of an interval of 95 %, in units of noise."""
SMOOTH = 120
"""Number of points of a profile's curve."""
BINS = 200
"""Number of bins of a residual spectrum."""
Rows = Sequence[Sequence[str]]


def identification_page(found: Identification, path: Path) -> None:
    """Write a self-contained page.

    Args:
        found: the identification.
        path: file to write: .html.

    Raises:
        OSError: the file cannot be written.
    """
    write_page(path, f"{found.before.name}: {found.verdict}", "".join(_sections(found)))


def _sections(found: Identification) -> Iterator[str]:
    yield _list([*found.reasons, *found.notes])
    yield "<h2>Values and their intervals of 95 %</h2>\n"
    yield _table(("", "value", "from", "to", "began at", "interval by"), _value_rows(found))
    if found.knowledge.open:
        yield "<h2>What these recordings cannot tell</h2>\n"
        yield _list([f"{each.words}. {each.advice}." for each in found.knowledge.open])
    if found.tried:
        yield "<h2>What is missing, tried one by one</h2>\n"
        yield _table(("tried", "explains", "Ljung-Box z with it"), _tried_rows(found))
    if found.proposals:
        yield "<h2>What to record next</h2>\n"
        heads = ("recording", "how", "worst half interval now", "with it", "makes known")
        yield _table(heads, _proposal_rows(found))
    for each in found.comparisons:
        yield f"<h2>{shown(each.measured.name)}{', held out' if each.held_out else ''}</h2>\n"
        for panel, limits in _panels(each):
            yield _division(panel, limits)
    if found.intervals.profiles:
        yield "<h2>Profiles: the sum of squares as one value is moved and all others follow</h2>\n"
        for profile in found.intervals.profiles:
            yield _division(*_profile(profile))
    if len(found.intervals.names) > 1:
        yield "<h2>Correlations of the fitted values</h2>\n"
        count = len(found.intervals.names)
        yield _table(("", *map(str, range(1, count + 1))), _correlations(found))


def _list(texts: Sequence[str]) -> str:
    return "<ul>" + "".join(f"<li>{shown(text)}</li>\n" for text in texts) + "</ul>\n"


def _table(heads: Sequence[str], rows: Rows) -> str:
    head = "".join(f"<th>{shown(name)}</th>" for name in heads)
    body = "".join(
        "<tr>" + "".join(f"<td>{shown(cell)}</td>" for cell in row) + "</tr>\n" for row in rows
    )
    return f"<table><tr>{head}</tr>\n{body}</table>\n"


def _value_rows(found: Identification) -> Rows:
    return [
        (
            titled(each.name, each.unit),
            f"{each.value:.6g}", f"{each.low:.6g}", f"{each.high:.6g}", number(each.start),
            each.how + (", at its bound" if each.at_bound else ""),
        )
        for each in found.estimates
    ]  # fmt: skip


def _tried_rows(found: Identification) -> Rows:
    return [
        (each.name, each.failure or f"{100 * each.explains:.0f} %",
         "" if each.failure else f"{each.z:.1f}")
        for each in found.tried
    ]  # fmt: skip


def _proposal_rows(found: Identification) -> Rows:
    return [
        (each.name, each.words, share_words(each.now), share_words(each.then), each.gains)
        for each in found.proposals
    ]


def _division(panel: Panel, limits: Limits) -> str:
    return f"<div><h3>{shown(panel.title)}</h3>{panel_html(panel, limits)}</div>\n"


def _panels(each: RecordingFit) -> Iterator[tuple[Panel, Limits]]:
    measured = each.measured
    time = measured.time
    unit, scale = shown_unit(measured.unit)
    signals, simulated, left = (
        scale * values for values in (measured.signals, each.simulated, each.residuals)
    )
    span = (0.0, float(time[-1]))
    for axis, direction in enumerate(measured.axes):
        name = f"{measured.kind} along {math.degrees(direction):.4g} deg"
        curves = (
            PanelLine("measured", *_decimated(time, signals[:, axis]), GREY, 2.0),
            PanelLine("fitted", *_decimated(time, simulated[:, axis]), RUN, 1.0),
        )
        most = 1.05 * float(np.nanmax(np.abs(signals[:, axis])))
        yield Panel("fit", name, TIME, f"[{unit}]", 1.0, curves), (span, (-most, most))
    lines = tuple(
        PanelLine(f"axis {axis + 1}", *_decimated(time, left[:, axis]), SERIES[axis], 1.0)
        for axis in range(left.shape[1])
    )
    most = 1.05 * float(np.nanmax(np.abs(left)))
    title = "what is left: measured less fitted"
    yield Panel("left", title, TIME, f"[{unit}]", 0.7, lines), (span, (-most, most))
    yield _spectrum(each)


def _spectrum(each: RecordingFit) -> tuple[Panel, Limits]:
    """Return the spectrum of residuals, which is level for white noise."""
    measured = each.measured
    unit, scale = shown_unit(measured.unit)
    rate = 1.0 / float(np.median(np.diff(measured.time)))
    curves = []
    for axis, column in enumerate(scale * each.residuals.T):
        frequencies, density = periodogram(column[np.isfinite(column)], rate)
        bins = max(1, len(density) // BINS)
        whole = len(density) // bins * bins
        mean = density[:whole].reshape(-1, bins).mean(axis=1)
        middle = frequencies[:whole].reshape(-1, bins).mean(axis=1)
        root = np.sqrt(mean[1:])
        curves.append(PanelLine(f"axis {axis + 1}", middle[1:], root, SERIES[axis], 1.2))
    values = np.concatenate([curve.y for curve in curves])
    values = values[values > 0.0]
    ends = (float(values.min()), float(values.max())) if len(values) else (1e-12, 1.0)
    panel = Panel(
        "left spectrum", "spectrum of what is left; of noise it is level", "frequency [Hz]",
        f"[{unit}/sqrt(Hz)]", 0.8, tuple(curves), log=True,
    )  # fmt: skip
    return panel, ((0.0, 0.5 * rate), (ends[0] / 2.0, ends[1] * 2.0))


def _profile(profile: ProfilePoints) -> tuple[Panel, Limits]:
    # The root of a parabola is straight, so it is interpolated linearly.
    best = int(np.argmin(profile.rises))
    roots = np.sqrt(profile.rises) * np.sign(np.arange(len(profile.rises)) - best)
    values = np.linspace(min(profile.values), max(profile.values), SMOOTH)
    rises = np.interp(values, profile.values, roots) ** 2
    curve = PanelLine(profile.name, values, rises, BLUE, 1.8)
    panel = Panel(
        "profile", profile.name, profile.name, "rise [noise variance]", 0.8, (curve,),
        ((QUANTILE, "95 %"),),
    )  # fmt: skip
    return panel, ((float(values.min()), float(values.max())), (0.0, 3.0 * QUANTILE))


def _correlations(found: Identification) -> Rows:
    return [
        (f"{k}: {name}", *(f"{each:.2f}" for each in row))
        for k, (name, row) in enumerate(
            zip(found.intervals.names, found.intervals.correlation, strict=True), 1
        )
    ]


def _decimated(time: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return fewer points without hiding a peak."""
    if len(time) <= POINTS:
        return time, values
    width = math.ceil(2 * len(time) / POINTS)
    whole = len(time) // width * width
    parts = values[:whole].reshape(-1, width)
    with np.errstate(all="ignore"):
        ends = np.stack([np.nanmin(parts, axis=1), np.nanmax(parts, axis=1)], axis=1)
    at = time[:whole].reshape(-1, width)
    return at[:, [0, width // 2]].reshape(-1), ends.reshape(-1)
