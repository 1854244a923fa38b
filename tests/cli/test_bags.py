"""`ab-sim export --mcap`, `import`, and what they say of bad input; `run --every`."""

from __future__ import annotations

from pathlib import Path

import pytest

from ab_sim.base.errors import InputError, RecordingError
from ab_sim.cli.bags import export_command, import_command
from ab_sim.cli.recording_commands import ExportOptions, ImportOptions, ReplayOptions
from ab_sim.cli.replay import replay_command
from tests.bags.made import export_of
from tests.cli.tool import ab_sim
from tests.recorded import read_recording
from tests.recording.runs import describe, record, run


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a recording, to stand in."""
    record(tmp_path / "run.rrd", *run(100))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_there_and_back(here: Path) -> None:
    there = ab_sim("export", "run.rrd", "--mcap", "bag", "--namespace", "left", cwd=here)
    assert there.returncode == 0 and "wrote bag" in there.stderr
    assert there.stdout.startswith("100 samples in ")
    back = ab_sim("import", "bag", cwd=here)
    assert (back.returncode, back.stdout) == (0, "100 samples\n") and "wrote bag.rrd" in back.stderr
    samples = read_recording(here / "bag.rrd").samples
    assert samples.tobytes() == read_recording(here / "run.rrd").samples.tobytes()
    with pytest.raises(InputError, match="bag.rrd: exists already; .* --out bag.rrd"):
        import_command(ImportOptions(Path("bag")))
    import_command(ImportOptions(Path("bag"), Path("bag.rrd")))


def test_what_cannot_be_exported(here: Path) -> None:
    file, bag = Path("run.rrd"), Path("bag")
    Path("there").mkdir()
    for mcap, namespace, rate, match in (
        (Path("bag.mcap"), "/", None, r"bag is a folder, "),
        (Path("there"), "/", None, "--mcap there: exists already"),
        (Path("no/bag"), "/", None, "no folder no"),
        (bag, "/", 0.0, "--rate 0: messages a second"),
        (bag, "/", float("nan"), "--rate nan"),
        (bag, "a b", None, "--namespace a b: "),
    ):
        with pytest.raises(InputError, match=match):
            export_command(ExportOptions(file, mcap=mcap, namespace=namespace, rate=rate))
    with pytest.raises(RecordingError, match="no such file"):
        export_command(ExportOptions(Path("no.rrd"), mcap=bag))
    with pytest.raises(InputError, match="--every, .*whole recording"):
        export_command(ExportOptions(file, mcap=bag, every=2))
    from ab_sim.record.recording import Recording

    Recording("empty.rrd", description=describe()).close()
    with pytest.raises(RecordingError, match="recording has no samples"):
        export_command(ExportOptions(Path("empty.rrd"), mcap=bag))
    assert not bag.exists()


def test_what_cannot_be_imported_or_replayed(here: Path) -> None:
    names, samples = run(40)
    export_of(here / "bag", describe(), names, samples)
    for bag, out, match in (
        ("no", None, "no such folder"),
        ("run.rrd", None, "a folder written by rosbag2"),
        ("bag", Path("out.mcap"), "--out out.mcap: must end in .rrd"),
        ("bag", Path("no/out.rrd"), "no folder no"),
    ):
        with pytest.raises((InputError, RecordingError), match=match):
            import_command(ImportOptions(Path(bag), out))
    with pytest.raises(InputError, match="--rate -1: "):
        replay_command(ReplayOptions(Path("bag"), -1.0))


def test_a_decimated_recording_of_an_offline_run(tmp_path: Path) -> None:
    done = ab_sim(
        "run",
        "thesis-hold",
        "--set",
        "duration=2",
        "--rrd",
        "r.rrd",
        "--every",
        "100",
        cwd=tmp_path,
    )
    assert done.returncode == 0, done.stderr
    back = read_recording(tmp_path / "r.rrd")
    assert back.missing == 0 and back.complete and back["step"][-1] == 2000
    assert back.left_out + len(back.samples) == 2001 and back.left_out > 500
    alone = ab_sim("run", "thesis-hold", "--every", "100", cwd=tmp_path)
    assert (
        alone.returncode == 2 and "--every 100: applies to a recording; add --rrd" in alone.stderr
    )
