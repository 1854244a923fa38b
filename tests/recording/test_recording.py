"""A run goes into a Rerun file and comes back bit for bit, also while it runs."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest
import rerun_cli
from rerun.chunk import RrdReader
from rerun_bindings import check_for_rrd_footer

from ab_sim.base.errors import RecordingError
from ab_sim.record.recording import BATCH_ROWS, CHUNK_ROWS, Recording
from ab_sim.record.recording.layout import SAMPLES
from tests.recorded import read_recording
from tests.recording.runs import channel, describe, plotted, record, run, views


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
    assert len(channel(tmp_path / "run.rrd", "time")) == len(samples)
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
    torque = channel(path, "spindle_torque")
    readings = channel(path, "sensor_deck")
    others = channel(path, "sensor_a_1")
    assert np.array_equal(np.column_stack([torque, readings, others]), wide[:, -5:])
    record(tmp_path / "plain.rrd", names, samples)
    assert set(views(path)) - set(views(tmp_path / "plain.rrd")) == {
        "Motor torque [N m]",
        "Vibration |a|, deck and sensors [m/s²]",
    }
    sizes = plotted(path, SAMPLES, "vector_lengths")[:, 1]
    np.testing.assert_allclose(sizes, np.hypot(*readings.T), rtol=1e-6)


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


# --- when it reaches the file --------------------------------------------------------------


def test_rows_are_collected_and_sent_together(tmp_path: Path) -> None:
    names, samples = run(BATCH_ROWS)
    with Recording(tmp_path / "run.rrd", description=describe()) as recording:
        recording.block(names, samples[:-1])
        assert recording.rows == BATCH_ROWS - 1
        recording.block(names, samples[-1:])
        assert recording.rows == recording.rows_written == BATCH_ROWS


def test_what_is_sent_and_kept_does_not_grow_with_the_messages(tmp_path: Path) -> None:
    """100,000 messages in 20 batches, as a recorder writes them: Rerun is sent, and keeps, few."""
    batches, notes, path = 20, 2500, tmp_path / "run.rrd"
    names, samples = run(batches * 200)
    times = np.linspace(0.0, 1.0, notes)
    with Recording(path, description=describe()) as recording:
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


def test_an_index_can_be_added_afterwards(tmp_path: Path) -> None:
    """By Rerun's own tool, as the documentation says; with it, its check of a file passes."""
    names, samples = run(500)
    bare, indexed = tmp_path / "run.rrd", tmp_path / "indexed.rrd"
    with Recording(bare, description=describe()) as recording:
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
