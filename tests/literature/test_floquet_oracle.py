"""Floquet multipliers against values that independent methods agree on.

Sources: case P17 of ``oracle.json``, deck-3d's balanced deck (largest modulus, to 1e-7); case R6 of
``floquet_oracle.json``, out of the project's ``shared/oracle/rest.json``: all multipliers with an
unequal suspension (to 1e-8).
"""

from typing import Any

import numpy as np
import pytest

from ab_sim.analysis.floquet import TurnMap, solutions_of
from ab_sim.analysis.floquet.stability import multiplier_distance
from ab_sim.scene import Scene
from tests.analysis.floquet.scenes import deck, equal, plane
from tests.reference.cases import LITERATURE, oracle_cases

KIM_CHUNG = oracle_cases()["P17"]
UNEQUAL = oracle_cases(LITERATURE / "floquet_oracle.json")["R6"]


def of_params(p: dict[str, Any], **start: Any) -> Scene:
    """A scene in the plane from the oracle's parameters."""
    return plane(
        rotor={
            "total_mass": p["M"],
            "eccentricity": p["e"] if "e" in p else p["me"] / (p["M"] - sum(p["m"])),
            **({"eccentric_mass": p["me"] / p["e"]} if "e" in p else {}),
        },
        race={"radius": p["R"]},
        balls={"count": len(p["m"]), "mass": p["m"], "radius": p["a"]},
        effects={
            "unequal_suspension": {
                **equal(p["kx"], p["c"]), "stiffness_2": p.get("ky", p["kx"]), "axis_angle": 0.0
            },
            "viscous_drag": {"coefficient": p["cb"]},
        },
        start=start,
    )  # fmt: skip


@pytest.mark.parametrize("value", UNEQUAL["expected"], ids=lambda value: value["set"])
def test_multipliers_with_an_unequal_suspension(value: dict[str, Any]) -> None:
    assert value["params"]["kappa"] == 0.4, "balls that roll: ball_spin"
    scene = of_params(
        value["params"], ball_angles=value["start"][4 : 4 + len(value["params"]["m"])]
    )
    found = solutions_of(scene, value["speed"])[0]
    expected = np.array([complex(*each[:2]) for each in value["multipliers"]])
    assert multiplier_distance(found.multipliers, expected) < 1e-12
    assert found.largest == pytest.approx(value["max_abs"], abs=1e-12)
    assert found.stable is value["stable"]
    np.testing.assert_allclose(found.orbit.start, value["start"], rtol=1e-9, atol=1e-11)
    # The oracle's are of some 400 samples: what lies between them is a little farther out.
    np.testing.assert_allclose(found.whirl, (value["whirl_min"], value["whirl_max"]), rtol=1e-5)
    np.testing.assert_allclose(found.ball_swing, value["ball_swing"], rtol=2e-4)
    exact = TurnMap(scene, value["speed"]).shoot(found.orbit.start, 8192)
    assert exact is not None
    whirl = np.hypot(*exact.states[:, :2].T)
    np.testing.assert_allclose(found.whirl, (whirl.min(), whirl.max()), rtol=1e-6)
    swing = np.ptp(exact.states[:, 4:5], axis=0)
    np.testing.assert_allclose(found.ball_swing, swing, rtol=1e-6)


@pytest.mark.parametrize("value", KIM_CHUNG["expected"], ids=lambda value: f"{value['omega']:g}")
def test_largest_multiplier_of_kim_and_chung_s_deck(value: dict[str, Any]) -> None:
    scene = deck()
    assert scene.rotor.eccentricity == KIM_CHUNG["params"]["ep"]
    found = solutions_of(scene, value["omega"], "start")[0]
    assert found.balanced
    assert found.largest == pytest.approx(value["max_multiplier"], abs=1e-9)
    assert found.stable is value["stable"]
