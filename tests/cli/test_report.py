"""`ab-sim report` and `ab-sim compare` as a user runs them."""

import json
import re
from pathlib import Path

import pytest

from ab_sim.base.errors import AbSimError
from ab_sim.cli.app import app
from ab_sim.drive import Drive
from ab_sim.drive.description import describe
from ab_sim.drive.trajectory import Trajectory
from ab_sim.record.recording import Recording
from ab_sim.scene import load_scene
from tests.cli.tool import PNG, ab_sim
from tests.recording.runs import record, run

BARE = ["balls.count=0", "start.ball_angles=[]", "balls.mass="]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of a second, the same without balls, one of a stranger, one torn, one empty."""
    folder = tmp_path_factory.mktemp("report")
    for name, changes in (("run", []), ("bare", BARE)):
        drive = Drive(load_scene("balanced-start-up", ["duration=1", *changes]))
        samples = Trajectory.join([drive.present(), drive.advance(1000)])
        with Recording(folder / f"{name}.rrd", description=describe(drive.scene)) as recording:
            for first in range(0, 1001, 100):
                rows = samples.samples[first : first + 100]
                recording.block(samples.channels, rows)
                recording.flush()
    record(folder / "stranger.rrd", *run(500))
    whole = (folder / "run.rrd").read_bytes()
    (folder / "torn.rrd").write_bytes(whole[: len(whole) // 2])
    with Recording(folder / "empty.rrd", description=describe(load_scene("no-ball"))):
        pass
    return folder


def test_reports_stand_side_by_side(folder: Path, tmp_path: Path) -> None:
    runs = [str(folder / f"{name}.rrd") for name in ("run", "bare", "stranger", "torn")]
    done = ab_sim(
        "report", *runs, "--png", "r.png", "--html", "r.html", "--json", "r.json", cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
    for words in ("peak W", "residual unbalance", "once per turn", "torn: incomplete: its last"):
        assert words in done.stdout, words
    assert "stranger: has no metrics" in done.stdout
    # The log of a run, not the events that a stepper locates.
    assert re.search(r"^\W*log entries\W+0\W+0\W+0\W+0\W*$", done.stdout, re.M)
    assert not re.search(r"^\W*events\b", done.stdout, re.M)
    assert (tmp_path / "r.png").read_bytes().startswith(PNG)
    page = (tmp_path / "r.html").read_text()
    assert len(page) < 10_000_000 and page.count("plotly-graph-div") > 20
    assert not re.search(r'<(script|link|img)[^>]*(src|href)="', page), "nothing from elsewhere"
    whole, bare, stranger, torn = json.loads((tmp_path / "r.json").read_text())["runs"]
    assert whole["samples"] == 1001 and whole["complete"] and whole["metrics"]["peak_time"] <= 1.0
    assert bare["metrics"]["final_ball_angles"] == []
    assert stranger["metrics"] is None and not torn["complete"] and 0 < torn["samples"] < 1001


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("report", "no.rrd"), "no.rrd: no such file"),
        (("report", "empty.rrd"), "recording is empty"),
        (("report", "run.rrd", "--png", "r.jpg"), "--png r.jpg: "),
        (("report", "run.rrd", "--html", "no/r.html"), "no folder no"),
        (("report", *["run.rrd"] * 9), "at most 8"),
        (("compare", "run.rrd", "nothing"), "nothing"),
        (("compare", "empty.rrd", "no-ball"), "compared: it is empty"),
        (("compare", "run.rrd", "no-ball", "--plot", "p.bmp"), "must end in"),
    ],
)
def test_bad_input_is_refused(
    arguments: tuple[str, ...], words: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    before = sorted(folder.iterdir())
    with pytest.raises(AbSimError, match=re.escape(words)):
        app(list(arguments), standalone_mode=False)
    assert sorted(folder.iterdir()) == before


def test_compare_says_to_the_bit(folder: Path, tmp_path: Path) -> None:
    done = ab_sim(
        "compare", str(folder / "run.rrd"), "balanced-start-up", "--json", "-", "--plot", "p.png",
        cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["same_to_the_bit"] is True
    assert "command" in [each["channel"] for each in found["channels"]]
    assert [each["channel"] for each in found["not_compared"]] == ["step", "time"]
    assert "0, to the bit" in done.stderr
    assert (tmp_path / "p.png").read_bytes().startswith(PNG)


@pytest.mark.parametrize(
    ("recorded", "with_balls", "reason"),
    [("run", False, "balanced-start-up has no such channel"), ("bare", True, "not recorded")],
)
def test_compare_names_what_it_does_not_compare(
    recorded: str, with_balls: bool, reason: str, folder: Path, tmp_path: Path
) -> None:
    changes = [] if with_balls else [word for change in BARE for word in ("--set", change)]
    done = ab_sim(
        "compare", str(folder / f"{recorded}.rrd"), "balanced-start-up", *changes,
        "--json", "-", "--plot", "p.svg", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    names = [f"ball_{i}_{what}" for i in (0, 1) for what in ("angle", "rate")]
    missing = [each["channel"] for each in found["not_compared"] if each["reason"] == reason]
    assert missing == names
    told = f"Not compared, {reason}: {', '.join(names)}."
    assert told in " ".join(done.stderr.split())
    picture = (tmp_path / "p.svg").read_text()  # has its texts as comments beside their outlines
    assert told in picture and "Compared, not drawn: " in picture
