"""Panels side by side: what their axes span, and what is drawn on them."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from ab_sim.show.blocks import Envelope, PowerSpectrum
from ab_sim.show.panels import LEAST_HEIGHT, TIME, Panel, PanelLine, grid_of, panels_of
from ab_sim.show.picture import drawn_report
from ab_sim.show.saved import save
from tests.show.collisions import overlaps, written

T = np.linspace(0.0, 2.0, 201)


def panel(values: np.ndarray, time: np.ndarray = T, log: bool = False) -> list[Panel]:
    curve = PanelLine("ball 0", time, values, "k")
    return [Panel("angles", "Balls", TIME, "ball angle [deg]", curves=(curve,), log=log)]


def share(axes: Any) -> float:
    """Of its axes' height that a panel's curve fills."""
    low, high = axes.get_ylim()
    return float(np.ptp(axes.lines[0].get_ydata())) / (high - low)


@pytest.mark.parametrize(("wild", "own"), [(1e5, True), (300.0, False)])
def test_one_wild_run_flattens_no_other(
    wild: float, own: bool, tmp_path: Path, drawn: list[Figure]
) -> None:
    runs = [panel(90.0 * np.sin(T)), panel(wild * np.sin(T), 2.0 * T), panel(0.0 * T)]
    save(drawn_report(grid_of("abc", runs)), tmp_path / "report.png", 100)
    calm, other, still = drawn[0].axes
    assert share(calm) > LEAST_HEIGHT and share(other) > LEAST_HEIGHT
    assert (calm.get_ylim() != other.get_ylim()) == own
    assert calm.get_xlim() == other.get_xlim() == still.get_xlim() == (0.0, 4.0)
    assert all(("own scale" in axes.get_title()) == own for axes in drawn[0].axes)
    for axes, name in zip(drawn[0].axes, "abc", strict=True):
        (label,) = (text for text in axes.texts if text.get_text() == name)
        extent, box = label.get_window_extent(), axes.get_window_extent()
        assert box.x0 < extent.x0 and extent.x1 < box.x1, "the run's name is above its panel"
    assert not list(overlaps(written(drawn[0])))


def test_a_legend_covers_no_curve(tmp_path: Path, drawn: list[Figure]) -> None:
    """However many entries it has, and in whichever column."""
    time = np.linspace(0.0, 2.0, 50)
    curves = tuple(PanelLine(f"ball {k}", time, np.sin(time + 7 * k), "k") for k in range(8))
    levels = ((0.5, "opposite the unbalance"),)
    made = Panel("angles", "Balls", TIME, "ball angle [deg]", 0.8, curves, levels)
    save(drawn_report(grid_of("ab", [[made], [made]])), tmp_path / "report.png", 100)
    drawn[0].draw_without_rendering()
    legends = [axes.get_legend().get_window_extent() for axes in drawn[0].axes]
    panels = [axes.get_window_extent() for axes in drawn[0].axes]
    assert not any(legend.overlaps(box) for legend in legends for box in panels)
    for legend in legends:
        assert drawn[0].bbox.contains(legend.x0, legend.y0)
        assert drawn[0].bbox.contains(legend.x1, legend.y1)
    assert all(box.width > 0.3 * drawn[0].bbox.width for box in panels), "room is left to see them"
    assert not list(overlaps(written(drawn[0])))


def test_a_curve_of_zeros_has_an_axis() -> None:
    ((still,),) = grid_of("a", [panel(0.0 * T)]).rows
    assert still is not None
    low, high = still.limits[1]
    assert low < 0.0 < high


def test_logarithmic_axes_stay_shared() -> None:
    runs = [panel(np.exp(-T), log=True), panel(100.0 * np.exp(-T), log=True)]
    ((first, second),) = grid_of("ab", runs).rows
    assert first is not None and second is not None
    assert first.limits == second.limits


def test_a_spectrum_has_no_floor_that_looks_like_data() -> None:
    """Of a sine, what is far below it is not drawn at all; of nothing, nothing."""
    for size, shown in ((1.0, True), (0.0, False)):
        time = np.arange(20_000) * 1e-3
        spectrum = PowerSpectrum(len(time))
        wave = size * np.sin(2.0 * np.pi * 125.0 * time)[:, None]
        spectrum.take(np.arange(len(time)), time, wave)
        (found,) = (each for each in panels_of(data(spectrum)) if each.key == "spectrum")
        assert bool(found.curves) == shown and bool(found.note) != shown
        if shown:
            y = found.curves[0].y
            y = y[np.isfinite(y)]
            least = y == y.min()
            assert least.sum() == 1, "a flat stretch"
            assert len(y) < len(found.curves[0].y)


def data(spectrum: PowerSpectrum) -> Any:
    """As ``gather`` gives it, of a run of which there is a vibration only."""
    fall = SimpleNamespace(amplitudes=np.empty((1, 0)), edges=np.array([0.0, 0.0]))
    none = np.empty((0, 3))
    return SimpleNamespace(
        curves=Envelope([], 0), scene=None, eccentricity=0.0, orbit=none, last_orbit=none,
        spectrum=spectrum, waterfall=fall, vibrating="deck",
    )  # fmt: skip
