"""`ab-sim equilibria` as a user runs it."""

import json
from pathlib import Path

import numpy as np
import pytest

from ab_sim.analysis.equilibria import equilibria_of
from ab_sim.scene import load_scene
from tests.cli.tool import PNG, ab_sim, refused


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
        "nsc-case-3: resting states at 900 rad/s", "0+2/1", "balanced", "unstable",
        "2+0 vanishes at 167.526084 rad/s", "balanced is stable above 192.252865 rad/s (Hopf",
        "no stable state: 167.526 to 192.253 rad/s",
        "no bunch of balls circulates at 900 rad/s", "a start-up may end in any",
        "ab-sim stability nsc-case-3 --basin 12",
    ):  # fmt: skip
        assert words in done.stdout, words
    assert "circulating balls" in report["other_motions"]
    assert report["circulation"]["numbers"] == [2, 1] and report["circulation"]["states"] == []
    assert (tmp_path / "e.png").read_bytes().startswith(PNG)
    assert "wrote e.png" in done.stderr


def test_json_to_standard_output_is_only_json() -> None:
    done = ab_sim("equilibria", "nsc-case-2", "--speed", "900", "--json", "-")
    assert done.returncode == 0, done.stderr
    branches = {each["label"]: each for each in json.loads(done.stdout)["branches"]}
    assert branches["balanced"]["stable"] is None
    assert branches["balanced"]["verdict"] == "undecided"
    assert branches["balanced"]["returns"] is True
    assert {each["held_by_friction"] for each in branches.values()} == {None}
    assert "balanced: undecided" in done.stderr and "all come back" in done.stderr


def test_friction_holds_balls_about_the_states_without_it() -> None:
    done = ab_sim("equilibria", "thesis-hold", "--json", "-")
    assert done.returncode == 0, done.stderr
    for state in json.loads(done.stdout)["branches"]:
        for theta, (low, high) in zip(state["theta"], state["held_by_friction"], strict=True):
            assert low < theta < high
        assert state["returns"] is None
    assert "balanced: friction holds" in done.stderr


HEAVY = ("--set", "balls.mass=4e-3", "--set", "effects.viscous_drag.coefficient=0.01")


def test_balls_that_circulate_beside_balance_are_named() -> None:
    done = ab_sim("equilibria", "nsc-case-3", *HEAVY, "--json", "-")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)["circulation"]
    (state,) = found["states"]
    assert found["reason_not_covered"] is None and found["other_speed_ranges"] == []
    assert state["balls"] == 2 and state["stable"] is True and state["run_speed"] is None
    assert state["speed"] == state["exact"]["speed"] == pytest.approx(179.61867, rel=1e-7)
    assert state["closed_form"]["speed"] == pytest.approx(179.61867, rel=1e-4)
    # The bunch parts where it turns at the critical speed: a formula.
    critical, M = (8000.0 / 0.224) ** 0.5, 0.224
    top = critical + 2 * (4e-3) ** 2 * critical**3 / (25.0 * 0.01)
    assert M == pytest.approx(0.216 + 2 * 4e-3)
    assert state["over_speed"]["high"] == pytest.approx(top, rel=1e-9)
    for words in (
        "balls can also circulate, coexisting with balanced: stable:",
        "2 of 2 at 179.6 rad/s (stable); at spindle speeds from 84.37 to 1053 rad/s",
        "with drags to 0.01215 N s/m",
    ):
        assert words in " ".join(done.stderr.split()), words


def test_where_nothing_rests_stably_balls_circulate() -> None:
    """The thesis' own hold: at 100 rad/s no state is stable."""
    done = ab_sim("equilibria", "thesis-hold", "--speed", "100", "--json", "-")
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert not any(each["stable"] for each in report["branches"])
    (state,) = report["circulation"]["states"]
    assert state["exact"]["stable"] and state["speed"] == pytest.approx(98.342946, rel=1e-7)
    assert state["closed_form"]["bunch_swing"] > 1.0 and state["over_speed"] is None
    assert "circulate, where no resting state is stable:" in " ".join(done.stderr.split())


def test_where_they_are_not_looked_for_it_says_why() -> None:
    done = ab_sim("equilibria", "packed-balls", "--set", "balls.count=2", "--json", "-")
    assert done.returncode == 0, done.stderr
    reason = json.loads(done.stdout)["circulation"]["reason_not_covered"]
    assert reason.startswith("effects.ball_contact: ")
    assert f"circulating balls were not searched for: {reason}" in " ".join(done.stderr.split())


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("on-edge",), "use ab-sim floquet"),
        (("weak-motor",), "effects.motor"),
        (("nsc-case-3", "--speed", "nan"), "--speed nan: must be a number within"),
        (("nsc-case-3", "--speed", "1e-320"), "rad/s, and 0 or at least 1e-06 in size"),
        (("nsc-case-3", "--plot", "e.txt"), "--plot"),
    ],
)
def test_bad_input_is_refused(arguments: tuple[str, ...], words: str) -> None:
    assert words in refused("equilibria", *arguments)
