"""The reference simulator: motor regimes, impacts and lasting contact."""

from collections import Counter

import numpy as np
import pytest

from .contact import chain_of, impact
from .dynamics import FREE, Mode, solve
from .model import Model
from .motor import Command, Regime
from .params import Contact, Friction, Motor, Params, Spindle, Suspension
from .run import Start, simulate

FIXED = Params(1e9, Suspension.isotropic(1e14), race_radius=0.01)
"""A deck that does not move."""

BALLS = (0.5, -1.1, 1.0)
CROWD = Params(
    mass=0.1,
    suspension=Suspension.isotropic(1000.0, 0.2),
    eccentricity=1e-4,
    ball_masses=(1e-3, 8e-4, 1.2e-3),
    ball_radii=(1e-3, 9e-4, 1.1e-3),
    drag=0.05,
    gravity=(0.0, -9.81),
    friction=Friction(1e-6, 0.002),
    contact=Contact(0.6, 1e-3),
    spindle=Spindle(segments=((1.0, 100.0),)),
)
"""Contact, slipping friction and gravity."""


# Motor


def test_motor_on_a_bare_rotor() -> None:
    """Linear regime: I w' = kp (w_cmd - w) + ki z is a damped oscillator."""
    inertia, kp, ki = 2e-5, 4e-4, 0.01
    p = Params(0.1, Suspension.isotropic(1000.0), motor=Motor(inertia, kp, ki, 1.0))
    run = simulate(p.but(spindle=Spindle(50.0)), (), [0.05, 0.2], start=Start(speed=0.0))
    roots = np.roots([inertia, kp, ki])
    # error e: I e'' + kp e' + ki e = 0, e(0) = 50, e'(0) = -kp 50 / I
    a = np.linalg.solve([[1.0, 1.0], roots], [50.0, -kp * 50.0 / inertia])
    expected = [50.0 - (a @ np.exp(roots * t)).real for t in (0.05, 0.2)]
    np.testing.assert_allclose(run.w, expected, atol=1e-9)


def test_motor_saturates() -> None:
    """Against the same law in very small steps."""
    motor = Motor(2e-5, 1e-3, 0.1, 0.004)
    p = Params(0.1, Suspension.isotropic(1000.0), motor=motor, spindle=Spindle(100.0))
    times = [0.48, 0.49, 0.52, 0.6]
    run = simulate(p, (), times, start=Start(speed=0.0))
    assert [event.kind for event in run.events].count("motor") >= 1
    w, z, step, found = 0.0, 0.0, 2e-6, []
    for i in range(round(0.6 / step)):
        if len(found) < len(times) and i >= round(times[len(found)] / step):
            found.append(w)
        raw = motor.kp * (100.0 - w) + motor.ki * z
        given = min(max(raw, -motor.limit), motor.limit)
        z += step * (100.0 - w - (raw - given) / motor.kp)
        w += step * given / motor.inertia
    found.append(w)
    np.testing.assert_allclose(run.w, found[: len(times)], atol=5e-3)


# Contact


@pytest.mark.parametrize("turned_by_motor", [False, True])
@pytest.mark.parametrize("restitution", [0.0, 0.6, 1.0])
def test_impact_keeps_momentum(turned_by_motor: bool, restitution: float) -> None:
    p = CROWD.but(contact=Contact(restitution, 0.0), motor=Motor(2e-5) if turned_by_motor else None)
    model = Model(p)
    reach = 2.0 * np.arcsin(2.1e-3 / 0.02)
    theta = np.array([0.5, -1.1, 0.5 + reach])
    chain = chain_of(model, theta)
    hit = int(np.flatnonzero((chain.behind == 0) & (chain.ahead == 2))[0])
    q = np.concatenate([[1e-3, -2e-3, 0.7], 0.7 + theta])
    before = np.array([0.1, -0.3, 80.0, 85.0, 79.0, 76.0])
    after = impact(model, chain, hit, q, before)
    assert chain.rates(q, after)[hit] == pytest.approx(restitution * 9.0, abs=1e-10)
    k = model.kinematics(q, before)
    momentum = k.mass @ (after - before)
    scale = np.abs(momentum).max()
    assert np.abs(momentum[:2]).max() < 1e-11 * scale  # linear
    assert abs(momentum[4]) < 1e-11 * scale  # the ball that takes no part
    assert momentum[3] == pytest.approx(-momentum[5])  # equal and opposite
    lost = model.energy(q, before) - model.energy(q, after) + momentum[2] * before[2]
    if turned_by_motor:
        assert abs(momentum[2]) < 1e-11 * scale
    else:
        assert after[2] == before[2]
    # what the spindle's drive does aside: impulse times the mean of approach and separation
    assert lost == pytest.approx(0.5 * (1 - restitution) * momentum[5] * 9.0, abs=1e-14)
    assert lost >= -1e-15


def test_two_balls_on_a_fixed_deck() -> None:
    """Each impact exchanges momentum as on a line; free flight in between."""
    m1, m2, e = 1e-3, 5e-4, 0.5
    p = FIXED.but(ball_masses=(m1, m2), ball_radii=(1e-3, 8e-4), contact=Contact(e, 1e-5))
    reach = 2.0 * np.arcsin(1.8e-3 / 0.02)
    run = simulate(p, [0.0, 1.0], [1.0], start=Start(rates=(3.0, 1.0)))
    first = (1.0 - reach) / 2.0
    common = (3.0 * m1 + m2) / (m1 + m2)
    v1, v2 = common - e * 2.0 * m2 / (m1 + m2), common + e * 2.0 * m1 / (m1 + m2)
    assert [event.kind for event in run.events] == ["impact"]
    assert run.events[0].time == pytest.approx(first, abs=1e-10)
    np.testing.assert_allclose(run.theta_rate[0], [v1, v2], atol=1e-8)
    ends = [3.0 * first + v1 * (1 - first), 1.0 + first + v2 * (1 - first)]
    np.testing.assert_allclose(run.theta[0], ends, atol=1e-8)


def test_persistent_contact_balances_each_ball() -> None:
    """m (P'' - g) = F t - N n + contact force along the race, for both balls."""
    p = CROWD.but(ball_masses=(1e-3, 8e-4), ball_radii=(1e-3, 9e-4))
    model = Model(p)
    reach = 2.0 * np.arcsin(1.9e-3 / 0.02)
    theta = np.array([-2.6, -2.6 + reach])
    chain = chain_of(model, theta)
    closed = tuple(bool(b == 0) for b in chain.behind)
    q = np.concatenate([[1e-4, 2e-4, 0.7], 0.7 + theta])
    rates = np.array([0.01, -0.02, 30.0, 33.0, 33.0])
    asked = Command(0.7, 30.0, 100.0)
    for state in (FREE, 1):
        forces = solve(model, chain, Mode((state, state), closed, Regime()), asked, q, rates, 0.0)
        k = model.kinematics(q, rates)
        gain = k.rows @ forces.accelerations + k.bias
        push = forces.contact[closed.index(True)]
        for i, sign in ((0, -1.0), (1, 1.0)):
            n = np.array([k.cosines[i], k.sines[i]])
            t = np.array([-n[1], n[0]])
            inertial = p.ball_masses[i] * (gain[[5 + i, 7 + i]] - p.gravity)
            roll = 0.4 * p.ball_masses[i] * p.ball_radii[i] * gain[9 + i]  # I sigma' / a
            slip = p.race_radius * (rates[3 + i] - rates[2])
            tangential = forces.friction[i] - p.drag * slip + roll
            total = sign * push * t - forces.normal[i] * n + tangential * t
            np.testing.assert_allclose(inertial, total, atol=1e-13)


@pytest.mark.parametrize("turned_by_motor", [False, True])
def test_crowd_with_friction_and_gravity(turned_by_motor: bool) -> None:
    p = CROWD.but(motor=Motor(2e-5, 0.002, 1.0, 0.01, 1e-6) if turned_by_motor else None)
    run = simulate(p, BALLS, np.linspace(0.0, 0.4, 41), rtol=1e-11)
    kinds = Counter(event.kind for event in run.events)
    assert kinds["impact"] >= 10 and kinds["part"] >= 1
    assert all(event.loss >= -1e-16 for event in run.events)
    assert np.abs(run.imbalance()).max() < 1e-12
    for theta in run.theta:
        assert (chain_of(Model(p), theta).gaps(theta) > -1e-10).all()
