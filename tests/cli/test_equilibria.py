"""`ab-sim equilibria` as a user runs it."""

import json
from pathlib import Path

import numpy as np
import pytest

from ab_sim.analysis.equilibria import equilibria_of
from ab_sim.scene import load_scene
from tests.cli.tool import PNG, ab_sim


def test_it_prints_a_table_and_writes_json_and_picture(tmp_path: Path) -> None:
    done = ab_sim("equilibria", "nsc-case-3", "--json", "e.json", "--plot", "e.png", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    report = json.loads((tmp_path / "e.json").read_text())
    assert report["scene"] == "nsc-case-3"
    assert report["speed"] == 900.0, "where the profile ends"
    found = equilibria_of(load_scene("nsc-case-3"), 900.0)
    for read, state in zip(report["branches"], found.branches, strict=True):
        assert read["label"] == state.label
        assert read["W"] == state.W and read["u"] == state.u.tolist()
        assert read["theta"] == state.theta.tolist()
        assert read["lambda_max"] == state.lambda_max and read["stable"] is state.stable
        assert read["structural_zeros"] == 0 and read["assignments"] == state.assignments
        np.testing.assert_array_equal(np.array(read["eigenvalues"]) @ [1, 1j], state.eigenvalues)
    over_speed = report["over_speed"]
    assert [fold["label"] for fold in over_speed["folds"]] == ["2+0", "0+2"]
    (crossing,) = over_speed["crossings"]
    assert crossing["label"] == "balanced" and crossing["kind"] == "Hopf" and crossing["gains"]
    ((low, high),) = over_speed["without_stable_state"]
    assert low == pytest.approx(over_speed["folds"][0]["speed"], rel=1e-9)
    assert high == crossing["speed"]
    for words in (
        "nsc-case-3: where balls can rest at 900 rad/s", "0+2/1", "balanced", "unstable",
        "2+0 vanishes at 167.526084 rad/s", "balanced is stable above 192.252865 rad/s (Hopf",
        "no stable state: 167.526 to 192.253 rad/s",
        "balls that circulate, and a start-up may", "ab-sim stability nsc-case-3 --basin 12",
    ):  # fmt: skip
        assert words in done.stdout, words
    assert "balls that circulate" in report["other_motions"]
    assert (tmp_path / "e.png").read_bytes().startswith(PNG)
    assert "wrote e.png" in done.stderr


def test_json_to_standard_output_is_only_json() -> None:
    done = ab_sim("equilibria", "nsc-case-2", "--speed", "900", "--json", "-")
    assert done.returncode == 0, done.stderr
    branches = {each["label"]: each for each in json.loads(done.stdout)["branches"]}
    assert branches["balanced"]["stable"] is None
    assert branches["balanced"]["verdict"] == "undecided"
    assert branches["balanced"]["comes_back"] is True
    assert {each["held_by_friction"] for each in branches.values()} == {None}
    assert "balanced: undecided" in done.stderr and "all come back" in done.stderr


def test_friction_holds_balls_about_the_states_without_it() -> None:
    done = ab_sim("equilibria", "thesis-hold", "--json", "-")
    assert done.returncode == 0, done.stderr
    for state in json.loads(done.stdout)["branches"]:
        for theta, (low, high) in zip(state["theta"], state["held_by_friction"], strict=True):
            assert low < theta < high
        assert state["comes_back"] is None
    assert "balanced: friction holds each ball" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("on-edge",), "use ab-sim floquet"),
        (("weak-motor",), "effects.motor"),
        (("nsc-case-3", "--speed", "nan"), "--speed nan: must be a number within"),
        (("nsc-case-3", "--plot", "e.txt"), "--plot"),
    ],
)
def test_bad_input_is_refused(arguments: tuple[str, ...], words: str) -> None:
    done = ab_sim("equilibria", *arguments)
    assert done.returncode == 2
    assert words in done.stderr
    assert "Traceback" not in done.stderr
