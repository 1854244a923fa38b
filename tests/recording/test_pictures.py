"""What the pictures of a run show, against the run itself."""

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from rerun.chunk import RrdReader
from scipy.signal import periodogram

from ab_sim.analysis.comparison import without_balls
from ab_sim.analysis.metrics import metrics_of
from ab_sim.base.presentation import last_stretch
from ab_sim.drive import Drive
from ab_sim.drive.closed_forms import driving_forces
from ab_sim.drive.description import describe
from ab_sim.drive.trajectory import Trajectory
from ab_sim.drive.turn_vector import once_per_turn
from ab_sim.record.recording import SHOWN_PERIOD, Recording
from ab_sim.record.recording.curves import FRAMES
from ab_sim.record.recording.layout import SAMPLES
from ab_sim.record.recording.signals import FinalRms
from ab_sim.record.recording.vibration import PERIOD as VARIABLE
from ab_sim.record.recording.vibration import SIZES, SpindlePhase
from ab_sim.record.recording.views import PERIOD
from ab_sim.scene import Scene, load_scene
from tests.recorded import read_recording
from tests.recording.runs import cells, curves, plotted, still, views

Array = NDArray[np.float64]


@pytest.fixture(scope="module")
def scene() -> Scene:
    """One that reaches, holds and leaves its critical speed within 1.5 s."""
    return load_scene(
        "thesis-hold",
        [
            "profile.acceleration=200",
            "spindle.max_acceleration=200",
            "profile.target_speed=150",
            "profile.variable_speed_period.duration=0.4",
            "start.ball_angles=[0.3, -0.4]",
            "start.speed=10",
        ],
    )


@pytest.fixture(scope="module")
def run(scene: Scene) -> Trajectory:
    return Drive(scene).advance(round(1.5 / scene.solver.step))


@pytest.fixture(scope="module")
def file(scene: Scene, run: Trajectory, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("pictures") / "run.rrd"
    with Recording(path, description=describe(scene)) as recording:
        recording.scalar("real_time_factor", 0.1, 1.0)
        recording.block(run.channels, run.samples)
    return path


@pytest.fixture(scope="module")
def seen(scene: Scene, run: Trajectory) -> Trajectory:
    """The rows that are drawn."""
    drawn = run["step"] % round(PERIOD / scene.solver.step) == 0
    drawn[0] = True
    return Trajectory(run.channels, run.samples[drawn])


def steps(file: Path, entity: str) -> Array:
    found = [
        chunk.to_record_batch()["step"].to_numpy()
        for chunk in RrdReader(file).stream().to_chunks()
        if chunk.entity_path == entity and not chunk.is_static
    ]
    return np.sort(np.concatenate(found))


def test_channels_still_come_back_to_the_bit(file: Path, run: Trajectory) -> None:
    back = read_recording(file)
    assert back.channels == run.channels and back.complete
    assert back.samples.tobytes() == run.samples.tobytes()


def test_arrows_are_the_unbalances_and_their_sum(
    file: Path, seen: Trajectory, scene: Scene
) -> None:
    """From above with y downwards; the ball's arrow begins at the tip of the rotor's."""
    vectors = np.array(cells(file, "/above/rotor", "Arrows2D:vectors")) * [1.0, -1.0]
    origins = np.array(cells(file, "/above/rotor", "Arrows2D:origins")) * [1.0, -1.0]
    m, R = scene.balls.masses[0], scene.race.radius
    rotor = scene.eccentric_mass * scene.rotor.eccentricity
    theta = seen.ball_angles
    x, y = m * R * np.cos(theta).sum(axis=1), m * R * np.sin(theta).sum(axis=1)
    scale = vectors[0, 0, 0] / rotor
    np.testing.assert_allclose(vectors[:, 0], np.tile([scale * rotor, 0.0], (len(seen), 1)))
    np.testing.assert_allclose(vectors[:, 1], scale * np.column_stack([x, y]), atol=1e-5)
    np.testing.assert_allclose(vectors[:, 2], vectors[:, 0] + vectors[:, 1], atol=1e-5)
    np.testing.assert_allclose(origins[:, 1], vectors[:, 0], atol=1e-5)
    assert not origins[:, [0, 2]].any()
    space = np.array(cells(file, "/space/deck/rotor", "Arrows3D:vectors"))
    np.testing.assert_allclose(space[..., :2], vectors, atol=1e-5)
    assert not space[..., 2].any()


def test_balls_on_the_rings_leave_no_unbalance(file: Path, scene: Scene) -> None:
    rings = still(file, "/above/rotor/balanced", "LineStrips2D:strips")
    centres = np.array([np.mean(ring[:-1], axis=0) for ring in rings]) * [1e-3, -1e-3]
    assert np.hypot(*centres.T) == pytest.approx(scene.race.radius, rel=1e-6)
    rotor = scene.eccentric_mass * scene.rotor.eccentricity
    left = [rotor, 0.0] + np.array(scene.balls.masses) @ centres
    np.testing.assert_allclose(left, 0.0, atol=1e-6 * rotor)
    levels = plotted(file, FRAMES, "balls_levels")
    turned = np.sort(np.degrees(np.arctan2(centres[:, 1], centres[:, 0])) % 360.0) - 360.0
    np.testing.assert_allclose(levels, np.tile([-180.0, *turned], (len(levels), 1)), atol=1e-4)


def test_curves_of_each_frame(file: Path, seen: Trajectory, scene: Scene) -> None:
    forces = plotted(file, FRAMES, "driving")
    np.testing.assert_allclose(forces, driving_forces(seen, scene), rtol=1e-6)
    angles = plotted(file, FRAMES, "balls")
    np.testing.assert_allclose(
        np.exp(1j * np.radians(angles)), np.exp(1j * seen.ball_angles), atol=1e-6
    )
    assert angles.min() >= -330.0 and angles.max() <= 30.0
    drawn = 10.0 ** plotted(file, FRAMES, "without_balls")[:, 0]
    alone = Drive(without_balls(scene)).advance(round(1.5 / scene.solver.step))
    expected = np.interp(seen["time"], alone["time"], alone.whirl) / scene.rotor.eccentricity
    there = np.isfinite(drawn)
    assert there.sum() > 140
    np.testing.assert_allclose(drawn[there], expected[there], atol=3e-3 * expected.max())
    assert set(plotted(file, FRAMES, "speed_level")[:, 0]) == {np.float32(scene.critical_speed)}


def test_phase_of_the_whirl_is_that_of_the_turn_before(
    file: Path, run: Trajectory, seen: Trajectory
) -> None:
    """Small below the critical speed, and opposite above it, at -180 deg and not 180."""
    drawn = plotted(file, FRAMES, "phase")[:, 0]
    vectors = once_per_turn(run)[np.isin(run["step"], seen["step"])]
    known = np.isfinite(drawn)
    assert known.tolist() == np.isfinite(vectors).tolist() and known.sum() > 100
    expected = vectors[known] / np.abs(vectors[known])
    np.testing.assert_allclose(np.exp(1j * np.radians(drawn[known])), expected, atol=1e-6)
    assert drawn[known].min() > -330.0 and drawn[known].max() <= 30.0


def test_running_rms_is_that_of_the_samples_before(file: Path, run: Trajectory) -> None:
    found, at = plotted(file, SIZES, "rms")[:, 0], steps(file, SIZES)
    assert len(found) == 15
    square = np.sum(run.acceleration**2, axis=1)
    for step, value in zip(at, found, strict=True):
        last = square[(run["step"] <= step) & (run["time"] > (step + 1) * 1e-3 - 0.2501)]
        assert value == pytest.approx(np.sqrt(last.mean()), rel=2e-2)


def test_what_comes_once_per_turn_and_the_rest(file: Path, run: Trajectory) -> None:
    """By least squares, over all revolutions of the window: sines of the angle, and what is left.

    While the whirl still grows the two weigh it differently; the window is the last one, at speed.
    """
    found, at = plotted(file, SIZES, "orders"), steps(file, SIZES)
    assert np.isnan(found[0]).all() and at[0] < 100, "none before there are two turns"
    chosen = (run["step"] <= at[-1]) & (run["step"] > at[-1] - 250)
    angle, vibration = run["angle"][chosen], run.acceleration[chosen]
    turns = np.floor((angle[-1] - angle[0]) / (2 * np.pi))
    share = (angle[-1] - angle) / (2 * np.pi * turns)
    weight = np.sqrt(np.where(share < 1, 1 - np.cos(2 * np.pi * share), 0.0))
    waves = np.column_stack([np.cos(angle), np.sin(angle)])
    fit = np.linalg.lstsq(waves * weight[:, None], vibration * weight[:, None], rcond=None)[0]
    once = np.sqrt(np.sum(fit**2) / 2)
    rest = np.sum((vibration - waves @ fit) ** 2, axis=1)
    np.testing.assert_allclose(found[-1, 0], once, rtol=2e-2)
    np.testing.assert_allclose(
        found[-1, 1], np.sqrt(np.average(rest, weights=weight**2)), rtol=5e-2
    )


def test_spectrum_is_scipys(file: Path, run: Trajectory) -> None:
    at = steps(file, "/plot/spectrum/rest")
    assert np.unique(at).tolist() == [999, 1499]
    parts = []
    for name in ("once", "rest"):
        values = cells(file, f"/plot/spectrum/{name}", "BarChart:values")
        parts.append(np.array([cell[0]["buffer"] for cell in values], dtype=float))
    (first,) = cells(file, "/plot/spectrum/rest", "BarChart:abscissa")[0]
    frequencies, power = periodogram(
        run.acceleration[(run["step"] > 499) & (run["step"] <= 999)],
        fs=1e3, window="hann", scaling="spectrum", detrend="constant", axis=0,
    )  # fmt: skip
    shown = len(first["buffer"])
    np.testing.assert_allclose(first["buffer"], frequencies[:shown], atol=1e-9)
    whole = sum(parts)[0]
    np.testing.assert_allclose(whole, np.sqrt(power.sum(axis=1))[:shown], rtol=1e-6, atol=1e-9)
    assert frequencies[shown - 1] >= 5 * 150 / (2 * np.pi) > frequencies[shown - 3]
    lit = frequencies[:shown][parts[0][0] > 0]
    turning = (run["angle"][999] - run["angle"][500]) / (2 * np.pi * 0.499)
    assert 3 <= len(lit) <= 4 and np.abs(lit - turning).max() < 4.0


def test_all_spectra_of_a_batch_are_one_message(file: Path) -> None:
    chunks = RrdReader(file).stream().to_chunks()
    holding = [
        c.entity_path for c in chunks if "BarChart:values" in c.to_record_batch().schema.names
    ]
    assert sorted(holding) == ["/plot/spectrum/once", "/plot/spectrum/rest"]


def test_the_spindle_s_phases_are_named(file: Path, run: Trajectory) -> None:
    names = [cell[0] for cell in cells(file, "/state/spindle", "StateChange:state")]
    assert names == ["speeding up", VARIABLE, "speeding up", "steady"]
    begins = steps(file, "/state/spindle") * 1e-3
    np.testing.assert_allclose(begins, [0.0, 0.45, 0.85, 1.1], atol=0.03)
    marked = np.array(cells(file, "/plot/speed/period", "Scalars:scalars"))[:, 0]
    np.testing.assert_allclose(marked[:-1], 100.0, atol=4.0)
    assert np.isnan(marked[-1]), "the line ends"


@pytest.mark.parametrize(
    ("first", "last", "phase"),
    [
        (0.50, 0.52, "speeding up"),
        (0.52, 0.50, "slowing down"),
        (-0.50, -0.52, "speeding up"),
        (-0.52, -0.50, "slowing down"),
    ],
)
def test_phases_of_a_slow_spindle(first: float, last: float, phase: str) -> None:
    phases = SpindlePhase(("time", "speed"), 10.0, None)
    assert phases.phase_of(np.array([0.0, 0.02]), np.array([first, last])) == phase


def moving(file: Path) -> dict[tuple[str, str], list[tuple[int, object]]]:
    """Every cell that a file has, by entity and component, in order of step."""
    found: dict[tuple[str, str], list[tuple[int, object]]] = {}
    for chunk in RrdReader(file).stream().to_chunks():
        if chunk.is_static:
            continue
        batch = chunk.to_record_batch()
        when = "step" if "step" in batch.schema.names else "sim_time"
        for name in batch.schema.names:
            if ":" in name:
                rows = zip(batch[when].to_pylist(), batch[name].to_pylist(), strict=True)
                found.setdefault((chunk.entity_path, name), []).extend(rows)
    return {key: sorted(rows, key=lambda row: row[0]) for key, rows in found.items()}


@pytest.mark.parametrize("sizes", [[1, 190, 7]])
def test_pictures_do_not_depend_on_how_samples_come_in(
    scene: Scene, run: Trajectory, sizes: list[int], tmp_path: Path
) -> None:
    """To the bit, but for rounding in sums.

    In what order numpy adds depends on where in memory the numbers lie.
    """
    ends = np.cumsum(np.resize(sizes, len(run)))
    for name, stops in (("whole", []), ("cut", ends[ends < len(run)])):
        with Recording(tmp_path / name, description=describe(scene)) as recording:
            for part in np.split(run.samples, stops):
                recording.block(run.channels, part)
                recording.flush()
    whole, cut = moving(tmp_path / "whole"), moving(tmp_path / "cut")
    assert whole.keys() == cut.keys() and len(whole) > 25
    summed = (SIZES, "/plot/spectrum/")
    for key, rows in whole.items():
        if key[0].startswith(summed):
            assert [step for step, _ in cut[key]] == [step for step, _ in rows], key
            for (_, one), (_, other) in zip(cut[key], rows, strict=True):
                one, other = numbers(one), numbers(other)
                np.testing.assert_allclose(one, other, rtol=0, atol=1e-7 * max(map(abs, other)))
        else:
            # repr: what is not a number is not equal to itself
            assert repr(cut[key]) == repr(rows), key


def numbers(cell: Any) -> list[float]:
    """All that are in a cell."""
    first = cell[0]
    return list(first["buffer"]) if isinstance(first, dict) else cell


def test_every_view_is_there_and_every_entity_in_it(file: Path) -> None:
    """None of the views of the layout looks at what the file does not have."""
    assert set(views(file)) >= {
        "In space",
        "Top view",
        "Spindle speed [rad/s]",
        "Phase of the run (v: variable speed), nodes",
        "Whirl, log10 of W/e: -1 is 0.1, 0 is 1",
        "Ball angles from the unbalance [deg]",
        "Driving force on the balls, forward positive [N]",
        "R.m.s. of the last 0.25 s [m/s²]",
        "Vibration |a|, deck [m/s²]",
        "Phase of the whirl from the unbalance [deg]",
        "Real-time factor [1]; 1 keeps up",
        "Explanation",
    }
    reader = RrdReader(file)
    entities = {chunk.entity_path for chunk in reader.stream().to_chunks()}
    layouts = [reader.stream(store=store).to_chunks() for store in reader.blueprints()]
    seen = 0
    for chunk in (chunk for layout in layouts for chunk in layout):
        batch = chunk.to_record_batch()
        names = batch.schema.names
        if "ViewBlueprint:space_origin" in names:
            (origin,) = batch["ViewBlueprint:space_origin"].to_pylist()[-1]
            seen += 1
            if origin != "/events":  # this run has none
                assert any((e + "/").startswith(origin.rstrip("/") + "/") for e in entities)
        if "ViewContents:query" in names:
            for query in batch["ViewContents:query"].to_pylist()[-1]:
                wanted = query.removesuffix("/**")
                if wanted != "/health" and not wanted.startswith("$origin"):
                    assert any((e + "/").startswith(wanted + "/") for e in entities), query
    assert seen >= 12
    plots = set(curves(file))
    assert len(plots) >= 10
    assert plots <= {component for _, component in moving(file)}, "what is plotted has values"


def test_a_copy_for_a_viewer(scene: Scene, run: Trajectory, file: Path, tmp_path: Path) -> None:
    """Fewer rows and frames, the same vibration, one layout, and nothing before it is flushed."""
    path, scalars = tmp_path / "shown.rrd", ("real_time_factor", "commands_received")
    with Recording(path, description=describe(scene), is_shown=True) as recording:
        recording.lay_out(run.channels, scalars)
        for name in scalars:
            recording.scalar(name, 0.1, 1.0)
        recording.block(run.channels, run.samples)
        assert recording.rows_written == 0
    step = round(SHOWN_PERIOD / scene.solver.step)
    kept = run["step"] % step == 0
    kept[0] = True
    assert read_recording(path).samples.tobytes() == run.samples[kept].tobytes()
    drawn = plotted(file, FRAMES, "balls")
    every = round(SHOWN_PERIOD / PERIOD)
    expected = np.concatenate([drawn[:1], drawn[every::every]])
    np.testing.assert_array_equal(plotted(path, FRAMES, "balls"), expected)
    for name in ("rms", "orders"):
        np.testing.assert_array_equal(plotted(path, SIZES, name), plotted(file, SIZES, name))
    # One that follows, and at the end one that is paused.
    assert len(RrdReader(path).blueprints()) == 2


def test_a_batch_for_a_viewer_is_four_messages(
    scene: Scene, run: Trajectory, tmp_path: Path
) -> None:
    """A page drawn by software takes some five messages a frame; the rest follows rarely."""
    path = tmp_path / "shown.rrd"
    batches = np.array_split(run.samples, 8)
    with Recording(path, description=describe(scene), is_shown=True) as recording:
        recording.lay_out(run.channels, ["real_time_factor"])
        for batch in batches:
            recording.scalar("real_time_factor", batch[0, 1], 1.0)
            recording.block(run.channels, batch)
            recording.flush()
    sent = Counter(
        chunk.entity_path for chunk in RrdReader(path).stream().to_chunks() if not chunk.is_static
    )
    always = {SAMPLES, "/space/deck", "/space/deck/rotor", FRAMES}
    assert {entity for entity, count in sent.items() if count == len(batches)} == always
    rarely = {entity: count for entity, count in sent.items() if entity not in always}
    assert rarely.keys() >= {SIZES, "/run/real_time_factor"}
    # in the first batch and at the end, and a spectrum's axis
    assert max(rarely.values()) <= 3


def test_the_final_whirl_is_the_metric(scene: Scene, run: Trajectory) -> None:
    final = FinalRms()
    for block in np.array_split(run.samples, 7):
        piece = Trajectory(run.channels, block)
        final.take(piece["time"], piece.whirl)
    value = final.value
    assert value is not None
    assert value.rms == pytest.approx(metrics_of(run, scene).final_whirl, rel=1e-12)
    assert (value.begin, value.end) == (run["time"][-last_stretch(len(run))], run["time"][-1])
