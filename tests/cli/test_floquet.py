"""`ab-sim floquet` as a user runs it."""

import json
import math
import re
from pathlib import Path
from typing import Any

import pytest

from ab_sim.base.errors import AbSimError
from ab_sim.cli.analysis_commands import FloquetOptions
from ab_sim.cli.vibration import floquet_command
from tests.cli.tool import ab_sim

PNG = b"\x89PNG"


def test_table_json_and_picture_of_multipliers(tmp_path: Path) -> None:
    files = "--json", "f.json", "--plot", "f.png"
    done = ab_sim("floquet", "feeding-deck", "--speed", "130", *files, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    report = json.loads((tmp_path / "f.json").read_text())
    assert report["found"] and report["speed"] == 130.0 and report["stable"] is False
    assert report["largest"] == pytest.approx(1.0294833, abs=1e-7)
    assert len(report["multipliers"]) == 16 and len(report["start"]) == len(report["state_names"])
    largest = max(abs(complex(*each)) for each in report["multipliers"])
    assert largest == pytest.approx(report["largest"], abs=1e-15)
    assert report["halved_step_difference"] < 1e-9 and report["residual"] < 1e-9
    (other,) = report["others"]
    assert other["found_from"] == "settled" and other["stable"], "where its balls gather"
    assert abs(other["ball_angles"][0] - other["ball_angles"][1]) < 1e-6
    for words in ("at 130 rad/s", "unstable", "1.0294833", "deck at rest", "-217.70,", "-142.30"):
        assert words in " ".join(done.stdout.split()), words
    assert (tmp_path / "f.png").read_bytes().startswith(PNG)
    assert "wrote f.json" in done.stderr and "wrote f.png" in done.stderr


def test_over_a_parameter_of_the_scene_the_border_is_located(tmp_path: Path) -> None:
    over = "--over", "effects.viscous_drag.coefficient=0.002:0.02:3"
    done = ab_sim(
        "floquet", "feeding-deck", "--speed", "195", "--from", "balanced", *over, "--json", "-",
        "--plot", "f.png", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    followed = json.loads(done.stdout)["followed"]
    assert followed["key"] == "effects.viscous_drag.coefficient"
    assert [point["stable"] for point in followed["points"]] == [False, True, True]
    (border,) = followed["borders"]
    assert 0.002 < border["value"] < 0.011 and not border["stable_below"]
    assert abs(complex(*border["multiplier"])) == pytest.approx(1.0, abs=1e-8)
    assert f"border at {border['value']:.9g}, stable above it" in " ".join(done.stderr.split())
    assert (tmp_path / "f.png").read_bytes().startswith(PNG)


def test_bad_input_exits_with_2_and_leaves_nothing(tmp_path: Path) -> None:
    files = "--json", "f.json", "--plot", "f.png"
    done = ab_sim("floquet", "feeding-deck", "--from", "balance", *files, cwd=tmp_path)
    assert done.returncode == 2 and "did you mean 'balanced'?" in " ".join(done.stderr.split())
    assert "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"speed": math.nan}, "speed = nan rad/s: must be"),
        ({"speed": 0.0}, "repeat with every turn"),
        ({"over": "speed"}, "must be KEY=from:to:count"),
        ({"over": "speed=1:nan:3"}, "two different numbers"),
        ({"over": "speed=1:2:1"}, "within 2 to 10000"),
        ({"over": "speed=100:0:2"}, "speed = 0 rad/s: must be from"),
        ({"over": "race.radus=1:2:3"}, "did you mean 'radius'?"),
        ({"over": "speed=1:2:3", "speed": 4.0}, "give one of them"),
        ({"plot": Path("p.bmp")}, ".png, .svg, .pdf"),
        ({"json": "no/r.json"}, "no folder"),
        (
            {"change": ["effects.rolling_friction={arm: 1e-6}", "balls.radius=0.001"]},
            "--set effects.rolling_friction=",
        ),
    ],
)
def test_what_is_refused_says_what_is_allowed(given: dict[str, Any], words: str) -> None:
    outputs = {name: given[name] for name in ("json", "plot") if name in given}
    with pytest.raises(AbSimError, match=re.escape(words)):
        floquet_command(FloquetOptions(**{"scene": "feeding-deck", **given})).run(**outputs)


def test_the_direction_in_which_nothing_holds_the_deck_is_named() -> None:
    loose = [
        change
        for k in range(4)
        for change in (
            *("--set", f"mounts.{k}.stiffness=[1063.1, 1063.1, 0]"),
            *("--set", f"mounts.{k}.damping=[0.6, 0.6, 0]"),
        )
    ]
    names = "Z, tilt about x, tilt about y"
    assert f"no stiffness holds it along: {names}" in words_of("check", "feeding-deck", *loose)
    assert f"undecided: no stiffness holds the deck along {names}" in words_of(
        "floquet", "feeding-deck", "--from", "balanced", *loose
    )
    assert "along: x, y" in words_of("check", "no-ball", "--set", "effects.suspension=")
    assert "no stiffness holds" not in words_of("check", "feeding-deck")


def words_of(*arguments: str) -> str:
    """What a command prints, without its frame and line breaks."""
    return " ".join(ab_sim(*arguments).stdout.replace("\u2502", " ").split())
