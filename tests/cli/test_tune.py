"""`ab-sim tune` as its users run it."""

import json
from pathlib import Path

import pytest
import yaml

import ab_sim as package
from tests.cli.tool import PNG, ab_sim, refused

SHORT = ("--runs", "100")
MASS = ("--vary", "balls.mass=0.5 g..1.5 g")


def test_the_best_is_shown_drawn_and_written(tmp_path: Path) -> None:
    done = ab_sim(
        "tune", "balanced-start-up", *SHORT, *MASS, "--minimise", "peak_whirl_over_e",
        "--subject-to", "peak_whirl_over_e>10", "--scene", "best.yaml", "--parquet", "runs.parquet",
        "--plot", "t.png", "--json", "t.json", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    report = json.loads((tmp_path / "t.json").read_text())
    assert report["found"] and report["is_better"]
    assert report["active"] == ["balls.mass=0.0005"] and "at an end of its range" in done.stdout
    scene = package.load_scene(tmp_path / "best.yaml")
    assert scene.as_mapping() == report["scene"] and scene.name == "balanced-start-up-tuned"
    head = (tmp_path / "best.yaml").read_text()
    assert head.startswith("# made by ab-sim tune ") and "#   with peak_whirl_over_e>10" in head
    assert scene.balls.masses[0] == report["values"]["balls.mass"]
    assert package.simulate(scene).metrics["peak_whirl_over_e"] == report["best"]
    runs = package.open_sweep(tmp_path / "runs.parquet")
    assert runs["peak_whirl_over_e"].tolist() == report["runs"]["peak_whirl_over_e"]
    assert (tmp_path / "t.png").read_bytes().startswith(PNG)
    assert "5 % beside" not in done.stdout and "the scene as it is: " in done.stdout
    assert [each["scene"] for each in report["before"]] == [
        "as it is", "without its variable-speed period"
    ]  # fmt: skip


def test_where_nothing_is_found_it_names_no_best(tmp_path: Path) -> None:
    done = ab_sim(
        "tune", "balanced-start-up", *SHORT, *MASS, "--minimise", "peak_whirl_over_e",
        "--subject-to", "peak_whirl_over_e<1", "--subject-to", "balanced", "--scene", "best.yaml",
        "--json", "t.json", "--plot", "t.png", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 1
    assert "ab-sim: nothing found: no run" in done.stderr
    assert not (tmp_path / "best.yaml").exists() and "wrote best.yaml" not in done.stderr
    assert "wrote t.png" in done.stderr and "wrote t.json" in done.stderr
    said = " ".join(done.stdout.split())
    assert "peak_whirl_over_e<1 holds for none of " in said
    assert (
        " balanced holds for " in said
        and "; the nearest: residual_unbalance = " in said
        and " at balls.mass=" in said
    )
    report = json.loads((tmp_path / "t.json").read_text())
    assert report["found"] is False and report["best"] is None and report["values"] == {}
    assert yaml.safe_load("null") is report["scene"]


def test_it_says_which_candidates_do_not_count(tmp_path: Path) -> None:
    done = ab_sim(
        "tune", "balanced-start-up", "--set", "duration=2.5", "--runs", "16", *MASS,
        "--minimise", "final_whirl_over_e", "--json", "t.json", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    report = json.loads((tmp_path / "t.json").read_text())
    rows = zip(report["runs"]["outcome"], report["runs"]["final_whirl_over_e"], strict=True)
    changing = [value for outcome, value in rows if outcome == "not balanced, still changing"]
    better = sum(value < report["best"] for value in changing)
    assert better > 0
    assert (
        f"not counted: {len(changing)} candidates, not balanced, still changing, {better} of them "
        "better at their end than the best"
    ) in " ".join(done.stdout.split())


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (MASS, "either to minimise or to maximise"),
        ((*MASS, "--minimise", "peak_whirl"), "no such metric"),
        ((*MASS, "--minimise", "balanced"), "maximise it"),
        (("--vary", "balls.mass=1,2", "--minimise", "peak_whirl_over_e"), "must be a range"),
        ((*MASS, "--minimise", "peak_whirl_over_e", "--subject-to", "a"), "no such metric"),
        ((*MASS, "--minimise", "peak_whirl_over_e", "--scene", "b.txt"), "must end in"),
        ((*MASS, "--minimise", "peak_whirl_over_e", "--runs", "3"), "must be from 16"),
    ],
)
def test_bad_input_exits_with_2_and_leaves_nothing(
    arguments: tuple[str, ...], words: str, tmp_path: Path
) -> None:
    assert words in refused("tune", "balanced-start-up", *arguments, cwd=tmp_path)
