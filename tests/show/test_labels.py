"""Labels beside panels: apart from each other, within the panel's height, near what they name."""

from pathlib import Path

import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ab_sim.analysis.modes import vibration_of
from ab_sim.scene import load_scene
from ab_sim.show.labels import Label, label_at_right, spread
from ab_sim.show.resting import drawn_campbell
from ab_sim.show.saved import save
from tests.show.collisions import SLACK, overlaps, written


def judged(axes: Axes) -> list[str]:
    """Labels of a drawn panel that are shown, from below; that they are well placed."""
    figure = axes.figure
    assert isinstance(figure, Figure)
    figure.draw_without_rendering()
    panel = axes.get_window_extent()
    boxes = [
        (text.get_text(), text.get_window_extent())
        for text in axes.texts
        if text.get_visible() and text.get_text()
    ]
    assert not list(overlaps(boxes))
    for text, box in boxes:
        assert panel.y0 - SLACK <= box.y0 and box.y1 <= panel.y1 + SLACK, text
        assert box.x1 <= figure.bbox.x1 + SLACK, text
    return [text for text, _ in sorted(boxes, key=lambda each: each[1].y0)]


@pytest.mark.parametrize("layout", [None, "constrained"])
@pytest.mark.parametrize("value", [-5.0, 0.0, 0.5, 1.0, 7.0])
def test_labels_at_one_place_stay_within_their_panel(value: float, layout: str | None) -> None:
    """At each edge too, and in panels that the layout makes lower than they were."""
    figure = Figure(figsize=(8, 6), layout=layout)
    for axes in figure.subplots(3, 1):
        axes.set_ylim(0, 1)
        axes.set_title("two\nlines", fontsize=20)
        label_at_right(axes, [Label(value, "one"), Label(value, "two\nlines"), Label(value, "3")])
        axes.set_xlabel("x")
    figure.subplots_adjust(right=0.9) if layout is None else None
    for axes in figure.axes:
        assert len(judged(axes)) == 3


def test_of_more_labels_than_there_is_room_for_the_last_are_counted() -> None:
    figure = Figure(figsize=(8, 2), layout="constrained")
    axes = figure.subplots()
    axes.set_ylim(0, 1)
    label_at_right(axes, [Label(0.01 * k, f"label {k}") for k in range(60)])
    *rest, last = judged(axes)[::-1]
    assert last == f"and {60 - len(rest)} more" and 3 < len(rest) < 60
    assert rest[::-1] == [f"label {k}" for k in range(len(rest))]


def test_limits_and_scale_may_change_after_labelling() -> None:
    axes = Figure(figsize=(8, 4), layout="constrained").subplots()
    label_at_right(axes, [Label(10.0, "ten"), Label(1000.0, "thousand")])
    axes.set_yscale("log")
    axes.set_ylim(1.0, 1e4)
    assert judged(axes) == ["ten", "thousand"]
    panel, (ten, thousand) = axes.get_window_extent(), axes.texts[:2]
    for text, share in ((ten, 0.25), (thousand, 0.75)):
        box = text.get_window_extent()
        assert 0.5 * (box.y0 + box.y1) == pytest.approx(panel.y0 + share * panel.height, abs=2)


def test_what_has_room_is_not_moved() -> None:
    assert spread([2.0, 5.0], [2.0, 2.0], 10.0) == [2.0, 5.0]
    assert spread([5.0, 5.0], [2.0, 2.0], 10.0) == [4.0, 6.0]
    assert spread([0.0, 0.0, 9.0, 10.0], [2.0] * 4, 10.0) == [1.0, 3.0, 7.0, 9.0]


def test_frequencies_of_many_modes_stay_beside_their_panel(
    tmp_path: Path, drawn: list[Figure]
) -> None:
    save(drawn_campbell(vibration_of(load_scene("packed-balls"))), tmp_path / "figure.png", 110)
    assert judged(drawn[0].axes[0])
    assert not list(overlaps(written(drawn[0])))
