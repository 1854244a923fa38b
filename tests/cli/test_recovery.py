"""`ab-sim recovery` as a user runs it."""

import json
from pathlib import Path

import pytest

from ab_sim.base.errors import InputError
from ab_sim.cli.vibration import drags_of
from tests.cli.tool import PNG, ab_sim, refused


def test_recovery_prints_tables_and_writes_json_and_picture(tmp_path: Path) -> None:
    done = ab_sim(
        "recovery", "nsc-case-3", "--drags", "0.2:0.3:2", "--json", "r.json", "--plot", "r.png",
        cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    report = json.loads((tmp_path / "r.json").read_text())
    assert report["scene"] == "nsc-case-3" and report["balls"] == 2 and report["drag"] == 0.2
    assert (report["from_speed"], report["to_speed"], report["band"]) == (1000.0, 900.0, 1e-9)
    assert report["settling_time"] == pytest.approx(7.06793, abs=6e-6)
    assert report["lambda_max"] == pytest.approx(-0.7603, abs=5e-5)
    assert report["label"] == "balanced" and report["verdict"] == "stable"
    assert report["one_ball"]["maximum_amplitude"] == pytest.approx(1.1990e-5, rel=1e-4)
    assert [each["drag"] for each in report["over_drag"]] == [0.2, 0.3]
    assert report["best_drag"] in (0.2, 0.3)
    assert report["one_ball"]["best_drag"] in [each["drag"] for each in report["over_drag"]]
    assert all(each["composite_index"] > 0.0 for each in report["one_ball"]["over_drag"])
    for words in (
        "nsc-case-3, 2 balls: from 1000 to 900 rad/s, settled within 1e-06 mm", "7.06793",
        "nsc-case-3, 1 ball:", "0.93386", "scene: 0.2", "best of these drags",
    ):  # fmt: skip
        assert words in done.stdout, words
    assert (tmp_path / "r.png").read_bytes().startswith(PNG)
    assert "wrote r.json" in done.stderr and "wrote r.png" in done.stderr


def test_what_does_not_settle_is_null_and_said() -> None:
    done = ab_sim(
        "recovery", "nsc-case-3", "--drags", "0.2:0.3:2", "--set", "profile.to_speed=180", "--set",
        "duration=11", "--json", "-",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert report["settling_time"] is None and report["best_drag"] is None
    assert report["over_drag"][0]["composite_index"] is None
    assert "not settled after 88 s" in done.stderr and "nowhere" in done.stderr


@pytest.mark.parametrize(
    "text", ["0.5:0.1:5", "0:0.1:5", "nan:1:5", "0.1:inf:5", "0.1:0.5:1", "0.1:0.5:1001", "0.1,0.5"]
)
def test_drags_that_are_none_are_refused(text: str) -> None:
    with pytest.raises(InputError, match=f"--drags {text}: must be first:last:count"):
        drags_of(text)


def test_drags_are_round_numbers() -> None:
    assert drags_of("0.1:0.5:5") == (0.1, 0.2, 0.3, 0.4, 0.5)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--drags", "1:0:5"), "--drags 1:0:5: must be first:last:count"),
        (("--plot", "p.bmp"), "must end in one of .png, .svg, .pdf"),
        (("--set", "profile="), "has no change of speed to recover from"),
    ],
)
def test_bad_input_exits_with_2_and_leaves_nothing(
    arguments: tuple[str, ...], words: str, tmp_path: Path
) -> None:
    assert words in refused("recovery", "nsc-case-1", *arguments, cwd=tmp_path)
