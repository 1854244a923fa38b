"""What Rerun's viewer shows of a recording."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rerun.blueprint as rrb
from rerun.chunk import RrdReader

from ab_sim.record.recording import Recording
from ab_sim.record.recording.curves import FRAMES
from ab_sim.record.recording.layout import SAMPLES
from ab_sim.record.recording.views import PERIOD
from tests.recording.runs import cells, describe, plotted, record, run, still


def test_top_view_is_to_scale_with_y_upwards(tmp_path: Path) -> None:
    names, samples = run(3, step=PERIOD)
    col = {name: samples[:, names.index(name)] for name in names}
    record(tmp_path / "run.rrd", names, samples)
    shaft = np.array(cells(tmp_path / "run.rrd", "/above/rotor", "Transform3D:translation"))[:, 0]
    np.testing.assert_allclose(shaft[:, 0], 1e3 * col["x"], rtol=1e-6)
    np.testing.assert_allclose(shaft[:, 1], -1e3 * col["y"], rtol=1e-6)  # Rerun's y is down
    turn = np.array(cells(tmp_path / "run.rrd", "/above/rotor", "Transform3D:quaternion"))[:, 0]
    direction = np.exp(2j * np.arctan2(turn[:, 2], turn[:, 3]))
    np.testing.assert_allclose(direction, np.exp(-1j * col["angle"]), atol=1e-6)
    balls = np.array(cells(tmp_path / "run.rrd", "/above/rotor", "Points2D:positions"))
    for ball in range(2):
        theta = col[f"ball_{ball}_angle"]
        expected = 10.0 * np.column_stack([np.cos(theta), -np.sin(theta)])
        np.testing.assert_allclose(balls[:, ball], expected, atol=1e-5)


def test_whirl_is_the_logarithm_of_units_of_the_eccentricity(tmp_path: Path) -> None:
    names, samples = run(5)
    record(tmp_path / "run.rrd", names, samples)
    whirl = plotted(tmp_path / "run.rrd", SAMPLES, "whirl")[:, 0]
    expected = np.log10(np.hypot(samples[:, 5], samples[:, 6]) / 1e-4)
    np.testing.assert_allclose(whirl, expected, rtol=1e-6)


def test_whirl_without_a_logarithm_is_a_gap(tmp_path: Path) -> None:
    names, samples = run(5)
    samples[2, 5:7] = 0.0
    record(tmp_path / "run.rrd", names, samples)
    whirl = plotted(tmp_path / "run.rrd", SAMPLES, "whirl")[:, 0]
    assert np.isnan(whirl).tolist() == [False, False, True, False, False]


def test_vibration_is_shown_as_one_curve(tmp_path: Path) -> None:
    names, samples = run(5)
    record(tmp_path / "run.rrd", names, samples)
    sizes = plotted(tmp_path / "run.rrd", SAMPLES, "vector_lengths")[:, 0]
    ax, ay = (samples[:, names.index(name)] for name in ("ax", "ay"))
    np.testing.assert_allclose(sizes, np.hypot(ax, ay), rtol=1e-6)


def test_plots_of_scalars_hold_something_of_the_whole_run(tmp_path: Path) -> None:
    """Rerun gives each plot the span of its data, whatever its axis is linked to."""
    names, samples = run(700)
    path = tmp_path / "run.rrd"
    with Recording(path, description=describe()) as recording:
        for name in ("real_time_factor", "commands_received"):
            recording.scalar(name, 0.3, 1.0)
        recording.block(names, samples)
    reader = RrdReader(path)
    contents: dict[str, list[str]] = {}
    for blueprint in reader.blueprints():
        for chunk in reader.stream(store=blueprint).to_chunks():
            batch = chunk.to_record_batch()
            if "ViewContents:query" in batch.schema.names:
                contents[chunk.entity_path] = batch["ViewContents:query"].to_pylist()[0]
    beside = {query[1] for query in contents.values() if query[0].startswith("/run/")}
    assert beside == {FRAMES, SAMPLES}
    for entity, last in ((FRAMES, 690), (SAMPLES, 699)):
        times = [
            time
            for chunk in reader.stream().to_chunks()
            if chunk.entity_path == entity and not chunk.is_static
            for time in chunk.to_record_batch()["step"].to_pylist()
        ]
        assert (min(times), max(times)) == (0, last)


def test_a_balanced_rotor_has_no_division_by_zero(tmp_path: Path) -> None:
    names, samples = run(5)
    with Recording(tmp_path / "run.rrd", description=describe(eccentricity=0.0)) as recording:
        recording.block(names, samples)
    whirl = plotted(tmp_path / "run.rrd", SAMPLES, "whirl")[:, 0]
    expected = np.log10(1e3 * np.hypot(samples[:, 5], samples[:, 6]))
    np.testing.assert_allclose(whirl, expected, rtol=1e-6)


def test_every_ball_is_drawn_in_its_size_within_the_race(tmp_path: Path) -> None:
    """But one that covers another's middle is smaller, so that both are seen."""
    names, samples = run(3, step=PERIOD)
    path = tmp_path / "run.rrd"
    samples[:, names.index("ball_0_angle")] = 7.0
    samples[:, names.index("ball_1_angle")] = 7.0 + np.array([0.3, 0.1, 0.0])
    with Recording(path, description=describe(ball_radii=[1e-3, 2e-3])) as recording:
        recording.block(names, samples)
    apart, near, together = cells(path, "/above/rotor", "Points2D:radii")
    assert apart == pytest.approx([1.0, 2.0])
    assert together == pytest.approx([1.0, 0.62])
    assert near[0] == 1.0 and together[1] < near[1] < apart[1]
    wall = np.array(still(path, "/above/rotor/race", "LineStrips2D:strips")[0])
    np.testing.assert_allclose(np.hypot(*wall.T), 12.0, rtol=1e-6)


def blueprint_cells(path: Path, component: str) -> list[list[Any]]:
    """Values of a component in each layout of a file, in order."""
    reader = RrdReader(path)
    return [
        [
            value
            for chunk in reader.stream(store=store).to_chunks()
            for batch in [chunk.to_record_batch()]
            if component in batch.schema.names
            for (value,) in batch[component].to_pylist()
        ]
        for store in reader.blueprints()
    ]


def test_the_file_carries_its_layout(tmp_path: Path) -> None:
    record(tmp_path / "run.rrd", *run(5))
    assert len(RrdReader(tmp_path / "run.rrd").blueprints()) == 1


def test_a_file_opens_at_its_start_paused(tmp_path: Path) -> None:
    record(tmp_path / "run.rrd", *run(5))
    states = blueprint_cells(tmp_path / "run.rrd", "TimePanelBlueprint:play_state")
    assert states == [[rrb.components.PlayState.Paused.value]]


def test_one_that_is_watched_live_follows_and_is_paused_once_it_is_closed(tmp_path: Path) -> None:
    path = tmp_path / "run.rrd"
    with Recording(path, description=describe(), is_shown=True) as recording:
        recording.block(*run(5))
    states = blueprint_cells(path, "TimePanelBlueprint:play_state")
    kinds = rrb.components.PlayState
    assert sorted(states) == sorted([[kinds.Following.value], [kinds.Paused.value]])


def test_the_drive_s_page_is_a_grid_of_three(tmp_path: Path) -> None:
    """Of which Rerun makes three columns in a wide window, one in a narrow one."""
    record(tmp_path / "run.rrd", *run(5))
    reader = RrdReader(tmp_path / "run.rrd")
    (store,) = reader.blueprints()
    page = {}
    for chunk in reader.stream(store=store).to_chunks():
        batch = chunk.to_record_batch()
        if "ContainerBlueprint:display_name" in batch.schema.names:
            page = {name: batch[name].to_pylist()[-1] for name in batch.schema.names}
            if page["ContainerBlueprint:display_name"] == ["Drive"]:
                break
    assert page["ContainerBlueprint:container_kind"] == [rrb.components.ContainerKind.Grid.value]
    assert len(page["ContainerBlueprint:contents"]) == 3
    assert "ContainerBlueprint:grid_columns" not in page


def test_views_follow_the_theme(tmp_path: Path) -> None:
    record(tmp_path / "run.rrd", *run(5))
    assert blueprint_cells(tmp_path / "run.rrd", "Background:color") == [[]]


def test_the_text_says_the_final_whirl_and_how_to_play_slowly(tmp_path: Path) -> None:
    names, samples = run(100)
    record(tmp_path / "run.rrd", names, samples)
    (text,) = still(tmp_path / "run.rrd", "/about", "TextDocument:text")
    final = np.sqrt(np.mean(np.sum(samples[90:, 5:7] ** 2, axis=1))) / 1e-4
    assert f"W/e = {final:.3g}" in text and "type 0.1" in text
