"""`ab-sim export` as a user runs it."""

import csv
import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest
from numpy.typing import NDArray

from ab_sim.analysis.rest import from_rest
from ab_sim.base.errors import InputError, RecordingError
from ab_sim.cli.app import app
from ab_sim.drive.description import describe as describe_scene
from ab_sim.drive.observation import channels_of
from ab_sim.drive.trajectory import Trajectory, channels_for, unit_of, whirl_of
from ab_sim.drive.turn_vector import once_per_turn
from ab_sim.model.dynamics.assemble import system_of
from ab_sim.record.recording import Recording
from ab_sim.scene import load_scene
from tests.cli.tool import ab_sim
from tests.recording.runs import describe, record, run
from tests.waiting import PATIENCE, until


@pytest.fixture(scope="module")
def samples() -> NDArray[np.float64]:
    _, samples = run(25_000)
    samples[3, 5:9] = [-0.0, 5e-324, np.inf, -np.inf]
    samples[:, 6] *= 10.0 ** np.random.default_rng(1).integers(-300, 300, len(samples))
    return samples


@pytest.fixture(scope="module")
def recording(samples: NDArray[np.float64], tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("export") / "run.rrd"
    record(path, run(1)[0], samples, block=1000)
    return path


def bits(values: NDArray[np.float64]) -> bytes:
    return values.tobytes()


def test_parquet_and_csv_hold_every_bit_and_the_units(
    recording: Path, samples: NDArray[np.float64], tmp_path: Path
) -> None:
    done = ab_sim(
        "export", str(recording), "--parquet", "r.parquet", "--csv", "r.csv", cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == "25000 samples of 18 channels\n"
    assert "wrote r.parquet" in done.stderr and "wrote r.csv" in done.stderr
    table = pyarrow.parquet.read_table(tmp_path / "r.parquet")
    names = [*run(1)[0], "whirl", "once_per_turn", "phase"]
    assert table.column_names == names
    vectors = once_per_turn(Trajectory(run(1)[0], samples))
    columns = whirl_of(samples[:, 5], samples[:, 6]), np.abs(vectors), np.angle(vectors)
    samples = np.column_stack([samples, *columns])
    assert json.loads(table.schema.metadata[b"ab_sim"]) == describe()
    for at, field in enumerate(table.schema):
        column = table[field.name].to_numpy().astype(float)
        assert bits(column) == bits(samples[:, at]), field.name
        assert field.metadata[b"unit"].decode() == unit_of(field.name)
    assert str(table.schema.field("step").type) == "int64"
    with (tmp_path / "r.csv").open() as file:
        rows = csv.reader(file)
        assert next(rows) == [f"{name} [{unit_of(name)}]" for name in names]
        back = np.array([[float(cell) for cell in row] for row in rows])
    assert bits(back) == bits(samples)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["r.csv", "r.parquet"]
    assert (tmp_path / "r.csv").stat().st_mode & 0o777 == 0o666 & ~os.umask(os.umask(0o022) or 0)


def test_a_part_is_what_was_asked_for(
    recording: Path, samples: NDArray[np.float64], tmp_path: Path
) -> None:
    done = ab_sim(
        "export", str(recording), "--parquet", "r.parquet", "--from", "1.5", "--to", "21.9995",
        "--every", "7", "--channels", "ball_1_angle, step", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    table = pyarrow.parquet.read_table(tmp_path / "r.parquet")
    assert table.column_names == ["ball_1_angle", "step"]
    expected = samples[1500:22_000:7]
    np.testing.assert_array_equal(table["step"].to_numpy(), expected[:, 0])
    np.testing.assert_array_equal(table["ball_1_angle"].to_numpy(), expected[:, -2])


ON_EDGE = ["effects.gravity={tilt: 1.5}", "balls.count=0", "start.ball_angles=[]"]


@pytest.mark.parametrize("known", [True, False])
def test_whirl_is_measured_from_where_the_deck_hangs(known: bool, tmp_path: Path) -> None:
    scene = load_scene("feeding-deck", ON_EDGE)
    names = channels_of(scene, system_of(scene))
    samples = np.random.default_rng(2).normal(size=(300, len(names)))
    samples[:, 0] = np.arange(300)
    samples[:, 1] = np.arange(300) * 1e-3
    told = describe_scene(scene) if known else describe(balls=0)
    with Recording(tmp_path / "run.rrd", description=told) as recording:
        recording.block(names, samples)
    done = ab_sim(
        "export", "run.rrd", "--parquet", "r.parquet", "--channels", "whirl,y", cwd=tmp_path
    )
    if not known:
        assert done.returncode == 2 and not (tmp_path / "r.parquet").exists()
        assert "--channels whirl: " in done.stderr
        return
    assert done.returncode == 0, done.stderr
    table = pyarrow.parquet.read_table(tmp_path / "r.parquet")
    assert table.column_names == ["whirl", "y"]
    run = from_rest(Trajectory(names, samples), scene)
    assert not np.array_equal(run["y"], samples[:, names.index("y")])
    np.testing.assert_array_equal(table["whirl"].to_numpy(), run.whirl)


def test_every_channel_of_a_drive_has_a_unit() -> None:
    space = ("x", "y", "z", "vx", "vy", "vz", "ax", "ay", "az", "qw", "qx", "qy", "qz")
    rates = ("wx", "wy", "wz", "wx_rate", "wy_rate", "wz_rate")
    for name in channels_for((*space, *rates), 12, True, ("pickup_1", "a_2_3")):
        assert unit_of(name), name
    assert unit_of("coil [A]/2") is None


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), "nothing to write"),
        (("--csv", "r.txt"), "--csv r.txt: must end in .csv"),
        (("--parquet", "no/r.parquet"), "no folder no"),
        (("--csv", "r.csv", "--channels", "spede"), "'spede'; did you mean 'speed'?"),
        (("--csv", "r.csv", "--channels", "x,x"), "name each channel once"),
        (("--csv", "r.csv", "--from", "3", "--to", "1"), "--from 3 --to 1: "),
        (("--csv", "r.csv", "--from", "nan"), "must be times"),
        (("--csv", "r.csv", "--from", "100"), "from 100 to inf s"),
        (("--csv", "r.csv", "--every", "0"), "--every 0: "),
    ],
)
def test_bad_input_is_refused_and_leaves_nothing(
    recording: Path,
    arguments: tuple[str, ...],
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=re.escape(words)):
        app(["export", str(recording), *arguments], standalone_mode=False)
    assert list(tmp_path.iterdir()) == []


def test_what_is_damaged_is_said_and_leaves_nothing(recording: Path, tmp_path: Path) -> None:
    content = bytearray(recording.read_bytes())
    middle = len(content) // 2
    content[middle:] = b"\xff" * (len(content) - middle)
    (tmp_path / "damaged.rrd").write_bytes(content)
    with pytest.raises(RecordingError, match="damaged.rrd is damaged at"):
        app(["export", str(tmp_path / "damaged.rrd"), "--csv", str(tmp_path / "r.csv")])
    assert [path.name for path in tmp_path.iterdir()] == ["damaged.rrd"]


def test_an_empty_recording_says_so(tmp_path: Path) -> None:
    with Recording(tmp_path / "run.rrd", description=describe()):
        pass
    with pytest.raises(InputError, match="the recording is empty"):
        app(["export", str(tmp_path / "run.rrd"), "--csv", str(tmp_path / "r.csv")])
    assert not (tmp_path / "r.csv").exists()


def test_a_full_disk_is_said_and_what_was_there_stays(recording: Path, tmp_path: Path) -> None:
    (tmp_path / "r.csv").write_text("mine")
    limited = "import resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, (100000, 100000));"
    code = f"{limited} from ab_sim.cli import main; sys.argv[0] = 'ab-sim'; main()"
    done = subprocess.run(
        [sys.executable, "-c", code, "export", str(recording), "--csv", str(tmp_path / "r.csv")],
        capture_output=True, text=True, cwd=Path(__file__).resolve().parents[2],
    )  # fmt: skip
    assert done.returncode == 2 and "r.csv: cannot be written" in done.stderr, done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["r.csv"]
    assert (tmp_path / "r.csv").read_text() == "mine"


def test_ctrl_c_leaves_nothing(tmp_path: Path) -> None:
    names, samples = run(100_000)
    record(tmp_path / "run.rrd", names, samples, block=10_000)
    with subprocess.Popen(
        [sys.executable, "-m", "ab_sim", "export", "run.rrd", "--csv", "r.csv"],
        cwd=tmp_path, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parents[2])},
    ) as process:  # fmt: skip
        until(
            lambda: len(list(tmp_path.iterdir())) > 1 or process.poll() is not None,
            "it has begun to write",
            every=0.01,
        )
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130 and "nothing was written" in said, said
    assert [path.name for path in tmp_path.iterdir()] == ["run.rrd"]
