"""Results of runs as rows of text, for tables in the terminal and on pages."""

import math
from collections.abc import Callable, Iterator, Sequence

from ab_sim.analysis.metrics import BAND, FLOOR, reported_metrics
from ab_sim.analysis.metrics.metric import DEFAULT_UNITS, NO, NOTHING, Display
from ab_sim.analysis.metrics.metric import Row as MetricRow
from ab_sim.base.presentation import LAST, NOTATION
from ab_sim.show.gather import RunData
from ab_sim.show.panels import whirl_scale

CAPTION = (
    f"Final: root mean square over the last {100 * LAST:g} % of the run. Band: +-{100 * BAND:g} % "
    f"of final W, at least +-{100 * FLOOR:g} % of M0 e/M. Vibration: over the same stretch, "
    "without its mean; once per turn: the share of its power that turns with the spindle or "
    f"against it. {NOTATION}."
)

Row = tuple[str, list[str]]
"""Row of a table: label, and one cell per run."""


def summary_rows(runs: Sequence[RunData]) -> list[Row]:
    """Return rows of a label and a cell for each run, without rows that are empty for all runs."""
    rows = [(label, [cell(data) for data in runs]) for label, cell in _labels_and_cells()]
    return [(label, cells) for label, cells in rows if any(cell != NOTHING for cell in cells)]


def _labels_and_cells() -> Iterator[tuple[str, Callable[[RunData], str]]]:
    """Yield each row's label, and the function that returns the row's cell for a run."""
    yield from (("scene", _scene), ("duration", _duration), ("final speed", _speed))
    for metric in reported_metrics():
        if metric.row is not None and metric.row.in_reports:
            yield metric.row.head(DEFAULT_UNITS), _metric_cell(metric.row)
    yield "final W / without balls", _share_of_whirl
    yield from (("vibration, rms", _vibration), ("once per turn", _share))
    yield from (("samples", _samples), ("log entries", _log_entries), ("real-time factor", _factor))


def _metric_cell(row: MetricRow) -> Callable[[RunData], str]:
    """Return the function that returns a metric's cell; empty if it does not apply to a run."""

    def cell(data: RunData) -> str:
        if data.metrics is None:
            return NOTHING
        text = row.text(data.metrics, _display(data))
        return NOTHING if text == NO else text

    return cell


def _display(data: RunData) -> Display:
    """Return the unit of the whirl in a run's cells: e, or mm without an eccentricity."""
    _, unit, factor = whirl_scale(data)
    unit = "e" if unit == "1" else unit
    return Display(factor, unit, "W", f" {unit}")


def _share_of_whirl(data: RunData) -> str:
    other = data.final_without_balls
    if data.metrics is None or not other:
        return NOTHING
    return f"{data.metrics.final_whirl / other:.3g}"


def _scene(data: RunData) -> str:
    return "-" if data.scene is None else data.scene.name


def _samples(data: RunData) -> str:
    extent = data.run.extent
    missing = f", {extent.missing} missing at {extent.gaps} places" if extent.missing else ""
    return f"{extent.rows}{missing}"


def _log_entries(data: RunData) -> str:
    events = data.run.notes.events
    bad = sum(event.level not in ("INFO", "DEBUG", "TRACE") for event in events)
    return f"{len(events)}" + (f", {bad} of them warnings or errors" if bad else "")


def _factor(data: RunData) -> str:
    factors = data.real_time_factors
    if len(factors) == 0:
        return "-"
    return f"{factors.mean():.3f}, at least {factors.min():.3f}"


def _vibration(data: RunData) -> str:
    rms = data.vibration.rms
    return "-" if rms is None else f"{rms:.3g} m/s^2 ({data.vibrating})"


def _share(data: RunData) -> str:
    share = data.vibration.share
    return "-" if share is None else f"{100 * share:.2f} %"


def _duration(data: RunData) -> str:
    first, last = data.run.extent.first.time, data.run.extent.last.time
    return f"{last - first:.4g} s" + (f", from {first:.4g} s on" if first else "")


def _speed(data: RunData) -> str:
    if "speed" not in data.curves.channels:
        return "-"
    speed = float(data.curves.curve("speed")[1][-1])
    return f"{speed:.4g} rad/s ({30.0 * speed / math.pi:.5g} 1/min)"
