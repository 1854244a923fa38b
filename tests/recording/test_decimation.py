"""Of a long run one step of so many is kept, and all of them around what happens."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from ab_sim.base.errors import RecordingError
from ab_sim.record.recording import Recording
from ab_sim.record.recording.decimation import SHARE, STRETCHES
from tests.recorded import read_recording
from tests.recording.runs import STEP, describe, record, run

EVERY, AROUND = 50, 0.1
NEAR = round(AROUND / STEP)


def commanded(rows: int, *moves: tuple[int, int]) -> tuple[list[str], NDArray[np.float64]]:
    """A run whose command moves at every row of some stretches, and stands still otherwise."""
    names, samples = run(rows)
    command = np.zeros(rows)
    for first, last in moves:
        command[first:last] = 1.0
    samples[:, names.index("command")] = np.cumsum(command)
    return names, samples


def decimated(
    path: Path,
    names: list[str],
    samples: NDArray[np.float64],
    block: int = 20,
    events: tuple[float, ...] = (),
    close: bool = True,
    every: int = EVERY,
) -> Recording:
    """Recorded as live: what happens is noted when its time has come."""
    recording = Recording(path, description=describe(), every=every, around=AROUND)
    ahead = sorted(events)
    for part in np.split(samples, range(block, len(samples), block)):
        while ahead and ahead[0] < part[0, 1]:
            recording.event(ahead.pop(0), "something happened")
        recording.block(names, part)
    if close:
        recording.close()
    else:
        recording.flush()
    return recording


def steps_around(*steps: float) -> set[int]:
    return {s for step in steps for s in range(int(step) - NEAR, int(step) + NEAR + 1) if s >= 0}


def test_what_is_kept(tmp_path: Path) -> None:
    """The raster, the two ends of a ramp, what is around an event, the first and the last step."""
    names, samples = commanded(5003, (1000, 2000), (3000, 3001))
    samples = samples[3:]
    recording = decimated(tmp_path / "r.rrd", names, samples, events=(2.5,))
    back = read_recording(tmp_path / "r.rrd")
    kept = set(range(50, 5003, EVERY)) | {3, 5002}
    kept |= steps_around(1000, 1999, 2500, 3000)
    assert set(back["step"].tolist()) == kept
    rows = np.isin(samples[:, 0], list(kept))
    assert back.samples.tobytes() == samples[rows].tobytes()
    assert (back.missing, back.gaps, back.complete) == (0, 0, True)
    assert back.left_out == recording.left_out == 5000 - len(kept)
    assert (recording.rows, recording.rows_written) == (5000, len(kept))
    assert recording.missing == recording.stretches_refused == 0


@pytest.mark.parametrize("block", [1, 7, 100])
def test_it_does_not_matter_how_many_rows_come_at_once(tmp_path: Path, block: int) -> None:
    """Nor, then, when: events are noted up to ``around`` late."""
    rng = np.random.default_rng(0)
    begins, lasts = rng.integers(0, 7700, 9).tolist(), rng.integers(1, 300, 9).tolist()
    moves = [(begin, begin + last) for begin, last in zip(begins, lasts, strict=True)]
    names, samples = commanded(8000, *moves)
    events = tuple((rng.integers(0, 7900, 30) * STEP).tolist())
    lost = np.unique(rng.integers(1, 7999, 40))
    samples = np.delete(samples, lost, axis=0)
    one = decimated(tmp_path / "20.rrd", names, samples, 20, events)
    other = decimated(tmp_path / "other.rrd", names, samples, block, events)
    a, b = read_recording(tmp_path / "20.rrd"), read_recording(tmp_path / "other.rrd")
    assert a.samples.tobytes() == b.samples.tobytes()
    assert one.stretches_refused == other.stretches_refused > 0, "the harder case"
    assert a.missing == b.missing == one.missing == len(lost)


def test_missing_are_those_that_are_not_left_out_by_intent(tmp_path: Path) -> None:
    names, samples = commanded(1000)
    lost = [*range(120, 240), 300, 777, 778]
    decimated(tmp_path / "r.rrd", names, np.delete(samples, lost, axis=0))
    back = read_recording(tmp_path / "r.rrd")
    assert (back.missing, back.gaps) == (len(lost), 3)
    assert back.left_out == 1000 - len(lost) - len(back.samples)


def test_a_flood_of_events_stays_within_bounds(tmp_path: Path) -> None:
    rows = 60_000
    names, samples = commanded(rows)
    events = tuple(np.arange(0.0, rows * STEP, 2.5 * AROUND).tolist())
    recording = decimated(tmp_path / "r.rrd", names, samples, 500, events)
    full_rate = SHARE * rows + STRETCHES * (2 * NEAR + 1)
    assert recording.rows_written <= rows / EVERY + full_rate + len(events)
    assert recording.stretches_refused > len(events) / 4
    assert read_recording(tmp_path / "r.rrd").missing == 0


def test_a_flood_has_the_same_bounds_in_a_recording_that_begins_late(tmp_path: Path) -> None:
    """The share at full rate is of the time since the recording began, not since t = 0."""
    rows, late = 30_000, 4096.0
    names, samples = commanded(rows)
    samples[:, 1] += late
    events = tuple((late + np.arange(0.0, rows * STEP, 2.5 * AROUND)).tolist())
    recording = decimated(tmp_path / "r.rrd", names, samples, 500, events)
    full_rate = SHARE * rows + STRETCHES * (2 * NEAR + 1)
    assert recording.rows_written <= rows / EVERY + full_rate + len(events)
    assert recording.stretches_refused > len(events) / 4


def test_a_command_that_never_rests_is_one_turn(tmp_path: Path) -> None:
    names, samples = commanded(5000, (500, 5000))
    decimated(tmp_path / "r.rrd", names, samples)
    kept = set(range(0, 5000, EVERY)) | steps_around(500) | set(range(4999 - NEAR, 5000))
    assert set(read_recording(tmp_path / "r.rrd")["step"].tolist()) == kept


def test_one_that_was_killed_knows_what_it_left_out(tmp_path: Path) -> None:
    names, samples = commanded(2000)
    recording = decimated(tmp_path / "r.rrd", names, samples, close=False)
    back = read_recording(tmp_path / "r.rrd")
    assert not back.complete and back.missing == 0
    kept = back["step"].tolist()
    assert kept == list(range(0, int(kept[-1]) + 1, EVERY))
    assert 2000 - 3 * NEAR - EVERY < kept[-1] < 2000 - 2 * NEAR
    assert recording.rows_written == len(back.samples)
    recording.close()
    assert read_recording(tmp_path / "r.rrd")["step"][-1] == 1999


def test_every_step_is_as_no_decimation(tmp_path: Path) -> None:
    names, samples = commanded(300, (10, 20))
    record(tmp_path / "a.rrd", names, samples)
    decimated(tmp_path / "b.rrd", names, samples, events=(0.1,), every=1)
    a, b = read_recording(tmp_path / "a.rrd"), read_recording(tmp_path / "b.rrd")
    assert a.samples.tobytes() == b.samples.tobytes() and (a.left_out, b.left_out) == (0, 0)


@pytest.mark.parametrize(
    "asked", [{"every": 0}, {"every": -3}, {"around": -1.0}, {"around": np.nan}, {"around": np.inf}]
)
def test_bad_rules_are_refused(tmp_path: Path, asked: dict[str, float]) -> None:
    with pytest.raises(RecordingError, match="^every = .*, around = "):
        Recording(tmp_path / "r.rrd", description=describe(), **asked)  # type: ignore[arg-type]
    assert not (tmp_path / "r.rrd").exists()


# --- without a drawing ---------------------------------------------------------------------


def test_positions_need_not_be_known(tmp_path: Path) -> None:
    from rerun.chunk import RrdReader

    steps = np.arange(30.0)
    samples = np.column_stack([steps, 1e-3 * steps, np.sin(steps), np.full(30, np.nan)])
    channels = ["step", "time", "ax", "coil [A]"]
    path = tmp_path / "r.rrd"
    with Recording(path, description={"note": "a rig"}, drawn=False) as recording:
        recording.block(channels, samples)
        recording.scalar("temperature", 0.0, 21.0)
    back = read_recording(path)
    assert back.samples.tobytes() == samples.tobytes() and back.description == {"note": "a rig"}
    reader = RrdReader(path)
    names = "ViewBlueprint:display_name"
    batches = [
        chunk.to_record_batch()
        for blueprint in reader.blueprints()
        for chunk in reader.stream(store=blueprint).to_chunks()
    ]
    shown = {b[names].to_pylist()[0][0] for b in batches if names in b.schema.names}
    assert {"Deck: vibration [m/s²]", "Temperature", "Events"} <= shown
    assert any(name.startswith("This run: plots only") for name in shown)
