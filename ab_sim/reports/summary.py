"""What runs come to, as rows of text: for tables on the terminal and on pages."""

import math
from collections.abc import Callable, Sequence

from ab_sim.analysis import Merits
from ab_sim.analysis.merits import BAND, FLOOR, LAST
from ab_sim.conventions import NOTATION
from ab_sim.drive.overlap import overlaps_text
from ab_sim.reports.gather import RunData
from ab_sim.reports.panels import whirl_scale
from ab_sim.reports.wording import (
    angles_text,
    circulating_text,
    final_text,
    in_band_text,
    milli_text,
    number_text,
    peak_text,
)

CAPTION = (
    f"Final: root mean square over the last {100 * LAST:g} % of the run. Band: +-{100 * BAND:g} % "
    f"of final W, at least +-{100 * FLOOR:g} % of M0 e/M. Vibration: over the same stretch, what "
    "is constant left out; once per turn: the share of its power that turns with the spindle or "
    f"against it. {NOTATION}."
)

Row = tuple[str, list[str]]


def summary_rows(runs: Sequence[RunData]) -> list[Row]:
    """Labels, each with a cell for every run; what no run has is left out."""
    rows = [(label, [tell(data) for data in runs]) for label, tell in _TOLD]
    return [(label, cells) for label, cells in rows if any(cell != "-" for cell in cells)]


def _judged(tell: Callable[[Merits, float, str], str]) -> Callable[[RunData], str]:
    def cell(data: RunData) -> str:
        if data.merits is None:
            return "-"
        _, unit, scale = whirl_scale(data)
        return tell(data.merits, scale, "e" if unit == "1" else unit)

    return cell


def _scene(data: RunData) -> str:
    return "-" if data.scene is None else data.scene.name


def _samples(data: RunData) -> str:
    extent = data.run.extent
    missing = f", {extent.missing} missing at {extent.gaps} places" if extent.missing else ""
    return f"{extent.rows}{missing}"


def _events(data: RunData) -> str:
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
    first, last = data.run.extent.first[1], data.run.extent.last[1]
    return f"{last - first:.4g} s" + (f", from {first:.4g} s on" if first else "")


def _speed(data: RunData) -> str:
    if "speed" not in data.curves.channels:
        return "-"
    speed = float(data.curves.curve("speed")[1][-1])
    return f"{speed:.4g} rad/s ({30.0 * speed / math.pi:.5g} 1/min)"


def _peak(merits: Merits, scale: float, unit: str) -> str:
    value, _, when = peak_text(merits, scale).partition(" ")
    return f"{value} {unit} {when}"


def _final(merits: Merits, scale: float, unit: str) -> str:
    value, comma, changing = final_text(merits, scale).partition(",")
    return f"{value} {unit}{comma}{changing}"


_TOLD: tuple[tuple[str, Callable[[RunData], str]], ...] = (
    ("scene", _scene),
    ("duration", _duration),
    ("final speed", _speed),
    ("peak W", _judged(_peak)),
    ("final W", _judged(_final)),
    ("in the band", _judged(in_band_text)),
    ("residual unbalance", _judged(lambda m, *_: number_text(m.residual_unbalance))),
    ("residual couple", _judged(lambda m, *_: number_text(m.residual_couple))),
    ("peak tilt [mrad]", _judged(lambda m, *_: milli_text(m.peak_tilt))),
    ("final tilt [mrad]", _judged(lambda m, *_: milli_text(m.final_tilt))),
    ("final ball angles", _judged(lambda m, *_: angles_text(m))),
    ("balls circulate", _judged(lambda m, *_: circulating_text(m))),
    ("balls overlap", _judged(lambda m, *_: overlaps_text(m.overlaps) if m.overlaps else "-")),
    ("vibration, rms", _vibration),
    ("once per turn", _share),
    ("samples", _samples),
    ("events", _events),
    ("real-time factor", _factor),
)
