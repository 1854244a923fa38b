"""What cannot be written or read is said, and what was written stays readable."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rerun as rr

from ab_sim.base.errors import RecordingError
from ab_sim.record.recording import Recording
from tests.recorded import read_recording
from tests.recording.runs import describe, record, run

resource = pytest.importorskip("resource")  # Windows has no limits of files


@contextmanager
def files_limited_to(size: int) -> Iterator[None]:
    """A real write error without a full disk: the kernel refuses to let files grow further."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


# --- errors in writing ---------------------------------------------------------------------


def test_missing_folder_and_folder_in_the_way(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"nowhere/run\.rrd.* folder .*nowhere"):
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
        files_limited_to(path.stat().st_size + 2_000_000),
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
        pytest.raises(RecordingError, match="400 of 400 rows.*File too large"),
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
    with pytest.raises(RecordingError, match=rf"run\.rrd contains 0 of 20 rows.*{match}"):
        recording.close()
    assert recording.rows_written == recording.missing == 0
    assert path.exists() == (match == "replaced"), "only its own file is removed"


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
            ([n for n in names if n != "x"], "time, angle, x, y"),
            ([*names[:-1], "x"], "differ"),
            (names[:-2], "angles of 1 balls.* balls = 2"),
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
            (samples[[21, 20]], "step must increase"),
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
    torn.write_bytes(whole.read_bytes()[:500])
    text.write_text("speed,angle\n1,2\n" * 100)
    (tmp_path / "empty.rrd").touch()
    for path, match in (
        (tmp_path / "no.rrd", r"no\.rrd: no such file"),
        (tmp_path, "is a folder"),
        (torn, r"torn\.rrd is (not a Rerun recording|a Rerun file, but)"),
        (text, r"text\.rrd is not a Rerun"),
        (tmp_path / "empty.rrd", r"empty\.rrd is not a Rerun"),
    ):
        with pytest.raises(RecordingError, match=match):
            read_recording(path)


@contextmanager
def rerun_file(path: Path, application: str) -> Iterator[rr.RecordingStream]:
    """Open a file that Rerun writes; what is logged is in it afterwards."""
    stream = rr.RecordingStream(application, recording_id=path.stem)
    stream.set_sinks(rr.FileSink(path))
    yield stream
    stream.flush(timeout_sec=5)
    stream.disconnect()


@pytest.mark.parametrize("text", ["no code", "```json\n{\n```", "```json\n[1]\n```"])
def test_a_description_that_is_no_mapping_is_told(text: str, tmp_path: Path) -> None:
    with rerun_file(tmp_path / "odd.rrd", "ab_sim") as stream:
        rr.log("/description", rr.TextDocument(text), static=True, recording=stream)
    with pytest.raises(RecordingError, match=r"odd\.rrd: its description"):
        read_recording(tmp_path / "odd.rrd")


def test_a_recording_of_an_earlier_ab_sim_is_said_to_be_one(tmp_path: Path) -> None:
    with rerun_file(tmp_path / "old.rrd", "ab_sim") as stream:
        rr.log("/description", rr.TextDocument("```json\n{}\n```"), static=True, recording=stream)
        stream.flush(timeout_sec=5)
        rr.log("/channels", rr.AnyValues(names=["step", "time"]), static=True, recording=stream)
        rr.set_time("step", sequence=1, recording=stream)
        rr.log("/clock/time", rr.Scalars(0.001), recording=stream)
    with pytest.raises(RecordingError, match=r"old\.rrd .* earlier version"):
        read_recording(tmp_path / "old.rrd")


def test_somebody_elses_rerun_file(tmp_path: Path) -> None:
    with rerun_file(tmp_path / "other.rrd", "other") as stream:
        rr.log("/thing", rr.TextLog("hello"), recording=stream)
    with pytest.raises(RecordingError, match=r"other\.rrd.*not a recording of"):
        read_recording(tmp_path / "other.rrd")
