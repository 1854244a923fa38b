"""The deck in space against values that three independent formulations agree on.

Source: ``deck_oracle.json``, a copy of the project's ``shared/oracle/deck.json``: a Lagrangian by
automatic differentiation, Newton and Euler on deck axes, a joint tree (shared/DECK.md). Runs are
good to 4e-13 rad and m, 3e-12 in rates; the points to 1e-12 relative.
"""

from typing import Any

import numpy as np
import pytest

from ab_sim.drive import Drive
from ab_sim.dynamics.assemble import start_modes, start_state, system_of
from ab_sim.dynamics.layout import layout_of
from ab_sim.dynamics.ledger import mechanical_energy
from ab_sim.dynamics.race.neighbours import reduced
from ab_sim.dynamics.system import Place
from ab_sim.spindle import Ramp
from tests.deck.coordinates import columns, coordinates
from tests.deck.of_params import profile_of, scene_of
from tests.deck.scenes import COMPANIES
from tests.dynamics.calls import compiled_evaluate, plant_of
from tests.reference import DeckParams
from tests.reference.cases import deck_oracle, deck_params

ORACLE = deck_oracle()


def effects_of(p: DeckParams) -> dict[str, Any]:
    """Balls that roll, with effects that do nothing, for the kernel's sake; or points."""
    if not any(ball.inertia for ball in p.balls):
        return {}
    assert all(b.inertia == pytest.approx(0.4 * b.mass * b.radius**2) for b in p.balls)
    effects: dict[str, Any] = COMPANIES["smooth"]["effects"]
    return effects


@pytest.mark.parametrize("case", ORACLE["trajectories"], ids=lambda case: case["id"])
def test_trajectories(case: dict[str, Any]) -> None:
    p, expected = deck_params(case["params"]), case["expected"]
    scene = scene_of(p, case["q0"], case["qd0"], effects=effects_of(p))
    drive = Drive(scene, ledger=True)
    drive.profile = profile_of(p)
    energies = []
    steps = np.rint(np.array([e["t"] for e in expected]) / drive.step).astype(int)
    parts = []
    for count in np.diff(steps, prepend=0):
        parts.append(drive.advance(int(count)).thinned(int(count)))
        energies.append(drive.energy())
    got = parts[0].join(parts)
    np.testing.assert_allclose(got["time"], [e["t"] for e in expected], rtol=1e-12)
    places, rates = coordinates(got)
    places[:, 6:] += p.disc.angle
    np.testing.assert_allclose(places, [e["q"] for e in expected], rtol=0.0, atol=2e-12)
    np.testing.assert_allclose(rates, [e["qd"] for e in expected], rtol=0.0, atol=2e-11)
    quaternions = columns(got, "qw", "qx", "qy", "qz")
    np.testing.assert_allclose(quaternions, [e["quaternion"] for e in expected], atol=1e-14)
    psi = [e["psi"] + p.disc.angle for e in expected]
    np.testing.assert_allclose(got["angle"], psi, rtol=1e-14)
    np.testing.assert_allclose(got["speed"], [e["speed"] for e in expected], atol=1e-12)
    scale = 1e-12 * max(abs(e["energy"]) for e in expected)
    assert energies[0].at_start == pytest.approx(case["energy_start"], rel=1e-13, abs=1e-18)
    for key, name in (
        ("energy", "stored"), ("motor_work", "motor_work"), ("dissipated", "dissipated")
    ):  # fmt: skip
        found = [getattr(energy, name) for energy in energies]
        np.testing.assert_allclose(found, [e[key] for e in expected], rtol=0.0, atol=scale)


@pytest.mark.parametrize("case", ORACLE["points"], ids=lambda case: case["id"][:2])
def test_point_evaluations(case: dict[str, Any]) -> None:
    p, speed = deck_params(case["params"]), case["speed"]
    scene = scene_of(p, case["q"], case["qd"], effects=effects_of(p))
    system = system_of(scene, ledger=True)
    psi = case["psi"] + p.disc.angle
    plant = plant_of(
        system,
        Place(Ramp(speed, case["acceleration"]), reduced(psi)[0]),
        start_modes(scene, system),
    )
    state, slope = start_state(scene, system), np.empty(layout_of(system).size)
    compiled_evaluate(plant, 0.0, state, slope)
    layout = layout_of(system)
    turning = [layout.names.index(f"tilt rate {axis}") for axis in "xyz"]
    moving = [layout.names.index(f"{axis} rate") for axis in "XYZ"]
    (alpha, beta, _), tilt_rate = case["q"][3:6], case["qd"][3:6]
    # Omega = W (alpha', beta', gamma')
    ca, sa, cb, sb = np.cos(alpha), np.sin(alpha), np.cos(beta), np.sin(beta)
    W = np.array([[cb, 0.0, -ca * sb], [0.0, 1.0, sa], [sb, 0.0, ca * cb]])
    dW = tilt_rate[0] * np.array([[0.0, 0.0, sa * sb], [0.0, 0.0, ca], [0.0, 0.0, -sa * cb]])
    dW += tilt_rate[1] * np.array([[-sb, 0.0, -ca * cb], [0.0, 0.0, 0.0], [cb, 0.0, -ca * sb]])
    np.testing.assert_allclose(state[turning], W @ tilt_rate, rtol=1e-14)
    tilting = np.linalg.solve(W, slope[turning] - dW @ tilt_rate)
    found = np.concatenate([slope[moving], tilting, slope[layout.rates]])
    np.testing.assert_allclose(found, case["qdd"], rtol=1e-11)
    power, dissipated = slope[layout.ledger]
    assert power == pytest.approx(case["motor_power"], rel=1e-11)
    assert power / speed == pytest.approx(case["motor_torque"], rel=1e-11)
    assert dissipated == pytest.approx(case["dissipated_power"], rel=1e-12)
    energy = mechanical_energy(system, state, psi, speed)
    assert energy == pytest.approx(case["kinetic_energy"] + case["potential_energy"], rel=1e-12)
