"""Recordings are read a block at a time, whatever happened to them."""

from __future__ import annotations

import subprocess
from pathlib import Path
from random import Random

import numpy as np
import pytest
import rerun_cli
from rerun.chunk import RrdReader

from ab_sim.base.errors import RecordingError
from ab_sim.record.recording import CHUNK_ROWS, Recording, open_recording
from ab_sim.record.recording.rerun_file import RerunFile
from ab_sim.record.recording.stored import StoredRun
from tests.recorded import read_recording
from tests.recording.runs import describe, record, run


def joined(stored: StoredRun) -> bytes:
    return np.concatenate(list(stored.blocks())).tobytes()


@pytest.mark.parametrize("rows", [1, 7, 1000, 10_000])
def test_blocks_are_the_samples_bit_for_bit(tmp_path: Path, rows: int) -> None:
    names, samples = run(2345)
    record(tmp_path / "run.rrd", names, samples)
    blocks = list(open_recording(tmp_path / "run.rrd").blocks(rows=rows))
    assert [len(block) for block in blocks[:-1]] == [rows] * (2345 // rows - (2345 % rows == 0))
    assert np.concatenate(blocks).tobytes() == samples.tobytes()


def test_channels_are_given_in_the_order_asked_for(tmp_path: Path) -> None:
    names, samples = run(50)
    record(tmp_path / "run.rrd", names, samples)
    stored = open_recording(tmp_path / "run.rrd")
    for asked in (["ball_1_rate", "step", "x"], ["vy"], ["step"], ["y", "x", "time", "y"]):
        (block,) = stored.blocks(asked)
        np.testing.assert_array_equal(block, samples[:, [names.index(name) for name in asked]])
    with pytest.raises(KeyError, match="'ball_1_rat'; did you mean 'ball_1_rate'"):
        next(stored.blocks(["ball_1_rat"]))


def test_what_is_read_at_once_is_bounded(tmp_path: Path) -> None:
    names, samples = run(30_000)
    record(tmp_path / "run.rrd", names, samples, block=30_000)
    chunks = RrdReader(tmp_path / "run.rrd").stream().to_chunks()
    assert max(chunk.num_rows for chunk in chunks) == CHUNK_ROWS


def test_extent_counts_gaps_across_blocks(tmp_path: Path) -> None:
    names, samples = run(30_000)
    kept = np.delete(samples, [*range(1000, 1100), *range(9990, 10_020), 29_999], axis=0)
    record(tmp_path / "run.rrd", names, kept, block=33)
    extent = open_recording(tmp_path / "run.rrd").extent
    assert (extent.rows, extent.gaps, extent.missing) == (len(kept), 2, 130)
    assert extent.first == (0.0, 0.0) and extent.last == (29_998.0, 29.998)


def test_a_decimated_recording_comes_back(tmp_path: Path) -> None:
    names, samples = run(5000)
    kept = np.concatenate([samples[:1000:10], samples[1000:1500], samples[1500::10]])
    record(tmp_path / "run.rrd", names, kept, block=33)
    assert joined(open_recording(tmp_path / "run.rrd")) == kept.tobytes()


@pytest.mark.parametrize("lost", [1, 5, 15, 17, 40, 300, 2000, 30_000, 60_000])
def test_all_before_a_torn_end_is_read(tmp_path: Path, lost: int) -> None:
    """As SIGKILL leaves a file: at any byte."""
    names, samples = run(1000)
    whole, torn = tmp_path / "run.rrd", tmp_path / "torn.rrd"
    with Recording(whole, description=describe()) as recording:
        for start in range(0, 1000, 100):
            recording.block(names, samples[start : start + 100])
            recording.flush()
    torn.write_bytes(whole.read_bytes()[:-lost])
    stored = open_recording(torn)
    back = np.concatenate(list(stored.blocks()))
    assert back.tobytes() == samples[: len(back)].tobytes()
    if lost < 300:  # less than the last message
        assert len(back) == 1000
    elif lost > 50_000:  # more than the last of what is drawn
        assert stored.torn and len(back) < 1000 and not stored.complete
    assert len(back) >= 1000 - 100 * (lost // 30_000 + 2)
    assert read_recording(torn).samples.tobytes() == back.tobytes()


def test_rows_that_not_all_entities_have_are_left_out(tmp_path: Path) -> None:
    """Whichever channels are asked for: the rows are the same."""
    names, samples = run(1000)
    whole, torn = tmp_path / "run.rrd", tmp_path / "torn.rrd"
    with Recording(whole, description=describe()) as recording:
        for start in range(0, 1000, 100):
            recording.block(names, samples[start : start + 100])
            recording.flush()
    content, counts = whole.read_bytes(), set()
    for lost in range(1000, 60_000, 6000):
        torn.write_bytes(content[:-lost])
        stored = open_recording(torn)
        rows = {sum(map(len, stored.blocks(asked))) for asked in (["time"], ["ball_1_rate"], None)}
        assert rows == {stored.extent.rows}
        counts |= rows
    assert len(counts) > 1


def test_an_optimised_file_is_read_alike(tmp_path: Path) -> None:
    names, samples = run(50_000)
    bare, indexed = tmp_path / "run.rrd", tmp_path / "indexed.rrd"
    with Recording(bare, description=describe()) as recording:
        recording.block(names, samples)
    rerun = [str(Path(rerun_cli.__file__).with_name("rerun")), "rrd"]
    subprocess.run([*rerun, "optimize", bare, "-o", indexed], check=True, capture_output=True)
    stored = open_recording(indexed)
    assert stored.complete and joined(stored) == samples.tobytes()
    indexed.write_bytes(indexed.read_bytes()[:-40])  # a part of the index
    assert joined(open_recording(indexed)) == samples.tobytes()


def test_an_empty_recording_has_nothing(tmp_path: Path) -> None:
    with Recording(tmp_path / "run.rrd", description=describe()):
        pass
    stored = open_recording(tmp_path / "run.rrd")
    assert stored.channels == () and list(stored.blocks()) == []
    assert stored.extent.rows == 0 and stored.complete


def test_a_file_that_is_gone_between_two_passes_is_said(tmp_path: Path) -> None:
    names, samples = run(50)
    record(tmp_path / "run.rrd", names, samples)
    stored = open_recording(tmp_path / "run.rrd")
    (tmp_path / "run.rrd").unlink()
    with pytest.raises(RecordingError, match=r"run\.rrd"):
        list(stored.blocks())


def test_of_merged_recordings_one_is_read_and_named(tmp_path: Path) -> None:
    for name, rows in (("one", 20), ("two", 40)):
        record(tmp_path / f"{name}.rrd", *run(rows))
    merged = tmp_path / "merged.rrd"
    rerun_cli_main = Path(rerun_cli.__file__).with_name("rerun")
    files = [tmp_path / "one.rrd", tmp_path / "two.rrd"]
    subprocess.run([rerun_cli_main, "rrd", "merge", *files, "-o", merged], check=True)
    stored = open_recording(merged)
    (remark,) = stored.remarks
    assert "contains 2 recordings" in remark and "give each recording as its own file" in remark
    names = {
        open_recording(file).extent.rows: RrdReader(file).recordings()[0].recording_id
        for file in files
    }
    assert names[stored.extent.rows] in remark, "one of them, and no mixture"
    assert open_recording(files[0]).remarks == ()


def place_of(path: Path, entity: str) -> int:
    """Return where in the file the first chunk of an entity begins [bytes]."""
    return int(next(RerunFile(path).chunks(entity)).place.rsplit(" ", 1)[1])


@pytest.mark.parametrize("entity", ["/description", "/samples", "/channels", "/closed"])
def test_no_flipped_bit_ends_the_process(tmp_path: Path, entity: str) -> None:
    """Rerun's own reader aborts it on some of these, which no test would survive."""
    record(tmp_path / "run.rrd", *run(100))
    whole, damaged, random = (
        (tmp_path / "run.rrd").read_bytes(),
        tmp_path / "damaged.rrd",
        Random(0),
    )
    start, refused = place_of(tmp_path / "run.rrd", entity), 0
    length = min(1200, len(whole) - start)
    for _ in range(100):
        content = bytearray(whole)
        content[start + random.randrange(length)] ^= 1 << random.randrange(8)
        damaged.write_bytes(content)
        try:
            assert len(read_recording(damaged).samples) <= 100
        except RecordingError as error:
            assert "damaged.rrd" in str(error)
            refused += 1
    assert refused > 15


def test_a_damaged_recording_says_where_and_what_to_do(tmp_path: Path) -> None:
    record(tmp_path / "run.rrd", *run(100))
    start = place_of(tmp_path / "run.rrd", "/samples")
    with (tmp_path / "run.rrd").open("r+b") as file:
        file.seek(start + 300)
        file.write(bytes(200))
    with pytest.raises(RecordingError, match=rf"run\.rrd .* at byte {start}: "):
        read_recording(tmp_path / "run.rrd")
