"""`ab-sim sensitivity` as a user runs it."""

import json
import re
import shlex
from pathlib import Path

import pytest

import ab_sim as package
from ab_sim.cli.sensitivity import with_uncertainty
from tests.cli.tool import PNG, ab_sim, refused


def test_sensitivity_prints_a_table_and_writes_json_and_picture(tmp_path: Path) -> None:
    done = ab_sim(
        "sensitivity", "on-edge", "--set", "effects.ball_contact=", "--set", "duration=0.7",
        "--set", "start.ball_angles=[0,0]",
        "--of", "final_whirl_over_e,peak_whirl_over_e", "--json", "s.json", "--plot", "s.png",
        cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    metrics = json.loads((tmp_path / "s.json").read_text())["metrics"]
    assert list(metrics) == ["final_whirl_over_e", "peak_whirl_over_e"]
    by = metrics["final_whirl_over_e"]["by"]
    assert by["balls.mass"]["unit"] == "kg" and by["balls.mass"]["value"] == 1e-3
    elasticity = by["balls.mass"]["derivative"] * 1e-3 / metrics["final_whirl_over_e"]["value"]
    assert by["balls.mass"]["elasticity"] == pytest.approx(elasticity)
    assert 0.0 < by["balls.mass"]["uncertainty"] < 1e-4 * by["balls.mass"]["derivative"]
    for words in (
        "on-edge: final_whirl_over_e [e] =", "% per %", "central differences of runs by rk8",
        "+-", "no influence on",
        "value 0, so no % per % and not in the picture; derivative: ",
    ):  # fmt: skip
        assert words in " ".join(done.stdout.split()), words
    assert (tmp_path / "s.png").read_bytes().startswith(PNG)


def test_an_unsettled_run_is_said() -> None:
    done = ab_sim("sensitivity", "balanced-start-up", "--set", "duration=4", "--to", "balls.mass")
    assert done.returncode == 0, done.stderr
    said = " ".join(done.stdout.split())
    assert "the run has not settled: final values still change" in said


def test_examples_of_page_and_docstring_differentiate_settled_runs(tmp_path: Path) -> None:
    page = Path(package.__file__).parents[1] / "docs" / "howto" / "sensitivity.md"
    text = page.read_text(encoding="utf-8")
    (command,) = re.findall(r"^\.venv/bin/ab-sim (sensitivity .*)$", text, re.MULTILINE)
    few = ("--to", "balls.mass,rotor.eccentricity", "--json", "s.json")
    done = ab_sim(*shlex.split(command), *few, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "has not settled" not in " ".join(done.stdout.split())
    metrics = json.loads((tmp_path / "s.json").read_text())["metrics"]
    assert len(metrics) == 2
    assert all(by["derivative"] for each in metrics.values() for by in each["by"].values())
    docstring = package.metric_sensitivities.__doc__ or ""
    scenes = re.findall(r"= (ab_sim\.load_scene\(.*\))$", text + docstring, re.MULTILINE)
    assert len(scenes) == 2
    for call in scenes:
        scene = eval(call, {"ab_sim": package})
        assert scene.duration > 2.0 and package.simulate(scene).metrics["settled"], call


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--of", "balanced"), "metric 'balanced': is not a number"),
        (("--of", "final_whirl"), "did you mean"),
        (("--of", "final_speed,"), "must be different names separated by commas"),
        (("--to", "balls.mass,balls.mass"), "must be different names separated by commas"),
        (("--to", "balls.mas"), "did you mean 'balls.mass'?"),
        (("--plot", "s.txt"), "s.txt"),
    ],
)
def test_bad_words_end_in_one_message(arguments: tuple[str, str], said: str) -> None:
    assert said in refused("sensitivity", "thesis-hold", "--set", "duration=0.05", *arguments)


def test_what_is_not_differentiable_is_named() -> None:
    done = ab_sim(
        "sensitivity", "packed-balls", "--set", "duration=0.01", "--to", "start.ball_angles.3"
    )
    assert done.returncode == 0, done.stderr
    words = " ".join(done.stdout.split())
    assert (
        "final_whirl_over_e is not differentiable here with respect to start.ball_angles.3" in words
    )


@pytest.mark.parametrize(
    ("value", "uncertainty", "text"),
    [
        (1.23456, 0.02, "1.23 +- 0.02"),
        (-75.8309123, 5e-5, "-75.8309 +- 5e-05"),
        (0.3, 2.0, "0.3 +- 2"),
        (0.0, 1e-9, "0 +- 1e-09"),
    ],
)
def test_digits_end_where_a_value_is_uncertain(value: float, uncertainty: float, text: str) -> None:
    assert with_uncertainty(value, uncertainty) == text
