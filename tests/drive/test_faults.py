"""Faults: what they do to the motion, how they come and go, and what they leave behind."""

import cmath
from typing import Any

import numpy as np
import pytest

from ab_sim.drive import Drive
from ab_sim.drive.faults.fault import faults_of
from ab_sim.drive.faults.plant import faulty_system, stop_held_balls
from ab_sim.drive.observation import Observation
from ab_sim.model.dynamics.assemble import system_of
from ab_sim.model.dynamics.system import DIRECTION, MOBILITY
from ab_sim.scene import Scene, load_scene
from tests.drive.fault_session import FaultSession, places, spun

MOTOR = {"rotor_inertia": 3e-5, "torque_limit": 5e-3, "proportional_gain": 5e-3}
"""Of weak-motor's kind, but strong enough."""


def momenta(scene: Scene, now: Observation) -> np.ndarray:
    """What a shock within the drive leaves: the deck's, each ball's, the spindle's; in the plane.

    Written down anew, of point masses, and balls that roll.
    """
    M0, e, R = scene.eccentric_mass, scene.rotor.eccentricity, scene.race.radius
    v = complex(*now.velocity)
    to = cmath.exp(1j * now.psi)
    total = (scene.total_mass - scene.balls.total_mass) * v + M0 * e * now.omega * 1j * to
    motor = scene.effects.get("motor")
    turned = (motor.rotor_inertia if motor else 0.0) * now.omega + M0 * e * e * now.omega
    turned += M0 * e * (v / (1j * to)).real
    balls = []
    for m, a, theta, rate in zip(
        scene.balls.masses, scene.balls.radii, now.theta, now.theta_rate, strict=True
    ):
        tangent = 1j * to * cmath.exp(1j * theta)
        ball = v + R * (now.omega + rate) * tangent
        along, spin = (ball / tangent).real, now.omega - R * rate / a
        inertia = 0.4 * m * a * a
        total += m * ball
        balls.append(m * R * along - inertia * R / a * spin)
        turned += m * R * along + inertia * spin
    return np.array([total.real, total.imag, turned, *balls])


def test_a_stuck_ball_is_a_part_of_the_rotor(scene: Any) -> None:
    """Exactly: another unbalance, in another direction, and one ball less."""
    angles = (0.7, 2.0)
    broken = scene(start={"ball_angles": angles})
    m, R, M0, e = 1e-3, 0.01, broken.eccentric_mass, broken.rotor.eccentricity
    unbalance = M0 * e + m * R * cmath.exp(1j * angles[0])
    further = cmath.phase(unbalance)
    same = scene(
        rotor={
            "total_mass": 0.101,  # its own ball_0 is lost
            "eccentric_mass": M0 + m,
            "eccentricity": abs(unbalance) / (M0 + m),
        },
        start={"ball_angles": [0.0, angles[1] - further], "angle": further},
    )
    stuck = Drive(broken, faults=faults_of(["ball_0 sticks"])).advance(4000)
    merged = Drive(same, faults=faults_of(["ball_0 lost"])).advance(4000)
    assert np.ptp(stuck.ball_angles[:, 0]) == 0.0
    assert np.abs(stuck.position).max() > 1e-3, "through the resonance"
    assert np.abs(stuck.position - merged.position).max() < 1e-11
    apart = stuck.ball_angles[:, 1] - further - merged.ball_angles[:, 1]
    assert np.abs(apart).max() < 1e-9


def test_a_stepper_that_solves_for_the_drag_holds_it_too(scene: Any) -> None:
    texts = faults_of(["ball_0 sticks"])
    held = [
        Drive(scene(solver={"stepper": stepper}), faults=texts).advance(1000)
        for stepper in ("imex8", "rk8")
    ]
    assert np.ptp(held[0].ball_angles[:, 0]) < 1e-100
    assert np.abs(held[0].ball_angles - held[1].ball_angles).max() < 1e-9


def test_a_stuck_ball_burdens_the_motor(scene: Any) -> None:
    """By its mass on the race, and by its own inertia: it turns with the rotor."""
    effects, at = {"motor": MOTOR}, {"ball_angles": [0.0, 1.0]}
    broken = scene(effects=effects, start=at, spindle={"max_acceleration": 100.0})
    m, a, R, M0, e = 1e-3, 1e-3, 0.01, broken.eccentric_mass, broken.rotor.eccentricity
    mass, arm = M0 + m, (M0 * e + m * R) / (M0 + m)
    inertia = MOTOR["rotor_inertia"] + M0 * e**2 + m * R**2 + 0.4 * m * a**2 - mass * arm**2
    same = scene(
        rotor={"total_mass": 0.101, "eccentric_mass": mass, "eccentricity": arm},
        effects={"motor": {**MOTOR, "rotor_inertia": inertia}},
        start=at,
        spindle={"max_acceleration": 100.0},
    )
    stuck = Drive(broken, faults=faults_of(["ball_0 sticks"])).advance(1500)
    merged = Drive(same, faults=faults_of(["ball_0 lost"])).advance(1500)
    assert stuck["speed"][-1] > 20.0
    assert np.abs(stuck["speed"] - merged["speed"]).max() < 1e-9
    assert np.abs(stuck.ball_angles[:, 1] - merged.ball_angles[:, 1]).max() < 1e-9


def test_a_stuck_ball_of_a_deck_in_space() -> None:
    deck = load_scene("feeding-deck", ["start.ball_angles=[0, 2]", "start.speed=100"])
    m, R, M0, e = 2e-4, 0.03, deck.eccentric_mass, deck.rotor.eccentricity
    mass, arm = M0 + m, (M0 * e + m * R) / (M0 + m)
    # About the common centre; both lie on the first axis.
    more = M0 * (arm - e) ** 2 + m * (R - arm) ** 2
    assert deck.rotor.inertia is not None
    xx, yy, zz = deck.rotor.inertia
    same = load_scene(
        "feeding-deck",
        [
            "start.ball_angles=[0, 2]", "start.speed=100", f"rotor.eccentric_mass={mass}",
            f"rotor.mass={0.13 + m}", f"rotor.eccentricity={arm}",
            f"rotor.inertia=[{xx}, {yy + more}, {zz + more}]",
        ],
    )  # fmt: skip
    stuck = Drive(deck, faults=faults_of(["ball_0 sticks"])).advance(1500)
    merged = Drive(same, faults=faults_of(["ball_0 lost"])).advance(1500)
    assert np.abs(stuck.position).max() > 1e-5
    assert np.abs(stuck.position - merged.position).max() < 1e-12
    assert np.abs(stuck.turn - merged.turn).max() < 1e-11
    assert np.abs(stuck.ball_angles[:, 1] - merged.ball_angles[:, 1]).max() < 1e-9


def test_a_lost_ball_is_none(scene: Any) -> None:
    left = Drive(scene(), faults=faults_of(["ball_1 lost"]))
    alone = Drive(scene(balls={"count": 1}, rotor={"total_mass": 0.099, "eccentric_mass": 0.098}))
    trajectory, other = left.advance(4000), alone.advance(4000)
    assert np.abs(trajectory.position - other.position).max() < 1e-11
    assert np.abs(trajectory.ball_angles[:, :1] - other.ball_angles).max() < 1e-9
    assert left.observe().driving_force[1] == 0.0


@pytest.mark.parametrize("motor", [False, True])
def test_momentum_stays_as_a_ball_sticks(scene: Any, motor: bool) -> None:
    made = scene(effects={"motor": MOTOR} if motor else {})
    session = spun(made)
    before = session.drive.observe()
    after = session.inject("ball_0 sticks")
    assert places(after) == pytest.approx(places(before), abs=1e-15)
    assert abs(before.theta_rate[0]) > 0.1 and after.theta_rate[0] == 0.0
    assert np.abs(after.velocity - before.velocity).max() > 1e-6
    was, now = momenta(made, before), momenta(made, after)
    kept = [0, 1, 4] + ([2] if motor else [])
    assert now[kept] == pytest.approx(was[kept], rel=1e-11)
    assert (after.omega == before.omega) is not motor
    assert (after.time, after.command) == (before.time, before.command)


def test_momentum_stays_of_a_deck_in_space() -> None:
    """What comes to rest is one ball; angular momentum about no point on the shaft changes."""
    session = spun(load_scene("feeding-deck", ["start.speed=20"]), 300.0, 300)
    before = session.drive.observe()
    after = session.inject("ball_1 sticks")
    assert places(after) == pytest.approx(places(before), abs=1e-15)
    assert abs(before.theta_rate[1]) > 1e-3 and after.theta_rate[1] == 0.0
    moved = [_in_space(session.drive.scene, now) for now in (before, after)]
    assert np.abs(after.velocity - before.velocity).max() > 1e-9
    assert moved[1] == pytest.approx(moved[0], abs=1e-12 * np.abs(moved[0]).max())


def _in_space(scene: Scene, now: Observation) -> np.ndarray:
    """Momentum along X and Y, where nothing tilts (all heights are 0), and about the shaft's C.

    The motor keeps the spindle's speed relative to the deck: within the drive.
    """
    R, v = scene.race.radius, complex(*now.velocity[:2])
    deck, rotor = scene.deck, scene.eccentric_mass
    assert deck is not None and scene.rotor.inertia is not None
    turned = cmath.exp(1j * now.tilt[2])
    spin, own = now.angular_velocity[2], scene.total_mass - scene.balls.total_mass - rotor
    bodies = [
        (own, turned * complex(*deck.center[:2]), spin, deck.inertia[2]),
        (
            rotor,
            turned * scene.rotor.eccentricity * cmath.exp(1j * now.psi),
            spin + now.omega,
            scene.rotor.inertia[2],
        ),
    ]
    for m, theta, rate in zip(scene.balls.masses, now.theta, now.theta_rate, strict=True):
        at = turned * R * cmath.exp(1j * (now.psi + theta))
        bodies.append((m, at, spin + now.omega + rate, 0.0))
    linear, angular = 0j, 0.0
    for m, at, speed, inertia in bodies:
        moving = v + 1j * speed * at
        linear += m * moving
        angular += m * (at.conjugate() * moving).imag + inertia * speed
    return np.array([linear.real, linear.imag, angular])


@pytest.mark.parametrize("name", ["thesis-hold", "feeding-deck"])
def test_what_is_cleared_has_never_been(name: str) -> None:
    """The very system again, and the motion of a drive that is sound from here on."""
    session = spun(load_scene(name), 120.0, 600)
    thing = "mount_2" if session.drive.scene.mounts else "suspension"
    session.inject("ball_0 sticks", f"{thing} softens 0.5", "disc slips 3", "spindle saturates 2")
    session.run(300)
    stuck = session.drive.observe()
    freed = session.inject()
    assert freed.theta_rate[0] == 0.0 and places(freed) == pytest.approx(places(stuck), abs=1e-12)
    sound, now = system_of(session.drive.scene), session.drive.system
    assert np.array_equal(now.balls, sound.balls, equal_nan=True) and now.effects == sound.effects
    assert repr(now.deck_model) == repr(sound.deck_model)
    assert freed.psi == pytest.approx(session.drive.schedule.angle(session.drive.time), abs=1e-9)
    other = FaultSession(session.drive.scene)
    other.drive.restore(session.drive.snapshot())
    assert np.array_equal(places(other.run(200)), places(session.run(200)))


def test_a_slipped_disc_returns_to_its_place_only_if_it_no_longer_slips(scene: Any) -> None:
    session = spun(scene())
    session.inject("disc slips 3")
    session.run(300)
    slipped, hub = session.drive.observe(), session.heard()["angle"][0]
    assert hub - slipped.psi > 0.8
    assert session.inject("disc slips 3", "ball_0 sticks").psi == slipped.psi
    returned = session.inject()
    assert returned.psi == pytest.approx(hub, abs=1e-12)
    assert places(returned) == pytest.approx(places(slipped), abs=1e-12)


def test_a_ball_that_is_given_back_lies_where_it_was_lost(scene: Any) -> None:
    session = spun(scene())
    lost = session.inject("ball_1 lost")
    assert places(lost) == pytest.approx(places(session.drive.observe()))
    session.run(500)
    back = session.inject()
    assert back.theta[1] == lost.theta[1] and back.theta_rate[1] == 0.0
    assert session.run(500).theta[1] != back.theta[1], "it is free"


def test_soft_mounts_are_those_of_another_scene(scene: Any) -> None:
    for made, text, changed in (
        (scene(), "suspension softens 0.25", scene(effects={"suspension": {"stiffness": 250.0}})),
        (
            load_scene("feeding-deck"),
            "mount_3 softens 0.25",
            load_scene("feeding-deck", ["mounts=" + _mounts(0.25)]),
        ),
    ):
        soft = Drive(made, faults=faults_of([text])).advance(800)
        other = Drive(changed).advance(800)
        assert np.array_equal(soft.samples, other.samples)


def test_a_suspension_that_is_not_the_same_all_around(scene: Any) -> None:
    springs = {"stiffness_1": 900.0, "stiffness_2": 1100.0, "damping_1": 0.2, "damping_2": 0.3}
    made = scene(effects={"suspension": None, "unequal_suspension": springs})
    faults = faults_of(["unequal_suspension softens 0.5"])
    soft = faulty_system(system_of(made), made, faults)
    assert made.effects["unequal_suspension"]._replace(stiffness_1=450.0, stiffness_2=550.0) in (
        soft.effects
    )


def _mounts(last: float) -> str:
    """Feeding-deck's, the last one softer."""
    mounts = load_scene("feeding-deck").mounts
    each = [1.0, 1.0, 1.0, last]
    told = (
        f"{{position: {list(m.position)}, stiffness: {part * float(m.stiffness)!r}, damping: 0.6}}"  # type: ignore[arg-type]
        for m, part in zip(mounts, each, strict=True)
    )
    return f"[{', '.join(told)}]"


def test_a_disc_that_slips_falls_behind_the_hub(scene: Any) -> None:
    """Its unbalance turns more slowly, with the force of the hub's speed; here without balls."""
    none = scene(balls={"count": 0, "mass": None, "radius": None})
    slipping, slower = FaultSession(none, "disc slips 5"), FaultSession(none)
    slipping.run(6000, 80.0)
    slower.run(6000, 75.0)
    now = slipping.drive.observe()
    heard = slipping.heard()
    # The jerk at 6 s is due, and not yet done.
    assert heard["angle"][0] - now.psi == pytest.approx(5.0 * 5.99, abs=1e-9)
    assert heard["angle"][0] == pytest.approx(80.0 * (6.0 - 0.5 * 80.0 / 100.0), abs=1e-6)
    assert heard["speed"][0] == now.omega == 80.0
    whirl = slower.drive.observe().whirl * (80.0 / 75.0) ** 2
    assert now.whirl == pytest.approx(whirl, rel=0.01)


def test_nothing_else_leaps_as_a_disc_slips(scene: Any) -> None:
    session = spun(scene())
    session.inject("disc slips -20")
    before = session.drive.observe()
    session.run(10)
    leap = session.commanded.faults.jerk(session.drive)
    assert leap is not None
    there = session.drive.observe()
    session.drive.restore(leap)
    after = session.drive.observe()
    assert after.psi == pytest.approx(there.psi + 0.2) and there.psi > before.psi
    assert places(after) == pytest.approx(places(there), abs=1e-12)
    assert after.velocity == pytest.approx(there.velocity, rel=1e-12)


def test_a_ball_sticks_at_the_start_whatever_its_rate(scene: Any) -> None:
    made = scene(start={"ball_rates": [5.0, 5.0]})
    assert Drive(made, faults=faults_of(["ball_1 sticks"])).observe().theta_rate.tolist() == [5, 0]


def test_a_shock_may_turn_the_way_in_which_other_balls_slide() -> None:
    """Friction acts against the motion that is there after a ball jammed."""
    changes = ("balls.count=3", "balls.mass=[5e-3, 1e-3, 1e-3]", "start.ball_angles=[0, 0.3, 3]")
    scene = load_scene("thesis-hold", [*changes, "start.ball_rates=[100, 1e-6, 2]"])
    system = system_of(scene)
    drive = Drive(scene)
    state, layout = drive.snapshot().state.copy(), drive.layout
    discrete_state = drive.snapshot().discrete_state.copy()
    held = system._replace(balls=system.balls.copy())
    held.balls[0, MOBILITY] = 0.0
    stop_held_balls(held, state, discrete_state, [0], 0.0)
    rates = state[layout.rates]
    assert rates[0] == 0.0 and rates[1] < 0.0, "the case that is wanted: a ball that turns round"
    assert discrete_state[:3, DIRECTION].tolist() == np.sign(rates).tolist()
