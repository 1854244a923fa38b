"""`ab-sim robust` as its users run it: files, pictures and errors."""

import json
import shlex
from pathlib import Path

import pytest

import ab_sim as package
from ab_sim.base.yaml_files import yaml_text
from tests.cli.tool import PNG, ab_sim, refused

pytestmark = pytest.mark.long

SHORT = ("--set", "duration=0.4", "--set", "effects.rolling_friction=")
SPREAD = (
    "--spread", "balls.mass=5% per ball", "--spread", "rotor.eccentricity=lognormal:0.1 mm,40%",
    "--spread", "start.ball_angles=random",
)  # fmt: skip
SMALL = ("--balanced", "peak_whirl_over_e<0.03")


def test_a_spread_is_shown_drawn_and_written(tmp_path: Path) -> None:
    done = ab_sim(
        "robust", "thesis-hold", *SHORT, *SPREAD, *SMALL, "--runs", "60", "--against",
        "balanced-start-up", "--metrics", "peak_whirl_over_e,final_tilt", "--sobol", "8",
        "--json", "s.json", "--parquet", "s.parquet", "--csv", "s.csv", "--plot", "s.png",
        "--worst", "worst", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "of 60 drives balance" in done.stdout and "peak_whirl_over_e<0.03" in done.stdout
    assert "more runs" in done.stdout and "Sobol indices" in done.stdout
    assert "balanced-start-up, with the same draws" in done.stdout and "McNemar" in done.stdout
    pairs = done.stdout.partition("draw by draw")[2].partition("worst runs by")[0]
    assert "peak_whirl_over_e [e]" in pairs
    assert (
        "8 pairs of drives, with 24 further runs" in done.stdout and "Traceback" not in done.stderr
    )
    assert "use --sobol 128 or more" in " ".join(done.stdout.split())
    report = json.loads((tmp_path / "s.json").read_text())
    found = package.open_sweep(tmp_path / "s.parquet")
    assert report["runs"]["peak_whirl_over_e"] == found["peak_whirl_over_e"].tolist()
    assert report["share"]["runs"] == 60 and report["against"]["share"]["runs"] == 60
    assert set(report["quantiles"]) == {"peak_whirl_over_e", "final_tilt"}
    assert report["quantiles"]["final_tilt"] == []
    assert len((tmp_path / "s.csv").read_text().splitlines()) == 61
    assert (tmp_path / "s.png").read_bytes().startswith(PNG)
    assert len(list((tmp_path / "worst").glob("run-*.yaml"))) == 10
    lines = [line for line in done.stdout.splitlines() if line.startswith("run ")]
    again = shlex.split(lines[0].partition("ab-sim ")[2])
    ran = ab_sim(*again, "--json", "again.json", cwd=tmp_path)
    assert ran.returncode == 0, ran.stderr
    value = json.loads((tmp_path / "again.json").read_text())["peak_whirl_over_e"]
    assert value == report["worst"][0]["value"]


def test_until_goes_on_and_more_runs_find_those_that_are_done(tmp_path: Path) -> None:
    words = ("robust", "thesis-hold", *SHORT, *SPREAD[:4], *SMALL, "--sobol", "0")
    done = ab_sim(*words, "--runs", "50", "--until", "9%", "--json", "s.json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    report = json.loads((tmp_path / "s.json").read_text())
    share = report["share"]
    assert (share["high"] - share["low"]) / 2 <= 0.09
    assert "no Sobol indices: none were requested\n" in done.stdout
    more = ab_sim(*words, "--runs", "300", "--json", "m.json", cwd=tmp_path)
    assert more.returncode == 0, more.stderr
    other = json.loads((tmp_path / "m.json").read_text())["runs"]
    for key, values in report["runs"].items():
        assert other[key][: len(values)] == values


@pytest.mark.parametrize(
    "words",
    [
        (*SPREAD, "--balanced", "peak_whirl_over_e<1e9"),
        ("--spread", "rotor.eccentricity=100%", "--spread", "balls.mass=1%"),
    ],
    ids=["all balance", "failures"],
)
def test_every_kind_of_spread_has_a_picture(words: tuple[str, ...], tmp_path: Path) -> None:
    done = ab_sim(
        "robust", "thesis-hold", *SHORT, *words, "--runs", "40", "--plot", "p.svg", cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
    assert "share of" in (tmp_path / "p.svg").read_text() and "Traceback" not in done.stderr
    assert ("failed runs count as not balanced" in done.stdout) == ("100%" in words[1])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), "nothing is spread; name a key"),
        (("--spread", "balls.masss=5%"), "did you mean 'balls.mass'"),
        (("--spread", "balls.mass=5 mm"), "is a length"),
        (
            ("--spread", "balls.mass=1"),
            "is 1000 times the value, balls.mass = 0.001",
        ),
        (("--spread", "balls.mass=five"), "'five' is not a number"),
        ((*SPREAD, "--balanced", "residual<1"), "no such metric"),
        ((*SPREAD, "--balanced", "final_tilt"), "add a limit"),
        ((*SPREAD, "--metrics", "final"), "no such metric"),
        ((*SPREAD, "--workers", "0"), "--workers 0: must be at least 1"),
        ((*SPREAD, "--until", "soon"), "--until 'soon': must be the half-width"),
        ((*SPREAD, "--until", "0%"), "until 0: must be a share"),
        ((*SPREAD, "--runs", "99999999"), "99999999 runs: must be from 1"),
        ((*SPREAD, "--sobol", "7"), "must be 0, for none, or a power of 2"),
        ((*SPREAD, "--against", "thesis-hol"), "did you mean 'thesis-hold'"),
        ((*SPREAD, "--against", "no-ball"), "the scene no-ball has no balls"),
        ((*SPREAD, "--parquet", "s.csv"), "--parquet s.csv: must end in .parquet"),
        ((*SPREAD, "--plot", "none/s.png"), "there is no folder none"),
        ((*SPREAD, "--worst", "none/worst"), "there is no folder none"),
    ],
)
def test_bad_input_exits_with_2_and_leaves_nothing(
    arguments: tuple[str, ...], words: str, tmp_path: Path
) -> None:
    assert words in refused("robust", "thesis-hold", *SHORT, *arguments, cwd=tmp_path)


def test_two_scenes_of_one_name_are_told_apart_by_their_files(tmp_path: Path) -> None:
    scene = package.load_scene("thesis-hold", ["name=thesis-hold"])
    (tmp_path / "my.yaml").write_text(yaml_text(scene.as_mapping()))
    done = ab_sim(
        "robust", "my.yaml", *SHORT, "--spread", "balls.mass=5%", *SMALL, "--runs", "20",
        "--against", "thesis-hold", "--plot", "p.svg", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "share of" in (tmp_path / "p.svg").read_text()
    said = " ".join(done.stdout.split())
    assert "no Sobol indices: there is one factor only " in said and "requested" not in said
    assert "thesis-hold (my.yaml --set duration=0.4 " in said
    assert "thesis-hold (thesis-hold), with the same draws" in said


def test_few_runs_have_no_sobol_indices_unless_asked_for(tmp_path: Path) -> None:
    words = ("--spread", "balls.mass=5%", "--spread", "rotor.eccentricity=5%", "--runs", "40")
    bounds = ("--balanced", "balanced", "--balanced", "settled", *SMALL)
    done = ab_sim("robust", "thesis-hold", *SHORT, *words, *bounds, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    said = " ".join(done.stdout.split())
    assert "; settled or ringing down, and balanced and settled and peak_whirl_over_e<0.03 " in said
    few = "runs = 40 are too few: reliable indices need 128 pairs, which take 512 runs; fewer"
    assert f"no Sobol indices: {few} pairs may be requested (sobol)" in said
    assert "with others" not in said
