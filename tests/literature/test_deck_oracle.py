"""The deck in space against values that three independent formulations agree on.

Source: ``deck_oracle.json``, a copy of the project's ``shared/oracle/deck.json``: a Lagrangian by
automatic differentiation, Newton and Euler on deck axes, a joint tree (shared/DECK.md). Runs are
good to 4e-13 rad and m, 3e-12 in rates; the points to 1e-12 relative.
"""

from math import comb
from typing import Any

import numpy as np
import pytest

from ab_sim.drive import Drive
from ab_sim.model.spindle import Ramp, SpeedSchedule
from tests.deck.coordinates import columns, coordinates
from tests.deck.of_params import profile_of, scene_of
from tests.deck.scenes import COMPANIES
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
    drive = Drive(scene, energy_balance=True)
    drive.schedule = profile_of(p)
    energies = []
    steps = np.rint(np.array([e["t"] for e in expected]) / drive.step).astype(int)
    parts = []
    for count in np.diff(steps, prepend=0):
        parts.append(drive.advance(int(count)).decimated(int(count)))
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
    scene = scene_of(p, case["q"], case["qd"], effects=effects_of(p), step=4e-5)
    drive = Drive(scene, energy_balance=True)
    drive.schedule = SpeedSchedule(
        [(1.0, Ramp(speed, case["acceleration"]))], 0.0, start_angle=case["psi"] + p.disc.angle
    )
    energy = drive.energy()
    assert energy.stored == pytest.approx(case["kinetic_energy"] + case["potential_energy"], 1e-12)
    # From the start on, to the tenth order: d/dt = ln(1 + D) / step with forward differences D.
    weights = {k: (-1) ** (k + 1) * comb(10, k) / k / drive.step for k in range(1, 11)}
    now = drive.present()
    balls, power, loss = -sum(weights.values()) * now.ball_rates[0], 0.0, 0.0
    for weight in weights.values():
        balls = balls + weight * drive.advance(1).ball_rates[0]
        energy = drive.energy()
        power, loss = power + weight * energy.motor_work, loss + weight * energy.dissipated
    assert power == pytest.approx(case["motor_power"], rel=1e-11)
    assert power / speed == pytest.approx(case["motor_torque"], rel=1e-11)
    assert loss == pytest.approx(case["dissipated_power"], rel=1e-11)
    # Omega = W (alpha', beta', gamma')
    (alpha, beta, _), tilt_rate = case["q"][3:6], case["qd"][3:6]
    ca, sa, cb, sb = np.cos(alpha), np.sin(alpha), np.cos(beta), np.sin(beta)
    W = np.array([[cb, 0.0, -ca * sb], [0.0, 1.0, sa], [sb, 0.0, ca * cb]])
    dW = tilt_rate[0] * np.array([[0.0, 0.0, sa * sb], [0.0, 0.0, ca], [0.0, 0.0, -sa * cb]])
    dW += tilt_rate[1] * np.array([[-sb, 0.0, -ca * cb], [0.0, 0.0, 0.0], [cb, 0.0, -ca * sb]])
    turning = columns(now, "wx_rate", "wy_rate", "wz_rate")[0]
    tilting = np.linalg.solve(W, turning - dW @ tilt_rate)
    found = np.concatenate([now.acceleration[0], tilting, balls])
    np.testing.assert_allclose(found, case["qdd"], rtol=1e-11)
