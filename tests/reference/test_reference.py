"""The reference simulator against published values, conservation laws and closed forms.

Motor and contact: test_motor_and_contact.py.
"""

from collections import Counter

import numpy as np
import pytest

from .cases import oracle_cases, oracle_params
from .contact import chain_of
from .dynamics import STUCK, Mode, solve
from .model import Array, Model
from .motor import Command, Regime
from .params import Friction, Motor, Params, Runout, Spindle, Suspension
from .run import Start, simulate

CASES = oracle_cases()

ODD = Params(
    mass=0.1,
    suspension=Suspension(1000.0, 1500.0, axis_angle=0.4, cubic=3e7),
    eccentricity=1e-4,
    race_radius=0.01,
    ball_masses=(1e-3, 1.5e-3, 0.7e-3),
    ball_radii=(1e-3, 1.2e-3, 0.8e-3),
    gravity=(2.0, -9.0),
    runout=Runout((1e-4, -5e-5), 2e-4, 0.7),
)
"""Every conservative effect at once."""

FIXED = Params(1e9, Suspension.isotropic(1e14), race_radius=0.01)
"""A deck that does not move."""

BALLS = (0.5, -1.1, 1.0)


# Published values


@pytest.mark.parametrize(
    ("case", "until", "method", "rtol", "demand"),
    [
        ("P01", 1.0, "DOP853", 1e-11, 1e-9),
        ("P03", 1.0, "DOP853", 1e-10, 1e-9),
        ("P05", 2.0, "DOP853", 1e-10, 1e-9),
        ("P09", 1.0, "Radau", 1e-8, 1e-6),
    ],
)
def test_oracle_trajectories(
    case: str, until: float, method: str, rtol: float, demand: float
) -> None:
    expected = {float(t): e for t, e in CASES[case]["expected"].items() if float(t) <= until}
    p = oracle_params(CASES[case])
    run = simulate(p, CASES[case]["theta0_rad"], list(expected), method=method, rtol=rtol)
    for i, e in enumerate(expected.values()):
        size, speed = np.hypot(e["x"], e["y"]), np.hypot(e["vx"], e["vy"])
        assert np.hypot(run.x[i] - e["x"], run.y[i] - e["y"]) < demand * size
        assert np.hypot(run.vx[i] - e["vx"], run.vy[i] - e["vy"]) < demand * speed
        np.testing.assert_allclose(run.theta[i], e["theta"], rtol=0.0, atol=demand)
        np.testing.assert_allclose(run.rates[i, 3:], e["dpsi"], rtol=0.0, atol=100.0 * demand)
        assert run.psi[i] == pytest.approx(e["psi"], abs=1e-10)


def test_oracle_stick() -> None:
    case = CASES["P10"]
    expected = {float(t): e for t, e in case["expected"].items() if float(t) <= 0.5}
    run = simulate(oracle_params(case), case["theta0_rad"], list(expected))
    for i, e in enumerate(expected.values()):
        size = np.hypot(e["x"], e["y"])
        assert np.hypot(run.x[i] - e["x"], run.y[i] - e["y"]) < 1e-9 * size
        np.testing.assert_allclose(run.theta[i], e["theta"], rtol=0.0, atol=1e-12)
    assert run.events == ()


def test_oracle_without_friction_leaves_at_once() -> None:
    case = CASES["P10"]
    p = oracle_params(case).but(friction=Friction())
    run = simulate(p, case["theta0_rad"], [0.25], rtol=1e-11)
    expected = list(case["contrast_beta0"].values())[:1]
    np.testing.assert_allclose(run.theta, expected, rtol=0.0, atol=1e-9)


def test_oracle_energy() -> None:
    case = CASES["P14"]
    times = [2.5]
    run = simulate(oracle_params(case), case["theta0_rad"], times, rtol=1e-10)
    energies = run.energy()
    for i, e in enumerate(list(case["expected"].values())[:1]):
        assert energies[i] == pytest.approx(e["E"], rel=1e-9)
        assert run.work[i] == pytest.approx(e["work_motor"], rel=1e-9)
        assert run.losses[i, 0] == pytest.approx(e["diss_c"], rel=1e-9)
        assert run.losses[i, 1] == pytest.approx(e["diss_cb"], rel=1e-9)


# Equations of motion


def path_of(p: Params, q: Array) -> tuple[list[Array], list[Array]]:
    """Positions of the bodies (deck, unbalance, balls) and their spin angles, from scratch."""
    x, y, psi = q[0], q[1], q[2]
    spot = x + 1j * y
    bodies, spins = [spot, spot + p.eccentricity * np.exp(1j * psi)], []
    for i, radius in enumerate(p.ball_radii):
        theta = q[3 + i] - psi
        phase = 2.0 * (theta - p.runout.oval_angle)
        h, slope = p.race_radius + p.runout.oval * np.cos(phase), -2.0 * np.sin(phase)
        outward = np.exp(1j * theta)
        centre = complex(*p.runout.offset) + outward * (h + 1j * p.runout.oval * slope)
        bodies.append(spot + centre * np.exp(1j * psi))
        # s = integral of h + h'' = R theta - 3/2 oval sin(2 (theta - theta_l))
        arc = p.race_radius * theta - 1.5 * p.runout.oval * np.sin(phase)
        spins.append(psi - arc / radius)
    return bodies, spins


def test_virtual_work_and_normal_forces() -> None:
    """D'Alembert's principle on the positions alone, by differences in long double."""
    p = ODD.but(drag=0.3, motor=Motor(2e-5), friction=Friction(1e-5, 0.02))
    p = p.but(suspension=Suspension(1000.0, 1500.0, 0.2, 0.5, 0.4, 3e7))
    model, rng = Model(p), np.random.default_rng(1)
    q = np.concatenate([rng.normal(0, 1e-3, 2), rng.uniform(-3, 3, 4)])
    rates = np.concatenate([rng.normal(0, 0.1, 2), 100 + rng.normal(0, 5, 4)])
    asked = Command(0.0, 0.0, 0.0)
    mode = Mode((1, -1, STUCK), (), Regime())
    chain = chain_of(model, q[3:])
    forces, path = solve(model, chain, mode, asked, q, rates, 0.0), model.system(q, rates).path

    def at(t: float, j: int = 0, shift: float = 0.0) -> Array:
        t = np.longdouble(t)
        place = q.astype(np.longdouble) + rates * t + forces.accelerations * t * t / 2
        place[j] += np.longdouble(shift)
        bodies, spins = path_of(p, place)
        parts = [part for b in bodies for part in (b.real, b.imag)]
        return np.array([*parts, place[2], *spins])

    step = np.longdouble(1e-4)
    second = np.array([-205 / 72, 8 / 5, -1 / 5, 8 / 315, -1 / 560], np.longdouble)
    second[0] = -2 * second[1:].sum()
    gain = second[0] * at(0.0)
    for i in range(1, 5):
        gain = gain + second[i] * (at(i * step) + at(-i * step))
    gain = gain / step**2
    first = np.array([4 / 5, -1 / 5, 4 / 105, -1 / 280])
    n = p.count
    heavy = np.array([p.mass - sum(p.ball_masses) - p.carrier_mass, p.carrier_mass])
    masses = np.concatenate([heavy, p.ball_masses])
    inertias = [2e-5, *(0.4 * m * a * a for m, a in zip(p.ball_masses, p.ball_radii, strict=True))]
    weights = np.concatenate([np.repeat(masses, 2), inertias])
    pull = np.concatenate([np.tile(p.gravity, n + 2), np.zeros(n + 1)])
    c, s = np.cos(0.4), np.sin(0.4)
    turn = np.array([[c, -s], [s, c]])
    u = model.sag + q[:2]
    ground = -turn @ (np.array([1000, 1500]) * (turn.T @ u)) - 3e7 * (u @ u) * u
    ground -= turn @ (np.array([0.2, 0.5]) * (turn.T @ rates[:2]))
    for j in range(3 + n):
        vary = sum(
            first[i - 1] * (at(0.0, j, i * step) - at(0.0, j, -i * step)) / step
            for i in range(1, 5)
        )
        work = ground[j] if j < 2 else 0.0
        slip = path * (rates[3:] - rates[2])
        along = (forces.friction - p.drag * slip) * path
        work += -along.sum() if j == 2 else along[j - 3] if j > 2 else 0.0
        inertial = float(np.sum(weights * (gain - pull) * vary))
        scale = float(np.abs(weights * gain * vary).sum())
        assert inertial == pytest.approx(work, abs=2e-9 * scale)
    accelerations = np.asarray(gain[4 : 4 + 2 * n], float).reshape(n, 2) - p.gravity
    outward = np.stack([np.cos(q[3:]), np.sin(q[3:])], axis=-1)
    normal = -np.array(p.ball_masses) * np.sum(accelerations * outward, axis=1)
    np.testing.assert_allclose(forces.normal, normal, rtol=1e-8)
    f = p.friction_coefficients()
    assert forces.friction[:2] == pytest.approx([-f[0] * normal[0], f[1] * normal[1]], rel=1e-8)
    assert forces.accelerations[5] == pytest.approx(forces.accelerations[2], abs=1e-9)


@pytest.mark.parametrize("spindle", ["free", "prescribed"])
def test_energy_without_losses(spindle: str) -> None:
    driven = spindle == "prescribed"
    p = ODD.but(
        spindle=Spindle(80.0, 0.2, ((0.15, 50.0),) if driven else ()),
        motor=None if driven else Motor(2e-5),
    )
    run = simulate(p, BALLS, np.linspace(0.0, 0.3, 11), rtol=1e-11)
    assert np.abs(run.imbalance()).max() < 1e-10 * np.abs(run.energy()).max()
    if not driven:
        assert not run.work.any() and not run.losses.any()
        assert np.ptp(run.w) > 0.1


def test_energy_with_everything_but_contact() -> None:
    p = ODD.but(
        suspension=Suspension(1000.0, 1500.0, 0.2, 0.5, 0.4, 3e7),
        drag=0.3,
        friction=Friction(1e-5, 0.005),
        motor=Motor(2e-5, 0.01, 0.05, 0.02, 1e-5),
        spindle=Spindle(80.0, 0.0, ((0.3, 50.0),)),
    )
    run = simulate(p, BALLS, np.linspace(0.0, 0.3, 11), rtol=1e-11)
    assert np.abs(run.imbalance()).max() < 1e-10 * np.abs(run.energy()).max()
    assert (run.losses[-1, :3] > 0.0).all()
    assert {"stick", "release"} & {event.kind for event in run.events}


def test_rests_at_the_static_equilibrium() -> None:
    p = ODD.but(ball_masses=(), ball_radii=(), eccentricity=0.0)
    run = simulate(p, (), [0.5])
    u = Model(p).sag
    assert np.hypot(*u) > 1e-4
    assert np.hypot(run.x[0], run.y[0]) < 1e-14


def test_psi_acceleration_can_be_left_out() -> None:
    """Without balls: M0 e w^2 alone turns the deck, against Duhamel's integral."""
    p = Params(0.1, Suspension.isotropic(1000.0), 1e-4)
    p = p.but(spindle=Spindle(20.0, 0.3, ((1.0, 40.0),), feel_acceleration=False))
    run = simulate(p, (), [0.4])
    t = np.linspace(0.0, 0.4, 20001)
    wave = 0.1 * 1e-4 * (20 + 40 * t) ** 2 * np.exp(1j * (0.3 + 20 * t + 20 * t * t))
    kernel = np.sin(100.0 * (0.4 - t)) / (0.1 * 100.0) * wave
    simpson = (
        (kernel[0] + kernel[-1] + 4 * kernel[1::2].sum() + 2 * kernel[2:-1:2].sum()) * t[1] / 3
    )
    assert complex(run.x[0], run.y[0]) == pytest.approx(simpson, abs=1e-15)
    felt = simulate(p.but(spindle=Spindle(20.0, 0.3, ((1.0, 40.0),))), (), [0.4])
    assert abs(complex(felt.x[0], felt.y[0]) - simpson) > 1e-7


# Friction


def test_slipping_ball_stops_when_it_should() -> None:
    """p' = -f p^2 / 1.4 on a fixed deck, until p = w."""
    w, slide, f = 50.0, 40.0, 0.01 + 2e-5 / 1e-3
    p = FIXED.but(ball_masses=(1e-3,), ball_radii=(1e-3,), friction=Friction(2e-5, 0.01))
    p = p.but(spindle=Spindle(w))
    stop = 1.4 / f * (1.0 / w - 1.0 / (w + slide))
    start = Start(rates=(slide,))
    run = simulate(p, [0.3], [0.5 * stop, stop + 0.1], start=start)
    assert run.events[0].time == pytest.approx(stop, abs=1e-11)
    assert run.events[0].kind == "stick" and len(run.events) == 1
    gone = 1.4 / f * np.log1p(f * 0.5 * stop * (w + slide) / 1.4) - w * 0.5 * stop
    assert run.theta[0, 0] - 0.3 == pytest.approx(gone, abs=1e-11)
    total = 1.4 / f * np.log((w + slide) / w) - w * stop
    assert run.theta[1, 0] - 0.3 == pytest.approx(total, abs=1e-11)


def test_stuck_ball_is_released_when_it_should() -> None:
    """A slow drum carries the ball up until m g cos psi = f (m R w^2 - m g sin psi)."""
    w, f = 2.0, 0.3
    p = FIXED.but(ball_masses=(1e-3,), ball_radii=(1e-3,), gravity=(0.0, -9.81))
    p = p.but(friction=Friction(constant=f), spindle=Spindle(w))
    run = simulate(p, [-0.5 * np.pi], [0.0, 0.3])
    release = np.arctan(-1.0 / f)
    for _ in range(50):
        wrong = np.cos(release) + f * np.sin(release) - f * 0.01 * w**2 / 9.81
        release -= wrong / (-np.sin(release) + f * np.cos(release))
    assert run.events[0].kind == "release"
    assert run.events[0].time == pytest.approx((release + 0.5 * np.pi) / w, abs=1e-10)
    assert run.theta_rate[-1, 0] < 0.0


def test_stick_slip_loses_what_friction_takes() -> None:
    p = Params(
        0.1, Suspension.isotropic(1000.0, 0.2), 1e-4, 0.01, (1e-3,) * 2, (1e-3,) * 2, drag=0.1
    ).but(friction=Friction(2e-6, 0.003), spindle=Spindle(60.0, 0.0, ((0.6, 40.0),)))
    run = simulate(p, [0.5, -1.1], np.linspace(0.0, 0.6, 13), rtol=1e-11)
    assert np.abs(run.imbalance()).max() < 1e-11
    kinds = Counter(event.kind for event in run.events)
    assert kinds["stick"] >= 3 and kinds["release"] >= 3
    assert (np.diff(run.losses[:, 2]) >= 0.0).all()
