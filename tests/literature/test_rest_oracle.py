"""Where balls rest: values computed by independent means, and what the papers print.

Sources: ``rest_oracle.json``, cases R1a, R4 and R5 of the project's ``shared/oracle/rest.json``
(shared/REST.md); P16 of ``oracle.json``; three-ball (Lu and Hung 2008) figure 5.

Frames: u on rotating axes, theta from the unbalance. Tolerances: those that the cases state, W
1e-10 relative, angles 1e-10, eigenvalues 1e-8 as sets, folds and crossings 1e-8 relative.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from ab_sim.analysis.equilibria import RestingState, branches_over_speed, equilibria_of
from ab_sim.analysis.equilibria.at_speed import balanced_state
from ab_sim.analysis.equilibria.balanced import completed
from ab_sim.analysis.equilibria.resting import resting_system, rotor_of
from ab_sim.base.presentation import in_one_turn
from ab_sim.scene import Scene, load_scene
from tests.analysis.equilibria.drives import drive, of_oracle

FOLDER = Path(__file__).parent
CASES = {c["id"]: c for c in json.loads((FOLDER / "rest_oracle.json").read_text())["cases"]}
P16 = next(c for c in json.loads((FOLDER / "oracle.json").read_text())["cases"] if c["id"] == "P16")


def ordered(angles: Any) -> np.ndarray:
    """Angles [rad] in one turn, in order: however many turns they are given with."""
    return np.sort(in_one_turn(np.asarray(angles)))


def at_positions(scene: Scene, speed: float, given: list[float]) -> RestingState:
    """The balanced state with the last balls at given angles."""
    system = resting_system(scene)
    rotor = rotor_of(system)
    assert rotor is not None
    theta = completed(rotor, np.array(given))
    assert theta is not None
    return balanced_state(system, rotor, speed, theta)


@pytest.mark.parametrize("case", CASES["R1a"]["expected"], ids=lambda c: f"{c['n']}-{c['ratio']}")
def test_equilibria_of_equal_balls(case: dict[str, Any]) -> None:
    scene, speed = of_oracle(case["params"]), case["speed"]
    found = {state.label: state for state in equilibria_of(scene, speed).branches}
    clustered = [label for label in found if not label.startswith("balanced")]
    wanted = [w["label"] for w in case["equilibria"] if not w["label"].startswith("balanced")]
    assert sorted(clustered) == sorted(wanted), "all of them, and no others"
    for want in case["equilibria"]:
        label = want["label"]
        if label.startswith("balanced"):
            state = at_positions(scene, speed, json.loads(label.split("given ")[1]))
        else:
            state = found[label]
        assert state.W == pytest.approx(want["W"], rel=1e-10, abs=1e-20)
        off = ordered(state.theta) - ordered(want["theta"])
        assert np.abs(off).max() < 1e-10
        if want["phase"] is not None:
            assert state.phase == pytest.approx(want["phase"], abs=1e-10)
        assert state.assignments == want["assignments"]
        assert state.structural_zeros == want["structural_zeros"]
        assert state.lambda_max == pytest.approx(want["max_real"], abs=1e-8)
        assert state.stable is want["stable"]
        assert spectra_apart(state, want["eigenvalues"]) < 1e-8
        assert np.sort(np.abs(state.eigenvalues))[: state.structural_zeros].max(initial=0) < 1e-9


def spectra_apart(state: RestingState, want: list[list[float]]) -> float:
    """As sets."""
    values = np.array([complex(*pair) for pair in want])
    apart = np.abs(values[:, None] - state.eigenvalues)
    return float(apart[linear_sum_assignment(apart)].max())


def test_folds() -> None:
    for case in CASES["R4"]["expected"]:
        scene = of_oracle(case["params"])
        over_speed = branches_over_speed(scene, np.array([90.0, 97.0, 103.0, 110.0]))
        (fold,) = [fold for label, fold in over_speed.folds if label == case["label"]]
        assert fold.speed == pytest.approx(case["speed"], rel=1e-12)
        assert fold.W == pytest.approx(case["W"], rel=1e-8)
        assert fold.kind == case["kind"]


def test_stability_crossings() -> None:
    for case in CASES["R5"]["expected"]:
        assert case["what"] == "balanced"
        speeds = np.linspace(*case["scan"], 40)
        over_speed = branches_over_speed(of_oracle(case["params"]), speeds)
        found = [each for each in over_speed.crossings if each.label == "balanced"]
        assert len(found) == len(case["crossings"])
        for each, want in zip(found, case["crossings"], strict=True):
            assert each.speed == pytest.approx(want["speed"], rel=1e-8)
            assert each.frequency == pytest.approx(want["frequency"], rel=1e-8)
            assert each.kind == want["kind"]
            assert each.gains is (want["direction"] == "+ to -")


def nsc(n: int, mass: float) -> Scene:
    """Relative-stability's Table 1."""
    return drive(
        M=0.216 + n * mass, me=0.016 * 0.625e-3, k=8000.0, c=25.0, R=0.0165, m=(mass,) * n,
        cb=0.2, rolls=False,
    )  # fmt: skip


@pytest.mark.parametrize("want", P16["expected"], ids=lambda w: f"{w['n']}-{w['mass_factor']}")
def test_equilibria_of_the_nsc_rotor(want: dict[str, Any]) -> None:
    """The best branch at 900 rad/s: r to 1e-9, lambda_Rmax to 1e-8."""
    scene, n = nsc(want["n"], want["m"]), want["n"]
    if want["branch"].startswith("bal") and n > 2:
        state = at_positions(scene, 900.0, want["beta"][2:])
        turned = sorted(want["beta"])
        if n == 5:
            # Completing takes pairs as they come; the oracle's is the symmetric one.
            state = equilibria_of(scene, 900.0).branches[-3]
        np.testing.assert_allclose(ordered(state.theta), ordered(turned), atol=1e-10)
    else:
        states = equilibria_of(scene, 900.0).branches
        state = min(states, key=lambda each: each.lambda_max)
        off = ordered(state.theta) - ordered(want["beta"])
        assert np.abs(off).max() < 1e-10
    assert state.W == pytest.approx(want["r"], rel=1e-9)
    assert state.lambda_max == pytest.approx(want["lam_Rmax"], abs=1e-10)


def test_no_stable_state_in_case_3() -> None:
    """For .872 < w/w_n < 1.0005 (EQUATIONS.md, 3)."""
    scene = load_scene("nsc-case-3")
    over_speed = branches_over_speed(scene, np.linspace(20.0, 400.0, 40))
    ((low, high),) = over_speed.without_stable_state
    assert scene.critical_speed is not None
    assert low / scene.critical_speed == pytest.approx(0.872, abs=5e-4)
    assert high / scene.critical_speed == pytest.approx(1.0005, abs=5e-5)
    assert over_speed.without_state == []


def test_three_balls_gain_balance_at_a_hopf_point() -> None:
    """Three-ball figure 5, eta = 0.4: about 1.42 there.

    With mu/delta = .03, zeta_B = .1, EQUATIONS.md 2 gives 1.4205 for the best positions. Figure 2
    is in test_three_ball.py.
    """
    zeta = 0.05
    ball = 0.03 * 0.4
    scene = drive(
        M=1.0, me=0.03, k=1.0, c=2.0 * zeta, R=1.0, m=(ball,) * 3, cb=0.2 * ball, rolls=False,
        spindle={"max_speed": 3.0, "max_acceleration": 1.0},
    )  # fmt: skip
    over_speed = branches_over_speed(scene, np.linspace(1.2, 2.0, 12))
    (best,) = [each for each in over_speed.crossings if each.label == "balanced, best"]
    (worst,) = [each for each in over_speed.crossings if each.label == "balanced, worst"]
    assert best.speed == pytest.approx(1.4205, abs=3e-4)
    assert best.kind == "Hopf"
    assert best.gains
    assert best.speed < worst.speed < 1.005 * best.speed, "where balls sit matters a little"
