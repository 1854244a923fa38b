"""The reference of the deck: vibration about rest, and the small-angle equations.

Sources: deck_oracle.json's modes; Kim and Chung (2002): six frequencies, equations (13)-(19).
"""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.linalg import eigh, expm

from .cases import deck_oracle, deck_params
from .deck import instant, simulate_deck
from .deck_model import DeckModel
from .deck_modes import averaged, linearise, modes
from .deck_params import DeckParams, Race
from .params import Spindle
from .plant import Array
from .small_angle import Plate, simulate_small_angle
from .test_deck_reference import ODD, damped

(KIM_CHUNG,) = deck_oracle()["modes"]
RING = deck_params(KIM_CHUNG["ring_params"])


def test_average_over_a_turn() -> None:
    made, expected = averaged(Plate().exact()).disc, RING.disc
    assert made.mass == pytest.approx(expected.mass, rel=1e-14)
    assert (made.height, made.eccentricity) == (0.0, 0.0)
    np.testing.assert_allclose(made.inertia, expected.inertia, rtol=1e-14, atol=1e-20)


def test_average_over_a_turn_is_the_mean_of_the_mass_matrix() -> None:
    p = ODD.but(races=tuple(Race(r.radius, r.balls, r.height) for r in ODD.races))
    model, mean = DeckModel(p), np.zeros((7, 7))
    turns = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
    for psi in turns:
        for phi in turns:
            q = np.concatenate([np.zeros(6), [psi], psi + np.full(3, phi)])
            mass = model.system(q, np.zeros(10)).mass
            stuck = np.vstack([np.eye(7), np.repeat(np.eye(7)[6:], 3, axis=0)])
            mean += stuck.T @ mass @ stuck / turns.size**2
    ring = DeckModel(averaged(p)).system(np.zeros(7), np.zeros(7)).mass
    np.testing.assert_allclose(ring, mean, rtol=1e-12, atol=1e-18)


@pytest.mark.parametrize("p", [RING, Plate().exact()], ids=["ring", "disc and balls"])
def test_oracle_modes(p: DeckParams) -> None:
    at_rest = linearise(p)
    natural = np.sqrt(eigh(at_rest.stiffness, at_rest.mass, eigvals_only=True))
    np.testing.assert_allclose(natural, KIM_CHUNG["undamped_at_rest"], rtol=1e-13)
    np.testing.assert_allclose(natural, [179, 180, 181, 325, 335, 347], rtol=0.0, atol=0.5)
    for case in KIM_CHUNG["speeds"]:
        for got, e in zip(modes(p, case["speed"]), case["modes"], strict=True):
            assert got.eigenvalue == pytest.approx(complex(e["re"], e["im"]), rel=1e-12)
            assert got.natural == pytest.approx(e["natural"], rel=1e-12)
            assert got.damping_ratio == pytest.approx(e["damping_ratio"], rel=1e-11)
            shape = np.array(e["shape_re"]) + 1j * np.array(e["shape_im"])
            np.testing.assert_allclose(got.shape, shape, rtol=0.0, atol=1e-11)


def test_matrices_by_hand() -> None:
    """The symmetric plate: parallel axes for M, levers for C and K, J_z w for the gyroscope."""
    p, w = Plate(), 200.0
    J_Px, J_Py, J_Pz, J, J_z = p.inertias
    ring = p.n * p.m * p.R**2 + p.M * p.eps**2
    total = p.M_P + p.M + p.n * p.m
    mass = np.diag([total] * 3 + [
        J_Px + p.M_P * p.d**2 + J + ring / 2,
        J_Py + J + ring / 2,
        J_Pz + p.M_P * p.d**2 + J_z + ring,
    ])  # fmt: skip
    mass[0, 5] = mass[5, 0] = p.M_P * p.d
    mass[2, 3] = mass[3, 2] = -p.M_P * p.d
    levers = np.diag([4.0] * 3 + [p.b**2 + 4 * p.d**2, p.a**2, p.a**2 + p.b**2 + 4 * p.d**2])
    levers[0, 5] = levers[5, 0] = 4 * p.d
    levers[2, 3] = levers[3, 2] = -4 * p.d
    gyroscope = np.zeros((6, 6))
    gyroscope[3, 4], gyroscope[4, 3] = (J_z + ring) * w, -(J_z + ring) * w
    found = linearise(p.exact(), w)
    assert not found.rest.any()
    np.testing.assert_allclose(found.mass, mass, rtol=1e-13, atol=1e-18)
    np.testing.assert_allclose(found.damping, p.c * levers + gyroscope, rtol=1e-13, atol=1e-16)
    np.testing.assert_allclose(found.stiffness, p.k * levers, rtol=1e-13, atol=1e-13)


def test_linear_motion_is_the_limit_of_small_motion() -> None:
    """About the sag of an unsymmetric deck on hardening mounts, its disc turning."""
    p, speed, time = averaged(damped(ODD)), 300.0, 0.02
    found = linearise(p, speed)
    assert np.abs(found.rest[:3]).max() > 1e-4 and np.abs(found.rest[3:]).max() > 5e-4
    inverse = np.linalg.inv(found.mass)
    matrix = np.block([
        [np.zeros((6, 6)), np.eye(6)], [-inverse @ found.stiffness, -inverse @ found.damping]
    ])  # fmt: skip
    push = np.array([1.0, -0.5, 0.7, 10.0, -15.0, 20.0]) * 1e-2
    linear = expm(matrix * time) @ np.append(np.zeros(6), push)
    gaps = []
    for size in (0.1, 0.05):
        run = simulate_deck(
            p.but(spindle=Spindle(speed)), found.rest, size * push, [time], rtol=1e-12
        )  # fmt: skip
        gaps.append(np.abs((run.deck[0] - found.rest) / size - linear[:6]).max())
    assert gaps[0] < 1e-2 * np.abs(linear[:6]).max()
    assert gaps[1] == pytest.approx(0.5 * gaps[0], rel=0.1)


# Small angles


def scaled(p: Plate, size: float) -> Plate:
    """Unbalance, balls and drag go along with the displacements: so the forces on the deck do."""
    return p.but(eps=size * p.eps, m=size * p.m, D=size * p.D)


def assert_second_order(small: Callable[[float], tuple[Plate, Array, Array]], t: float) -> None:
    """Accelerations differ by what falls with the square of the size."""
    gaps = []
    for size in (1 / 64, 1 / 128):
        p, q, rates = small(size)
        exact = instant(p.exact(), q, rates, psi=p.omega * t, speed=p.omega).accelerations
        gaps.append(exact - p.accelerations(t, q, rates))
    assert (np.abs(gaps) > 1e-9).all()
    np.testing.assert_allclose(gaps[0] / gaps[1], 4.0, rtol=0.15)


@pytest.mark.parametrize("seed", range(4))
def test_small_angle_equations_with_any_balls(seed: int) -> None:
    rng = np.random.default_rng(seed)
    place, rates = 1e-3 * rng.normal(size=6), 0.3 * rng.normal(size=6)
    phi, turning, t = rng.uniform(-3, 3, 3), 50.0 * rng.normal(size=3), rng.uniform(0, 0.02)
    assert_second_order(
        lambda size: (
            scaled(Plate(n=3), size),
            np.append(size * place, phi),
            np.append(size * rates, turning),
        ),
        t,
    )


def three_balls() -> tuple[Plate, Array, Array]:
    """Three balls of which the forces on the deck balance while the drag turns two of them.

    Their accelerations A_i exp(i phi_i), A = -p^2 + i phi'', form a triangle.
    """
    p, turning = Plate(n=3, eps=0.0), np.array([50.0, -50.0, 0.0])
    A = -((p.omega + turning) ** 2) - 1j * p.D * turning / (p.m * p.R**2)
    one, two, three = np.abs(A)
    second = np.arccos((one**2 + two**2 - three**2) / (2.0 * one * two))
    third = np.arccos((one**2 + three**2 - two**2) / (2.0 * one * three))
    phi = np.array([0.0, np.pi - second, third - np.pi]) - np.angle(A)
    assert abs(np.sum(A * np.exp(1j * phi))) < 1e-9 * one
    return p, phi, turning


BALANCED = {
    "two balls": (Plate(), np.deg2rad([142.3, -142.3]), np.zeros(2)),
    "three balls": three_balls(),
}


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("name", BALANCED)
def test_small_angle_equations_about_balance(name: str, seed: int) -> None:
    """Where no force acts on the deck, that of unbalance and balls displaced is first order.

    What (16) has with the sum of phi'' is not: that sum turns the deck, too.
    """
    rng = np.random.default_rng(seed)
    p, phi, turning = BALANCED[name]
    place = np.append(1e-3 * rng.normal(size=6), 0.1 * rng.normal(size=p.n))
    rates = np.append(0.3 * rng.normal(size=6), 30.0 * rng.normal(size=p.n))
    still, moving = np.append(np.zeros(6), phi), np.append(np.zeros(6), turning)
    assert_second_order(
        lambda size: (p, still + size * place, moving + size * rates), rng.uniform(0, 0.02)
    )


def test_small_angle_motion_misses_the_second_order() -> None:
    plate, times = Plate(), np.linspace(0.0, 0.03, 4)[1:]
    place = np.array([1e-4, -2e-4, 3e-4, 0.01, -8e-3, 5e-3])
    rates = np.array([0.02, -0.03, 0.05, 0.6, -0.4, 0.5])
    phi, turning = np.array([0.5, -0.35]), np.array([5.0, -3.0])
    gaps = []
    for size in (0.1, 0.05):
        p = scaled(plate, size)
        q, v = np.append(size * place, phi), np.append(size * rates, turning)
        small, _ = simulate_small_angle(p, q, v, times)
        run = simulate_deck(p.exact(), q, v, times, rtol=1e-11)
        gaps.append(np.abs(np.hstack([run.deck, run.theta]) - small).max(axis=0))
    np.testing.assert_allclose(gaps[0] / gaps[1], 4.0, rtol=0.15)
