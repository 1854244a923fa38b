"""How much room a recording takes: bytes that each sample adds to the file."""

from pathlib import Path

import pytest

from ab_sim.drive import Drive
from ab_sim.drive.description import describe
from ab_sim.drive.trajectory import Trajectory
from ab_sim.record.recording import Recording
from ab_sim.scene import load_scene
from tests.recorded import read_recording
from tests.recording.runs import cells

ROWS = 4000


@pytest.fixture(scope="module")
def run() -> Trajectory:
    """At 1 kHz, 15 doubles a sample: 120 bytes."""
    return Drive(load_scene("thesis-hold", ["start.speed=90"])).advance(ROWS)


@pytest.mark.parametrize(
    ("batch", "pictures", "most"),
    [
        pytest.param(100, False, 200, id="as a recorder writes that nobody watches"),
        pytest.param(100, True, 280, id="as one does whose viewer gets pictures at once"),
        pytest.param(500, True, 200, id="the same at five times the rate"),
        pytest.param(1000, True, 200, id="offline"),
    ],
)
def test_bytes_that_each_sample_adds(
    run: Trajectory, tmp_path: Path, batch: int, pictures: bool, most: float
) -> None:
    path, sizes = tmp_path / "run.rrd", []
    told = describe(load_scene("thesis-hold"))
    with Recording(path, description=told) as recording:
        for start in range(0, ROWS, batch):
            recording.block(run.channels, run.samples[start : start + batch])
            recording.flush(pictures=pictures)
            sizes.append(path.stat().st_size)
    begin = ROWS // (2 * batch)
    added = (sizes[-1] - sizes[begin - 1]) / (ROWS - begin * batch)
    assert 112 < added <= most
    back = read_recording(path)
    assert back.complete and back.samples.tobytes() == run.samples.tobytes()


def test_pictures_that_wait_come_in_the_end(run: Trajectory, tmp_path: Path) -> None:
    """Whether anybody watched: the same frames."""
    told, frames = describe(load_scene("thesis-hold")), []
    for pictures in (False, True):
        path = tmp_path / f"{pictures}.rrd"
        with Recording(path, description=told) as recording:
            for start in range(0, ROWS, 100):
                recording.block(run.channels, run.samples[start : start + 100])
                recording.flush(pictures=pictures)
        frames.append(cells(path, "/above/rotor", "Transform3D:translation"))
    assert frames[0] == frames[1] and len(frames[0]) == ROWS // 10 + 1
