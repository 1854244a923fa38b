"""`ab-sim sweep` as its users run it: files, pictures, errors, and an end at any instant."""

import json
import re
import signal
from pathlib import Path

import pyarrow.parquet
import pytest

import ab_sim as package
from tests.cli.killed import KeptWork
from tests.cli.tool import PNG, ab_sim, refused

SHORT = ("--set", "duration=0.4", "--set", "effects.rolling_friction=")
MASSES = "balls.mass=0.5 g..3 g:6"


def test_a_grid_is_shown_drawn_and_written(tmp_path: Path) -> None:
    done = ab_sim(
        "sweep", "thesis-hold", *SHORT, "--over", MASSES, "--over", "start.speed=0,20,40 rad/s",
        "--metrics", "peak_whirl_over_e,settled,final_tilt", "--json", "s.json",
        "--parquet", "s.parquet", "--csv", "s.csv", "--plot", "s.png", "--units", "g", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "18 runs" in done.stdout and "best peak_whirl_over_e [e]: " in done.stdout
    assert re.search(r": balls\.mass=[\d.]+ g,", done.stdout) and "Traceback" not in done.stderr
    report = json.loads((tmp_path / "s.json").read_text())
    found = package.open_sweep(tmp_path / "s.parquet")
    assert report["runs"]["peak_whirl_over_e"] == found["peak_whirl_over_e"].tolist()
    assert report["runs"]["start.speed"] == [0, 20.0, 40] * 6
    assert report["outcomes"] == found.outcomes and report["units"]["start.speed"] == "rad/s"
    assert set(report["runs"]["final_tilt"]) == {None}
    assert len((tmp_path / "s.csv").read_text().splitlines()) == 19
    assert (tmp_path / "s.png").read_bytes().startswith(PNG)


@pytest.mark.parametrize(
    "over",
    [
        ["balls.mass=0.5 g..3 g:9"],
        ["solver.stepper=rk4,rk8", "balls.mass=0.5 g..3 g:9"],
        ["balls.mass=0.5 g,1 g,-1 g", "start.speed=0,10,20", "balls.count=1..2:2"],
        ["balls.mass=-1,0.001"],
    ],
    ids=["line", "words", "three keys", "a failure"],
)
def test_every_kind_of_sweep_has_a_picture(over: list[str], tmp_path: Path) -> None:
    options = [part for each in over for part in ("--over", each)]
    angles = ("--set", "start.ball_angles=")
    done = ab_sim(
        "sweep", "thesis-hold", *SHORT, *angles, *options, "--plot", "p.svg", cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
    drawn = (tmp_path / "p.svg").read_text()
    assert "balls.mass" in drawn and "Traceback" not in done.stderr
    assert ("failed" in drawn) == ("-1" in over[-1] or "-1" in over[0])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), "Missing option"),
        (("--over", "balls.masss=1,2"), "did you mean 'balls.mass'"),
        (("--over", "balls.mass=1..2"), "needs a number of values"),
        (("--over", "balls.mass=12 mm,2 mm"), "is a length"),
        (("--over", MASSES, "--metrics", "final"), "no such metric"),
        (("--over", MASSES, "--metrics", "final_ball_angles"), "is a list, not a number"),
        (("--over", MASSES, "--workers", "0"), "--workers 0: must be at least 1"),
        (("--over", MASSES, "--design", "sobol:8"), "a design takes ranges"),
        (("--over", "balls.mass=-2,-1"), "must be at least"),
        (("--over", MASSES, "--parquet", "s.csv"), "--parquet s.csv: must end in .parquet"),
        (("--over", MASSES, "--plot", "none/s.png"), "there is no folder none"),
    ],
)
def test_bad_input_exits_with_2_and_leaves_nothing(
    arguments: tuple[str, ...], words: str, tmp_path: Path
) -> None:
    assert words in refused("sweep", "thesis-hold", *SHORT, *arguments, cwd=tmp_path)


def test_killed_at_any_time_nothing_is_lost_or_doubled(tmp_path: Path) -> None:
    """With processes that share the work."""
    work = KeptWork(
        tmp_path, "sweep", "no-ball", "--set", "duration=10", "--over",
        "rotor.eccentricity=1e-5..1e-3:3000", "--workers", "2", "--parquet", "s.parquet",
    )  # fmt: skip
    known = 0
    for number, code, further in ((signal.SIGKILL, -signal.SIGKILL, 1), (signal.SIGINT, 130, 5)):
        assert work.ended_by(number, further) == code  # three or four parts are made by no worker
        runs = work.runs()
        assert len(runs) == len(set(runs)) >= known + further
        known = len(runs)
    done = work.whole()
    assert done.returncode == 0 and "3000 runs" in done.stdout, done.stderr
    assert pyarrow.parquet.read_table(tmp_path / "s.parquet")["run"].to_pylist() == [*range(3000)]
    assert sorted(work.runs()) == [*range(3000)]
