"""A run goes into a Rerun file and comes back bit for bit; what cannot be written is said."""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rerun as rr
import rerun_cli
from numpy.typing import NDArray
from rerun.chunk import RrdReader
from rerun_bindings import check_for_rrd_footer

from ab_sim.errors import RecordingError
from ab_sim.recording import BATCH_ROWS, CHUNK_ROWS, Recording, read_recording

BASE = ["step", "time", "angle", "speed", "command", "x", "y", "vx", "vy", "ax", "ay"]
STEP = 1e-3


def describe(balls: int = 2, **changes: Any) -> dict[str, Any]:
    scene = {"effects": {"gravity": {"angle": 0.3}}, "note": 'three "ticks": ``` \n```json'}
    base = {"scene": scene, "race_radius": 0.01, "eccentricity": 1e-4, "balls": balls}
    return base | {"ball_radii": None, "step": STEP} | changes


def run(rows: int, balls: int = 2, seed: int = 0) -> tuple[list[str], NDArray[np.float64]]:
    """Channels and samples with full mantissas, at times k * 1 ms as the simulator stamps them."""
    names = BASE + [f"ball_{i}_{what}" for i in range(balls) for what in ("angle", "rate")]
    samples = np.random.default_rng(seed).normal(size=(rows, len(names)))
    samples[:, 0] = np.arange(rows)
    samples[:, 1] = np.arange(rows) * STEP
    return names, samples


def record(path: Path, names: list[str], samples: NDArray[np.float64], block: int = 20) -> None:
    balls = sum(name.startswith("ball_") and name.endswith("_angle") for name in names)
    with Recording(path, description=describe(balls)) as recording:
        for start in range(0, len(samples), block):
            recording.block(names, samples[start : start + block])


def cells(path: Path, entity: str, component: str) -> list[Any]:
    """All cells of one component, as the file has them, in order of step."""
    rows: list[tuple[int, Any]] = []
    for chunk in RrdReader(path).stream().to_chunks():
        if chunk.entity_path == entity and not chunk.is_static:
            batch = chunk.to_record_batch()
            rows += zip(batch["step"].to_pylist(), batch[component].to_pylist(), strict=True)
    return [cell for _, cell in sorted(rows, key=lambda row: row[0])]


def still(path: Path, entity: str, component: str) -> list[Any]:
    """The cell of a component that does not change."""
    for chunk in RrdReader(path).stream().to_chunks():
        if chunk.entity_path == entity and chunk.is_static:
            return chunk.to_record_batch()[component].to_pylist()[0]
    raise AssertionError(f"nothing static at {entity}")


def views(path: Path) -> list[str]:
    """Names of the views that the file lays out."""
    reader, names = RrdReader(path), "ViewBlueprint:display_name"
    (blueprint,) = reader.blueprints()
    batches = [c.to_record_batch() for c in reader.stream(store=blueprint).to_chunks()]
    return [b[names].to_pylist()[0][0] for b in batches if names in b.schema.names]


@contextmanager
def files_limited_to(size: int) -> Iterator[None]:
    """A real write error without a full disk: the kernel refuses to let files grow further."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


# --- what goes in comes out ----------------------------------------------------------------


@pytest.mark.parametrize("balls", [0, 1, 2, 64])
@pytest.mark.parametrize("block", [1, 20, 333])
def test_samples_come_back_bit_for_bit(tmp_path: Path, balls: int, block: int) -> None:
    names, samples = run(1000, balls)
    record(tmp_path / "run.rrd", names, samples, block)
    back = read_recording(tmp_path / "run.rrd")
    assert back.channels == tuple(names)
    assert back.samples.tobytes() == samples.tobytes()
    assert (back.gaps, back.missing, back.complete) == (0, 0, True)
    np.testing.assert_array_equal(back["vx"], samples[:, names.index("vx")])


def test_special_values_survive(tmp_path: Path) -> None:
    names, samples = run(6)
    column = names.index("ay")
    payload = np.array([0x7FF8_0000_0000_1234], dtype=np.uint64).view(np.float64)[0]
    samples[:, column] = [-0.0, 5e-324, np.inf, -np.inf, payload, 0.1]
    record(tmp_path / "run.rrd", names, samples)
    assert read_recording(tmp_path / "run.rrd").samples.tobytes() == samples.tobytes()


def test_a_long_block_is_cut_into_chunks_and_comes_back_whole(tmp_path: Path) -> None:
    names, samples = run(2 * CHUNK_ROWS + 7)
    record(tmp_path / "run.rrd", names, samples, block=len(samples))
    assert len(cells(tmp_path / "run.rrd", "/clock/time", "Scalars:scalars")) == len(samples)
    assert read_recording(tmp_path / "run.rrd").samples.tobytes() == samples.tobytes()


def test_other_channels_and_another_order_are_kept(tmp_path: Path) -> None:
    names, samples = run(50)
    odd = ["step", "time", "coil [A]/2", *reversed(names[2:]), "fluß"]
    wide = np.column_stack([samples, samples[:, 5], samples[:, 6]])
    record(tmp_path / "run.rrd", odd, wide)
    back = read_recording(tmp_path / "run.rrd")
    assert back.channels == tuple(odd)
    assert back.samples.tobytes() == wide.tobytes()


def test_motor_and_sensors_have_places_of_their_own(tmp_path: Path) -> None:
    names, samples = run(50)
    more = [*names, "motor_torque", "deck_1", "deck_2", "a_1_1", "a_1_2"]
    wide = np.column_stack([samples, np.random.default_rng(1).normal(size=(50, 5))])
    path = tmp_path / "run.rrd"
    with Recording(
        path, description=describe(effects=["motor"], sensors=["deck", "a_1"])
    ) as recording:
        recording.block(more, wide)
    assert read_recording(path).samples.tobytes() == wide.tobytes()
    torque = np.array(cells(path, "/spindle/torque", "Scalars:scalars"))
    readings = np.array(cells(path, "/sensors/deck", "Scalars:scalars"))
    others = np.array(cells(path, "/sensors/a_1", "Scalars:scalars"))
    assert np.array_equal(np.column_stack([torque, readings, others]), wide[:, -5:])
    record(tmp_path / "plain.rrd", names, samples)
    assert set(views(path)) - set(views(tmp_path / "plain.rrd")) == {"Motor: torque [N m]"}
    sizes = np.array(cells(path, "/plot/vibration/sensors/deck", "Scalars:scalars"))[:, 0]
    np.testing.assert_allclose(sizes, np.hypot(*readings.T))


def test_the_callers_buffer_may_be_reused(tmp_path: Path) -> None:
    names, samples = run(60)
    buffer = np.empty((20, len(names)))
    with Recording(tmp_path / "run.rrd", description=describe()) as recording:
        for start in (0, 20, 40):
            buffer[:] = samples[start : start + 20]
            recording.block(names, buffer)
            buffer[:] = np.nan
    assert read_recording(tmp_path / "run.rrd").samples.tobytes() == samples.tobytes()


def test_gaps_are_counted(tmp_path: Path) -> None:
    names, samples = run(100)
    kept = np.delete(samples, [10, 11, 12, 40], axis=0)
    record(tmp_path / "run.rrd", names, kept, block=7)
    back = read_recording(tmp_path / "run.rrd")
    assert (back.gaps, back.missing) == (2, 4)
    assert back.samples.tobytes() == kept.tobytes()


def test_timeline_is_exact_to_the_nanosecond(tmp_path: Path) -> None:
    """k * 1e-3 s in floating point is often just below the millisecond: it must not be cut."""
    names, samples = run(5000)
    record(tmp_path / "run.rrd", names, samples)
    chunks = RrdReader(tmp_path / "run.rrd").stream().to_chunks()
    batches = [c.to_record_batch() for c in chunks if "step" in c.timeline_names]
    for batch in batches:
        nanoseconds = batch["sim_time"].to_numpy().astype(np.int64)
        np.testing.assert_array_equal(nanoseconds, batch["step"].to_numpy() * 1_000_000)
    assert sum(len(batch) for batch in batches) >= 5000


def test_description_events_and_scalars_come_back(tmp_path: Path) -> None:
    description = describe()
    with Recording(tmp_path / "run.rrd", description=description) as recording:
        recording.event(0.25, "overrun: 12 ms", level="warning", source="/ab/drive_sim")
        recording.event(0.003, "started")
        recording.event(0.25, "again, ```x", level="ERROR", source="/ab/drive_sim")
        recording.scalar("real_time_factor", 0.1, 1.0)
        recording.scalar("real_time_factor", 0.2, 0.1 + 0.2)
        recording.scalar("commands_received", 0.2, 100.0)
    back = read_recording(tmp_path / "run.rrd")
    assert back.description == description
    assert [(e.time, e.level, e.source, e.text) for e in back.events] == [
        (0.003, "INFO", "run", "started"),
        (0.25, "WARN", "/ab/drive_sim", "overrun: 12 ms"),
        (0.25, "ERROR", "/ab/drive_sim", "again, ```x"),
    ]
    assert back.scalars["real_time_factor"].tolist() == [[0.1, 1.0], [0.2, 0.1 + 0.2]]
    assert back.scalars["commands_received"].tolist() == [[0.2, 100.0]]
    assert (back.channels, back.samples.shape) == ((), (0, 0))  # no block ever came


def test_two_recordings_at_once_do_not_mix(tmp_path: Path) -> None:
    names, a = run(300, seed=1)
    _, b = run(300, seed=2)
    with (
        Recording(tmp_path / "a.rrd", description=describe(note="a")) as first,
        Recording(tmp_path / "b.rrd", description=describe(note="b")) as second,
    ):
        first.block(names, a)
        second.block(names, b)
    assert read_recording(tmp_path / "a.rrd").samples.tobytes() == a.tobytes()
    assert read_recording(tmp_path / "b.rrd").samples.tobytes() == b.tobytes()
    assert read_recording(tmp_path / "b.rrd").description["note"] == "b"


# --- the pictures --------------------------------------------------------------------------


def test_top_view_is_to_scale_with_y_upwards(tmp_path: Path) -> None:
    names, samples = run(3)
    col = {name: samples[:, names.index(name)] for name in names}
    record(tmp_path / "run.rrd", names, samples)
    shaft = np.array(cells(tmp_path / "run.rrd", "/top/rotor", "Transform3D:translation"))[:, 0]
    np.testing.assert_allclose(shaft[:, 0], 1e3 * col["x"], rtol=1e-6)
    np.testing.assert_allclose(shaft[:, 1], -1e3 * col["y"], rtol=1e-6)  # Rerun's y is down
    turn = np.array(cells(tmp_path / "run.rrd", "/top/rotor", "Transform3D:quaternion"))[:, 0]
    direction = np.exp(2j * np.arctan2(turn[:, 2], turn[:, 3]))
    np.testing.assert_allclose(direction, np.exp(-1j * col["angle"]), atol=1e-6)
    balls = np.array(cells(tmp_path / "run.rrd", "/top/rotor/balls", "Points2D:positions"))
    for ball in range(2):
        theta = col[f"ball_{ball}_angle"]
        expected = 10.0 * np.column_stack([np.cos(theta), -np.sin(theta)])
        np.testing.assert_allclose(balls[:, ball], expected, atol=1e-5)


def test_whirl_is_given_in_units_of_the_eccentricity(tmp_path: Path) -> None:
    names, samples = run(5)
    record(tmp_path / "run.rrd", names, samples)
    whirl = np.array(cells(tmp_path / "run.rrd", "/plot/whirl", "Scalars:scalars"))[:, 0]
    np.testing.assert_allclose(whirl, np.hypot(samples[:, 5], samples[:, 6]) / 1e-4, rtol=1e-12)


def test_vibration_is_shown_as_one_curve(tmp_path: Path) -> None:
    names, samples = run(5)
    record(tmp_path / "run.rrd", names, samples)
    sizes = np.array(cells(tmp_path / "run.rrd", "/plot/vibration/deck", "Scalars:scalars"))[:, 0]
    ax, ay = (samples[:, names.index(name)] for name in ("ax", "ay"))
    np.testing.assert_allclose(sizes, np.hypot(ax, ay))


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
    beside = {query[1] for query in contents.values() if len(query) > 1} - {"/top/rest"}
    assert beside == {"/plot/real_time", "/spindle/speed"}
    for entity in beside:
        times = [
            time
            for chunk in reader.stream().to_chunks()
            if chunk.entity_path == entity and not chunk.is_static
            for time in chunk.to_record_batch()["step"].to_pylist()
        ]
        assert (min(times), max(times)) == (0, 699)


def test_a_balanced_rotor_has_no_division_by_zero(tmp_path: Path) -> None:
    names, samples = run(5)
    with Recording(tmp_path / "run.rrd", description=describe(eccentricity=0.0)) as recording:
        recording.block(names, samples)
    whirl = np.array(cells(tmp_path / "run.rrd", "/plot/whirl", "Scalars:scalars"))[:, 0]
    np.testing.assert_allclose(whirl, 1e3 * np.hypot(samples[:, 5], samples[:, 6]))


def test_every_ball_is_drawn_in_its_size_within_the_race(tmp_path: Path) -> None:
    """But one that covers another's middle is smaller, so that both are seen."""
    names, samples = run(3)
    path = tmp_path / "run.rrd"
    samples[:, names.index("ball_0_angle")] = 7.0
    samples[:, names.index("ball_1_angle")] = 7.0 + np.array([0.3, 0.1, 0.0])
    with Recording(path, description=describe(ball_radii=[1e-3, 2e-3])) as recording:
        recording.block(names, samples)
    apart, near, together = cells(path, "/top/rotor/balls", "Points2D:radii")
    assert apart == pytest.approx([1.0, 2.0])
    assert together == pytest.approx([1.0, 0.62])
    assert near[0] == 1.0 and together[1] < near[1] < apart[1]
    wall = np.array(still(path, "/top/rotor/race", "LineStrips2D:strips")[0])
    np.testing.assert_allclose(np.hypot(*wall.T), 12.0, rtol=1e-6)


def test_the_file_carries_its_layout(tmp_path: Path) -> None:
    record(tmp_path / "run.rrd", *run(5))
    assert len(RrdReader(tmp_path / "run.rrd").blueprints()) == 1


# --- when it reaches the file --------------------------------------------------------------


def test_rows_are_collected_and_sent_together(tmp_path: Path) -> None:
    names, samples = run(BATCH_ROWS)
    with Recording(tmp_path / "run.rrd", description=describe()) as recording:
        recording.block(names, samples[:-1])
        assert recording.rows == BATCH_ROWS - 1
        recording.block(names, samples[-1:])
        assert recording.rows == recording.rows_written == BATCH_ROWS


@pytest.mark.filterwarnings("ignore:RRD file has no footer")
def test_what_is_sent_and_kept_does_not_grow_with_the_messages(tmp_path: Path) -> None:
    """100,000 messages in 20 batches, as a recorder writes them: Rerun is sent, and keeps, few."""
    batches, notes, path = 20, 2500, tmp_path / "run.rrd"
    names, samples = run(batches * 200)
    times = np.linspace(0.0, 1.0, notes)
    with Recording(path, description=describe(), index=False) as recording:
        for batch in np.split(samples, batches):
            recording.block(names, batch)
            for time in times:
                recording.scalar("commands_received", time, 100.0)
                recording.event(time, "rejected", source="log")
            recording.flush()
    back = read_recording(path)
    assert len(back.scalars["commands_received"]) == len(back.events) == batches * notes
    assert back.complete and back.samples.tobytes() == samples.tobytes()
    chunks = [chunk.entity_path for chunk in RrdReader(path).stream().to_chunks()]
    sendings = 1 + batches * (200 + 2 * notes) // BATCH_ROWS + batches
    assert max(chunks.count(entity) for entity in chunks) <= sendings
    assert not check_for_rrd_footer(path), "an index would have been kept in memory"


@pytest.mark.filterwarnings("ignore:RRD file has no footer")
def test_an_index_can_be_added_afterwards(tmp_path: Path) -> None:
    """By Rerun's own tool, as the documentation says; with it, its check of a file passes."""
    names, samples = run(500)
    bare, indexed = tmp_path / "run.rrd", tmp_path / "indexed.rrd"
    with Recording(bare, description=describe(), index=False) as recording:
        recording.block(names, samples)
        recording.scalar("real_time_factor", 0.1, 1.0)
    rerun = [str(Path(rerun_cli.__file__).with_name("rerun")), "rrd"]
    subprocess.run([*rerun, "optimize", bare, "-o", indexed], check=True, capture_output=True)
    subprocess.run([*rerun, "verify", indexed], check=True, capture_output=True)
    back = read_recording(indexed)
    assert back.complete and back.samples.tobytes() == samples.tobytes()
    assert back.scalars["real_time_factor"].tolist() == [[0.1, 1.0]]
    assert len(RrdReader(indexed).blueprints()) == len(RrdReader(bare).blueprints()) > 0


def test_a_recording_can_be_read_while_it_runs(tmp_path: Path) -> None:
    names, samples = run(100)
    with Recording(tmp_path / "run.rrd", description=describe()) as recording:
        recording.block(names, samples[:60])
        recording.flush()
        back = read_recording(tmp_path / "run.rrd")
        assert back.samples.tobytes() == samples[:60].tobytes()
        assert not back.complete
        recording.block(names, samples[60:])
    assert read_recording(tmp_path / "run.rrd").samples.tobytes() == samples.tobytes()


def test_close_twice_and_use_after_close(tmp_path: Path) -> None:
    names, samples = run(10)
    recording = Recording(tmp_path / "run.rrd", description=describe())
    recording.block(names, samples)
    recording.close()
    recording.close()
    for use in (
        lambda: recording.block(names, samples),
        lambda: recording.event(0.0, "late"),
        lambda: recording.scalar("late", 0.0, 0.0),
        recording.flush,
    ):
        with pytest.raises(RecordingError, match=r"run\.rrd is closed"):
            use()
    assert read_recording(tmp_path / "run.rrd").samples.tobytes() == samples.tobytes()


# --- errors in writing ---------------------------------------------------------------------


def test_missing_folder_and_folder_in_the_way(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"nowhere/run\.rrd.*no folder .*nowhere"):
        Recording(tmp_path / "nowhere" / "run.rrd", description=describe())
    with pytest.raises(RecordingError, match="Is a directory"):
        Recording(tmp_path, description=describe())


def test_a_device_that_is_full_from_the_start_is_reported() -> None:
    with pytest.raises(RecordingError, match=r"/dev/full.*No space left"):
        Recording("/dev/full", description=describe())


def test_write_error_is_reported_and_what_was_written_stays_readable(tmp_path: Path) -> None:
    names, samples = run(20_000)
    path = tmp_path / "run.rrd"
    recording = Recording(path, description=describe())
    with (
        files_limited_to(path.stat().st_size + 600_000),
        pytest.raises(RecordingError, match=r"run\.rrd.*File too large") as first,
    ):
        for start in range(0, len(samples), 20):
            recording.block(names, samples[start : start + 20])
    with pytest.raises(RecordingError) as again:
        recording.block(names, samples[-20:])
    assert again.value is first.value
    recording.close()  # was reported already
    back = read_recording(path)
    assert 0 < len(back.samples) == recording.rows_written < recording.rows
    assert back.samples.tobytes() == samples[: len(back.samples)].tobytes()
    assert not back.complete


def test_write_error_at_the_very_end_is_reported(tmp_path: Path) -> None:
    names, samples = run(400)
    path = tmp_path / "run.rrd"
    recording = Recording(path, description=describe())
    recording.block(names, samples)
    recording.flush()
    with (
        files_limited_to(path.stat().st_size + 10),
        pytest.raises(RecordingError, match=r"holds 400 of 400 rows.*File too large"),
    ):
        recording.close()
    back = read_recording(path)
    assert back.samples.tobytes() == samples.tobytes()
    assert not back.complete


@pytest.mark.parametrize(
    ("harm", "match"),
    [
        (lambda file: file.unlink(), "deleted or renamed"),
        (lambda file: shutil.rmtree(file.parent), "deleted or renamed"),
        (lambda file: file.rename(file.with_stem("other")), "deleted or renamed"),
        (lambda file: shutil.copy(file, file.with_suffix("")).replace(file), "replaced"),
        (lambda file: os.truncate(file, 0), "emptied"),
    ],
    ids=["deleted", "folder", "renamed", "replaced", "emptied"],
)
def test_a_file_that_is_lost_meanwhile_holds_nothing(
    tmp_path: Path, harm: Callable[[Path], Any], match: str
) -> None:
    names, samples = run(20)
    (tmp_path / "runs").mkdir()
    path = tmp_path / "runs" / "run.rrd"
    recording = Recording(path, description=describe())
    recording.block(names, samples[:10])
    recording.flush()
    assert recording.rows_written == 10
    harm(path)
    recording.block(names, samples[10:])
    with pytest.raises(RecordingError, match=rf"run\.rrd holds 0 of 20 rows.*{match}"):
        recording.close()
    assert recording.rows_written == recording.missing == 0


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"race_radius": None}, "race_radius"),
        ({"sensors": 3}, "sensors"),
        ({"balls": "many"}, "balls"),
        ({"ball_radii": 1e-3}, "ball_radii"),
        ({"ball_radii": [1e-3]}, "1 ball_radii for 2 balls"),
        ({"step": {1, 2}}, "not JSON"),
    ],
)
def test_unusable_description(tmp_path: Path, changes: dict[str, Any], match: str) -> None:
    with pytest.raises(RecordingError, match=match):
        Recording(tmp_path / "run.rrd", description=describe(**changes))
    assert not (tmp_path / "run.rrd").exists()


def test_unusable_blocks_are_refused_and_change_nothing(tmp_path: Path) -> None:
    names, samples = run(40)
    half, endless = samples[20:].copy(), samples[20:].copy()
    half[3, 0], endless[3, 1] = 23.5, np.nan
    with Recording(tmp_path / "run.rrd", description=describe()) as recording:
        for channels, match in (
            (names[1:], "start with step, time"),
            ([n for n in names if n != "x"], "include step, time, angle, x, y"),
            ([*names[:-1], "x"], "differ"),
            (names[:-2], "angles of 1 balls.*says balls: 2"),
        ):
            with pytest.raises(RecordingError, match=match):
                recording.block(channels, samples[:, : len(channels)])
        recording.block(names, samples[:20])
        for rows, match in (
            (samples[20:, :-1], "expected"),
            (samples[20], "expected"),
            (half, "whole"),
            (endless, "finite"),
            (samples[19:], r"19\.\.39 came after 19"),
            (samples[[21, 20]], "step must grow"),
        ):
            with pytest.raises(RecordingError, match=match):
                recording.block(names, rows)
        with pytest.raises(RecordingError, match="expected"):
            recording.block([*names[:-1], "else"], samples[20:])
        with pytest.raises(RecordingError, match="one word"):
            recording.scalar("real time", 0.0, 1.0)
        recording.block(names, samples[:0])
        recording.block(names, samples[20:])
    assert read_recording(tmp_path / "run.rrd").samples.tobytes() == samples.tobytes()


# --- errors in reading ---------------------------------------------------------------------


def test_unreadable_files(tmp_path: Path) -> None:
    whole, torn, text = tmp_path / "run.rrd", tmp_path / "torn.rrd", tmp_path / "text.rrd"
    record(whole, *run(1000))
    torn.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    text.write_text("speed,angle\n1,2\n" * 100)
    (tmp_path / "empty.rrd").touch()
    for path, match in (
        (tmp_path / "no.rrd", r"no\.rrd: no such file"),
        (tmp_path, "is a folder"),
        (torn, r"torn\.rrd is not a Rerun recording, or is torn"),
        (text, r"text\.rrd is not a Rerun recording"),
        (tmp_path / "empty.rrd", r"empty\.rrd is not a Rerun recording"),
    ):
        with pytest.raises(RecordingError, match=match):
            read_recording(path)


def test_somebody_elses_rerun_file(tmp_path: Path) -> None:
    stream = rr.RecordingStream("other", recording_id="other")
    stream.set_sinks(rr.FileSink(tmp_path / "other.rrd"))
    rr.log("/thing", rr.TextLog("hello"), recording=stream)
    stream.flush(timeout_sec=5)
    stream.disconnect()
    with pytest.raises(RecordingError, match=r"other\.rrd.*not a recording of ab_sim"):
        read_recording(tmp_path / "other.rrd")
