"""`ab-sim modes` as a user runs it."""

import json
from pathlib import Path

import numpy as np
import pytest

from ab_sim.analysis.modes import vibration_of
from ab_sim.scene import load_scene
from tests.cli.tool import PNG, ab_sim, refused


def test_modes_prints_a_table_and_writes_json_and_picture(tmp_path: Path) -> None:
    done = ab_sim(
        "modes", "feeding-deck", "--speed", "335", "--json", "m.json", "--plot", "m.png",
        cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    report = json.loads((tmp_path / "m.json").read_text())
    assert report["scene"] == "feeding-deck" and report["speed"] == 335.0
    assert report["coordinates"][2:4] == ["Z", "tilt about x"] and report["units"][2:4] == [
        "m",
        "rad",
    ]
    assert "averaged over one turn" in report["averaging"] and report["rest"] == [0.0] * 6
    found = vibration_of(load_scene("feeding-deck"), 335.0)
    for read, mode in zip(report["modes"], found.modes, strict=True):
        assert read["frequency"] == mode.frequency
        assert read["damping_ratio"] == mode.damping_ratio
        assert read["sense"] == mode.sense and read["whirl"] == mode.whirl
        np.testing.assert_array_equal(np.array(read["shape"]) @ [1, 1j], mode.shape)
        np.testing.assert_array_equal(np.array(read["eigenvalues"]) @ [1, 1j], mode.eigenvalues)
    over_speed = report["over_speed"]
    assert over_speed["speeds"][0] == 0.0 and over_speed["speeds"][-1] == 500.0
    critical = [round(each["speed"]) for each in over_speed["critical_speeds"]]
    assert critical == [179, 180, 181, 317, 335, 358]
    for words in (
        "feeding-deck: modes at 335 rad/s", "316.20", "backward", "back and forth",
        "tilt about x, Z",
        "316.91 (backward), 335.36, 357.85 (forward)", "balls spread evenly",
    ):  # fmt: skip
        assert words in done.stdout, words
    assert (tmp_path / "m.png").read_bytes().startswith(PNG)
    assert "wrote m.png" in done.stderr


def test_json_to_standard_output_is_only_json() -> None:
    done = ab_sim("modes", "on-edge", "--json", "-")
    assert done.returncode == 0, done.stderr
    frequencies = [mode["frequency"] for mode in json.loads(done.stdout)["modes"]]
    assert frequencies == pytest.approx([100.0, 100.0 * np.sqrt(1.5)]), "k_2 = 1.5 k_1"
    assert "about the deck's rest position: x = 0 m, y = -0.00065" in done.stderr


def test_a_scene_without_suspension_says_so() -> None:
    done = ab_sim("modes", "no-ball", "--set", "effects.suspension=", "--json", "-")
    assert done.returncode == 0, done.stderr
    for mode in json.loads(done.stdout)["modes"]:
        assert mode["frequency"] == 0.0 and mode["damping_ratio"] is None
    assert "rest position: no suspension" in done.stderr
    assert "nothing restores it" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--speed", "nan"), "--speed nan: must be a number within +-100000 rad/s"),
        (("--speed", "1e6"), "--speed 1000000.0: must be a number within"),
        (("--plot", "p.bmp"), "must end in one of .png, .svg, .pdf"),
        (("--json", "no/r.json"), "there is no folder"),
        (("--set", "mounts=[]", "--set", "effects.gravity.tilt=0"), "no place was found where"),
    ],
)
def test_bad_input_exits_with_2_and_leaves_nothing(
    arguments: tuple[str, ...], words: str, tmp_path: Path
) -> None:
    assert words in refused("modes", "feeding-deck", *arguments, cwd=tmp_path)
