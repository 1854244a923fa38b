"""The reference of the deck in space: published values, conservation laws, the plane.

Source: ``literature/deck_oracle.json``, a copy of the project's ``shared/oracle/deck.json``: runs
and instants by independent formulations, with the tolerances that it suggests.
Vibration about rest and the small-angle equations: test_deck_linear.py.
"""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from .cases import deck_oracle, deck_params
from .deck import instant, simulate_deck
from .deck_model import DeckModel
from .deck_params import Ball, Body, DeckParams, Disc, Mount, Race
from .dynamics import STUCK
from .model import Model
from .params import Contact, Friction, Motor, Params, Runout, Spindle, Suspension
from .plant import Array
from .run import Start, simulate

ORACLE = deck_oracle()
LONGEST = {"D02": 0.2, "D05": 0.6}
"""End of the comparison [s]; later it takes long. The package is compared with all values."""

AXES = Rotation.from_euler("xyz", [0.2, -0.1, 0.5]).as_matrix()
DECK_INERTIA = ((1.3e-4, -1.2e-5, 6e-6), (-1.2e-5, 1.7e-4, -9e-6), (6e-6, -9e-6, 2.6e-4))
DISC_INERTIA = ((5.6e-6, 2e-7, 1e-7), (2e-7, 5.7e-6, -6e-8), (1e-7, -6e-8, 1.1e-5))
ODD = DeckParams(
    Body(0.12, (6e-3, -0.025, -4e-3), DECK_INERTIA),
    Disc(
        0.025, 7e-3, 2.5e-4, 0.4, DISC_INERTIA,
        points=((4e-4, (0.02, 0.01, 9e-3)), (3e-4, (-0.015, 0.018, -2e-3))),
    ),
    (
        Race(
            0.028, (Ball(2e-4, 1.8e-3, 2.6e-10), Ball(2.4e-4, 1.9e-3, 3.5e-10)), 5e-3, 1.2e-5,
            Runout((1e-4, -5e-5), 2e-4, 0.7),
        ),
        Race(0.02, (Ball(3e-4, 2e-3, 4.8e-10),), -3e-3, 8e-6, Runout((-3e-4, 2e-4), 1e-4, -0.3)),
    ),
    (
        Mount((-0.055, 0.04, 1e-3), (900.0, 950.0, 1400.0), cubic=3e8),
        Mount((0.065, 0.03, -2e-3), (1200.0, 1100.0, 1000.0), axes=AXES),
        Mount((-0.05, -0.09, 0.0), (800.0, 1300.0, 1250.0)),
        Mount((0.045, -0.1, 3e-3), (1000.0, 700.0, 1600.0), axes=AXES.T, cubic=1e9),
    ),
    gravity=(2.0, -4.0, -8.0),
)  # fmt: skip
"""Everything that has no end of its own: two races, couple unbalance, turned hardening mounts."""
STATE = np.array([2e-4, -1e-4, 3e-4, 0.02, -0.03, 0.01, 0.5, 2.6, -1.1])
RATES = np.array([0.05, -0.02, 0.04, 1.0, -2.0, 1.5, 4.0, -3.0, 6.0])


def damped(p: DeckParams) -> DeckParams:
    return p.but(mounts=tuple(
        Mount(m.position, m.stiffness, (0.5, 0.3, 0.8), m.axes, m.cubic) for m in p.mounts
    ))  # fmt: skip


def without_drag(p: DeckParams) -> DeckParams:
    return p.but(races=tuple(Race(r.radius, r.balls, r.height, 0.0, r.runout) for r in p.races))


# Published values


@pytest.mark.parametrize("case", ORACLE["points"], ids=lambda case: case["id"][:2])
def test_oracle_instants(case: dict[str, Any]) -> None:
    now = instant(
        deck_params(case["params"]), case["q"], case["qd"],
        psi=case["psi"], speed=case["speed"], acceleration=case["acceleration"],
    )  # fmt: skip
    np.testing.assert_allclose(now.accelerations, case["qdd"], rtol=1e-11)
    assert now.torque == pytest.approx(case["motor_torque"], rel=1e-11)
    assert now.power == pytest.approx(case["motor_power"], rel=1e-11)
    assert now.losses.sum() == pytest.approx(case["dissipated_power"], rel=1e-11)
    assert now.kinetic == pytest.approx(case["kinetic_energy"], rel=1e-11)
    assert now.potential == pytest.approx(case["potential_energy"], rel=1e-11)


@pytest.mark.parametrize("case", ORACLE["trajectories"], ids=lambda case: case["id"])
def test_oracle_trajectories(case: dict[str, Any]) -> None:
    demand = case["suggested_tolerance"]
    expected = [e for e in case["expected"] if e["t"] <= LONGEST.get(case["id"], np.inf)]
    times = [0.0, *(e["t"] for e in expected)]
    run = simulate_deck(
        deck_params(case["params"]), case["q0"], case["qd0"], times, rtol=1e-10
    )  # fmt: skip
    places = np.hstack([run.deck, run.theta])[1:]
    rates = np.hstack([run.deck_rates, run.theta_rate])[1:]
    np.testing.assert_allclose(places, [e["q"] for e in expected], rtol=0.0, atol=demand["q"])
    np.testing.assert_allclose(rates, [e["qd"] for e in expected], rtol=0.0, atol=demand["qd"])
    np.testing.assert_allclose(run.psi[1:], [e["psi"] for e in expected], rtol=1e-12)
    np.testing.assert_allclose(run.w[1:], [e["speed"] for e in expected], rtol=1e-12)
    energy = run.energy()
    assert energy[0] == pytest.approx(case["energy_start"], rel=1e-12, abs=1e-15)
    scale = max(abs(e["energy"]) for e in expected)
    for got, key in (
        (energy, "energy"), (run.work, "motor_work"), (run.losses.sum(axis=1), "dissipated")
    ):  # fmt: skip
        np.testing.assert_allclose(got[1:], [e[key] for e in expected], atol=1e-10 * scale)
    # The angles are those of the quaternions: 3-1-2 about the moving axes.
    turns = Rotation.from_quat([np.roll(e["quaternion"], -1) for e in expected])
    np.testing.assert_allclose(
        turns.as_euler("ZXY")[:, [1, 2, 0]], places[:, 3:6], atol=demand["q"]
    )  # fmt: skip


# Equations of motion


def way(curve: Race, theta: Array) -> Array:
    """s = integral of h + h''."""
    phase = 2.0 * (theta - curve.runout.oval_angle)
    return curve.radius * theta - 1.5 * curve.runout.oval * np.sin(phase)


def cloud(mass: float, centre: Array, inertia: Array) -> list[tuple[float, Array]]:
    """Masses, some of them negative, and places of points that make up a rigid body."""
    moments, directions = np.linalg.eigh(0.5 * np.trace(inertia) * np.eye(3) - inertia)
    centre, arm, rest = np.asarray(centre, float), 0.01, mass
    points = []
    for moment, direction in zip(moments, directions.T, strict=True):
        share = moment / (2.0 * arm**2)
        points += [(share, centre + side * arm * direction) for side in (-1, 1)]
        rest -= 2.0 * share
    return [*points, (rest, centre)]


def about(axis: int, angle: float) -> Array:
    """Rotation about an axis, in long double."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    made = np.eye(3, dtype=np.longdouble)
    made[i, i], made[i, j], made[j, i], made[j, j] = c, -s, s, c
    return made


def test_virtual_work_and_normal_forces() -> None:
    """D'Alembert's principle on the positions of mass points alone, by differences."""
    p = damped(ODD).but(motor=Motor(3e-6, 1e-3, 0.0, 1.0, 1e-5), friction=Friction(1e-5, 2.0))
    speed, psi, command = 110.0, 0.8, 140.0
    rates = RATES.copy()
    rates[6] = 0.0  # the first ball sticks
    sensor, axes = np.array([0.03, -0.05, 4e-3]), AXES
    now = instant(
        p, STATE, rates, psi=psi, speed=speed, command=command, sensor=sensor, sensor_axes=axes
    )
    assert now.mode.balls[0] == STUCK and abs(now.friction[0]) > 1e-5
    races = [p.races[0], p.races[0], p.races[1]]
    balls, g = p.balls, np.array(p.gravity)

    def whole(v: Array, spindle: float) -> Array:
        return np.concatenate([v[:6], [spindle], spindle + v[6:]]).astype(np.longdouble)

    q0, q1 = whole(STATE, psi), whole(rates, speed)
    q2 = whole(now.accelerations, now.spindle)

    disc = cloud(p.disc.mass, p.disc.com, np.array(p.disc.inertia))
    disc += [(m, np.array(place)) for m, place in p.disc.points]
    disc += cloud(0.0, np.zeros(3), np.diag([0.0, 0.0, p.motor.inertia]))
    deck = cloud(p.deck.mass, p.deck.com, np.array(p.deck.inertia))
    marks = [(0.0, np.array(mount.position)) for mount in p.mounts] + [(0.0, sensor)]

    def points(q: Array) -> Array:
        """Places of all points, those without mass first."""
        turn = about(2, q[5]) @ about(0, q[3]) @ about(1, q[4])
        on_disc = about(2, q[6])
        local = [place for _, place in marks + deck] + [on_disc @ place for _, place in disc]
        for race, ball, angle in zip(races, balls, q[7:], strict=True):
            theta = angle - q[6]
            phase = 2.0 * (theta - race.runout.oval_angle)
            h = race.radius + race.runout.oval * np.cos(phase)
            slope = -2.0 * race.runout.oval * np.sin(phase)
            flat = about(2, theta) @ np.array([h, slope, 0.0 * h])
            centre = on_disc @ (flat + np.array([*race.runout.offset, race.height]))
            spin = about(2, q[6] - way(race, theta) / ball.radius)
            inertia = ball.inertia * np.eye(3)
            local += [centre + spin @ place for _, place in cloud(ball.mass, np.zeros(3), inertia)]
        return q[:3] + np.array(local) @ turn.T

    weights = [m for m, _ in marks + deck + disc]
    for ball in balls:
        weights += [m for m, _ in cloud(ball.mass, np.zeros(3), ball.inertia * np.eye(3))]
    weights = np.array(weights)

    def at(t: float, j: int = 0, change: float = 0.0) -> Array:
        q = q0 + q1 * np.longdouble(t) + q2 * np.longdouble(t) ** 2 / 2
        q[j] += np.longdouble(change)
        return points(q)

    step = np.longdouble(1e-4)
    second = np.array([-205 / 72, 8 / 5, -1 / 5, 8 / 315, -1 / 560], np.longdouble)
    second[0] = -2 * second[1:].sum()
    first = np.array([4 / 5, -1 / 5, 4 / 105, -1 / 280])
    gain = second[0] * at(0.0) - step**2 * g
    for i in range(1, 5):
        gain = gain + second[i] * (at(i * step) + at(-i * step))
    gain = gain / step**2
    velocity = sum(first[i - 1] * (at(i * step) - at(-i * step)) for i in range(1, 5)) / step

    force = np.zeros((len(weights), 3))
    for i, mount in enumerate(p.mounts):
        u, v = (at(0.0)[i] - mount.position).astype(float), velocity[i].astype(float)
        a = np.array(mount.axes)
        force[i] = -a @ (mount.stiffness * (a.T @ u) + mount.damping * (a.T @ v))
        force[i] -= mount.cubic * (u @ u) * u
    path = np.array([
        float(way(race, t + 1e-6) - way(race, t - 1e-6)) / 2e-6
        for race, t in zip(races, STATE[6:], strict=True)
    ])  # fmt: skip
    drag = np.array([race.drag / race.radius**2 for race in races])
    along = (now.friction - drag * path * rates[6:]) * path
    torque = p.motor.kp * (command - speed) - p.motor.slope * speed
    assert now.torque == pytest.approx(torque, rel=1e-14)
    for j in range(7 + len(balls)):
        vary = sum(
            first[i - 1] * (at(0.0, j, i * step) - at(0.0, j, -i * step)) / step
            for i in range(1, 5)
        )
        work = np.sum(force * vary)
        work += torque - along.sum() if j == 6 else along[j - 7] if j > 6 else 0.0
        inertial = np.sum(weights[:, None] * gain * vary)
        scale = np.abs(weights[:, None] * gain * vary).sum() + np.abs(force * vary).sum()
        assert float(inertial) == pytest.approx(float(work), abs=1e-9 * float(scale))

    turn = Rotation.from_euler("ZXY", STATE[[5, 3, 4]]).as_matrix()
    outward = np.array([np.cos(psi + STATE[6:]), np.sin(psi + STATE[6:]), np.zeros(3)]).T @ turn.T
    centres = gain[[-15, -8, -1]].astype(float)  # the last of each ball's seven points
    normal = -np.array([b.mass for b in balls]) * np.sum(centres * outward, axis=1)
    np.testing.assert_allclose(now.normal, normal, rtol=1e-8)
    slides = [-(1e-5 / b.radius + 2.0) * n * np.sign(v)
              for b, n, v in zip(balls[1:], normal[1:], rates[7:], strict=True)]  # fmt: skip
    np.testing.assert_allclose(now.friction[1:], slides, rtol=1e-8)
    assert now.accelerations[6] == pytest.approx(0.0, abs=1e-8)
    felt = axes @ turn.T @ gain[len(p.mounts)].astype(float)
    np.testing.assert_allclose(now.specific_force, felt, rtol=1e-8)


# Conservation


@pytest.mark.parametrize("spindle", ["turned by a motor", "prescribed"])
def test_energy_without_losses(spindle: str) -> None:
    driven = spindle == "prescribed"
    p = without_drag(ODD).but(
        spindle=Spindle(80.0, 0.2, ((0.02, 50.0),) if driven else ()),
        motor=None if driven else Motor(3e-6),
    )
    run = simulate_deck(p, STATE, RATES, np.linspace(0.0, 0.04, 5), rtol=1e-11)
    assert not run.losses.any()
    assert np.abs(run.imbalance()).max() < 1e-10 * np.abs(run.energy()).max()
    if not driven:
        assert not run.work.any()
        assert np.ptp(run.w) > 0.1


def test_energy_with_everything() -> None:
    p = damped(ODD).but(
        spindle=Spindle(45.0, 0.2, ((0.1, 100.0),)),
        motor=Motor(3e-6, 5e-3, 0.05, 0.003, 1e-6),
        friction=Friction(1e-4, 0.02),
        contact=Contact(0.6, 1e-3),
    )
    state = STATE.copy()
    state[7] = 0.68  # beside the first ball
    run = simulate_deck(p, state, RATES, np.linspace(0.0, 0.2, 5), rtol=1e-11, max_step=2e-3)
    assert np.abs(run.imbalance()).max() < 1e-10 * np.abs(run.energy()).max()
    assert (run.losses[-1] > 0.0).all()
    assert {"impact", "stick", "release", "reverse", "motor"} <= {e.kind for e in run.events}


def test_free_deck_keeps_momentum_and_angular_momentum() -> None:
    """Motor, drag, friction and contact act within it."""
    p = ODD.but(
        mounts=(), gravity=(0.0, 0.0, 0.0), motor=Motor(3e-6, 5e-3, 0.0, 1.0),
        spindle=Spindle(90.0), friction=Friction(4e-5, 0.01), contact=Contact(0.6),
    )  # fmt: skip
    state = STATE.copy()
    state[7] = 0.68
    run = simulate_deck(p, state, RATES, [0.0, 0.05, 0.1], speed=60.0, rtol=1e-11, max_step=2e-3)
    model = DeckModel(p)
    both = [model.momentum(q, v) for q, v in zip(run.q, run.rates, strict=True)]
    momentum, turning = (np.array(values) for values in zip(*both, strict=True))
    assert np.ptp(run.w) > 5.0 and "impact" in {event.kind for event in run.events}
    assert np.ptp(run.deck_rates[:, 3:], axis=0).min() > 0.1
    for vector in (momentum, turning):
        assert np.linalg.norm(np.ptp(vector, axis=0)) < 1e-10 * np.linalg.norm(vector[0])
    # angular momentum about Z from bodies that only spin: J_z psi' and the rest of the deck
    still = DeckParams(Body(1.0), Disc(0.1, inertia=np.diag([1e-5, 1e-5, 2e-5])))
    q, v = np.zeros(7), np.array([0.0, 0.0, 0.0, 0.0, 0.0, 3.0, 50.0])
    np.testing.assert_allclose(DeckModel(still).momentum(q, v)[1], [0.0, 0.0, 2e-5 * 53.0])


# The plane


def planar_twin(p: Params) -> DeckParams:
    """A deck in which the planar rotor sits at z = 0, too heavy to turn or tilt."""
    balls = tuple(
        Ball(m, a, 0.4 * m * a**2) for m, a in zip(p.ball_masses, p.ball_radii, strict=True)
    )
    s = p.suspension
    axes = Rotation.from_euler("z", s.axis_angle).as_matrix()
    return DeckParams(
        Body(p.mass - sum(p.ball_masses) - p.carrier_mass, inertia=1e9 * np.eye(3)),
        Disc(p.carrier_mass, 0.0, p.eccentricity),
        (Race(p.race_radius, balls, 0.0, p.drag * p.race_radius**2, p.runout),),
        (Mount((0.0, 0.0, 0.0), (s.k1, s.k2, 1e3), (s.c1, s.c2, 0.0), axes, s.cubic),),
        (*p.gravity, 0.0),
        p.spindle, p.motor, p.friction, p.contact,
    )  # fmt: skip


PLANAR = Params(
    mass=0.1,
    suspension=Suspension(1000.0, 1500.0, 0.2, 0.5, 0.4, 3e7),
    eccentricity=1e-4,
    race_radius=0.01,
    ball_masses=(1e-3, 8e-4, 1.2e-3),
    ball_radii=(1e-3, 9e-4, 1.1e-3),
    unbalance_mass=0.08,
    drag=0.05,
    gravity=(2.0, -9.0),
    friction=Friction(1e-5, 0.05),
    contact=Contact(0.6, 1e-3),
    runout=Runout((1e-4, -5e-5), 2e-4, 0.7),
    spindle=Spindle(60.0, 0.3, ((0.1, 200.0),)),
)


@pytest.mark.parametrize(
    ("changes", "kinds"),
    [
        ({}, set()),
        ({"motor": Motor(2e-5, 0.002, 1.0, 0.004, 1e-6)}, {"motor"}),
        ({"spindle": Spindle(60.0, 0.3, ((0.1, 200.0),), feel_acceleration=False)}, set()),
    ],
    ids=["prescribed", "motor", "psi'' not felt"],
)
def test_plane(changes: dict[str, Any], kinds: set[str]) -> None:
    """A deck that cannot turn is the planar rotor, with every effect and its events."""
    p = PLANAR.but(**changes)
    times, angles, slide = [0.05, 0.15], (0.5, -1.1, 1.0), (3.0, -2.0, 1.0)
    flat = simulate(p, angles, times, start=Start(rates=slide), rtol=1e-11, max_step=2e-3)
    sag = Model(p).sag
    run = simulate_deck(
        planar_twin(p), [*sag, *np.zeros(4), *angles], [*np.zeros(6), *slide], times,
        rtol=1e-11, max_step=2e-3,
    )  # fmt: skip
    assert kinds | {"impact", "stick", "release"} <= {event.kind for event in flat.events}
    assert [(e.kind, e.ball) for e in run.events] == [(e.kind, e.ball) for e in flat.events]
    np.testing.assert_allclose(run.deck[:, :2] - sag, flat.q[:, :2], rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(run.theta, flat.theta, rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(run.w, flat.w, rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(run.losses, flat.losses, rtol=1e-8)
    np.testing.assert_allclose(run.work, flat.work, rtol=1e-8)
    assert not run.deck[:, 2:5].any(), "what starts in the plane stays there exactly"
