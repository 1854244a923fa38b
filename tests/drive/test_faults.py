"""Faults: what they do to the motion, how they come and go, and what they leave behind."""

import cmath
import random
from typing import Any

import numpy as np
import pytest

from ab_sim.accuracy.live_checks import LiveChecks
from ab_sim.drive import Drive
from ab_sim.drive.faults.active import transfer_faults
from ab_sim.drive.faults.fault import check_faults, faults_of
from ab_sim.drive.faults.plant import faulty_system
from ab_sim.drive.observation import Observation
from ab_sim.drive.trajectory import Trajectory
from ab_sim.dynamics.assemble import system_of
from ab_sim.errors import CommandError, InputError
from ab_sim.nodes.command_path import CommandPath, Rules
from ab_sim.nodes.commanded_drive import CommandedDrive
from ab_sim.scene import Scene, load_scene

MOTOR = {"rotor_inertia": 3e-5, "torque_limit": 5e-3, "proportional_gain": 5e-3}
"""Of weak-motor's kind, but strong enough."""


class Bench:
    """A drive that faults come to and leave, as on the bench, without ROS."""

    def __init__(self, scene: Scene, *texts: str) -> None:
        self.drive = Drive(scene, commanded=True, faults=faults_of(texts))
        self.path = CommandPath(self.drive.servo, self.drive.step, Rules())
        self.led = CommandedDrive(self.drive, self.path)

    def run(self, steps: int, speed: float | None = None) -> Observation:
        if speed is not None:
            self.path.hear(speed, self.drive.steps)
        for _ in self.led.advance(steps):
            pass
        return self.drive.observe()

    def heard(self) -> Trajectory:
        """The present, as sensors have it."""
        return self.led.faults.heard(self.drive.present()).present

    def inject(self, *texts: str) -> Observation:
        """These, instead of those that are in force; the drive right afterwards."""
        other = Drive(self.drive.scene, commanded=True, faults=faults_of(texts))
        faults = transfer_faults(self.drive, other, self.led.faults)
        self.drive, self.led = other, CommandedDrive(other, self.path, None, faults)
        return other.observe()


def spun(scene: Scene, speed: float = 150.0, steps: int = 2500) -> Bench:
    session = Bench(scene)
    session.run(steps, speed)
    return session


def places(now: Observation) -> np.ndarray:
    """Where anybody sees things."""
    balls = np.exp(1j * (now.psi + now.theta))
    return np.concatenate([now.position, balls.real, balls.imag])


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
        for stepper in ("collocation", "rk8")
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
    assert freed.psi == pytest.approx(session.drive.profile.angle(session.drive.time), abs=1e-9)
    other = Bench(session.drive.scene)
    other.drive.restore(session.drive.snapshot())
    assert np.array_equal(places(other.run(200)), places(session.run(200)))


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
    slipping, slower = Bench(none, "disc slips 5"), Bench(none)
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


def test_what_is_heard_of_a_slipping_disc_is_told_from_the_hub(scene: Any) -> None:
    """The hub has turned further than the disc, and where balls are in space does not change."""
    session = Bench(scene(), "disc slips 5")
    session.run(1000, 80.0)
    slipped, true, heard = session.led.faults.slipped, session.drive.present(), session.heard()
    assert slipped > 4.9
    assert heard["angle"] == pytest.approx(true["angle"] + slipped, abs=1e-12)
    before = true["angle"][:, None] + true.ball_angles
    np.testing.assert_allclose(heard["angle"][:, None] + heard.ball_angles, before, atol=1e-12)


def test_nothing_else_leaps_as_a_disc_slips(scene: Any) -> None:
    session = spun(scene())
    session.inject("disc slips -20")
    before = session.drive.observe()
    session.run(10)
    leap = session.led.faults.jerk(session.drive)
    assert leap is not None
    there = session.drive.observe()
    session.drive.restore(leap)
    after = session.drive.observe()
    assert after.psi == pytest.approx(there.psi + 0.2) and there.psi > before.psi
    assert places(after) == pytest.approx(places(there), abs=1e-12)
    assert after.velocity == pytest.approx(there.velocity, rel=1e-12)


def test_however_steps_are_grouped(scene: Any) -> None:
    benches = [Bench(scene(), "disc slips 7", "ball_1 sticks") for _ in range(2)]
    for session, groups in zip(benches, ([1] * 333 + [667], [1000]), strict=True):
        session.path.hear(120.0, 0)
        for steps in groups:
            session.run(steps)
    assert np.array_equal(*(places(session.drive.observe()) for session in benches))


SENSORS = {"pickup": {"noise_density": 0.0, "sample_rate": 100.0, "range": 50.0}}


def test_sensors_lie_and_the_motion_does_not_know(scene: Any) -> None:
    sound, session = spun(scene(sensors=SENSORS)), spun(scene(sensors=SENSORS))
    session.inject(
        "pickup drifts 200", "pickup saturates 20", "spindle drifts -3", "spindle drops 0.5"
    )
    told = []
    for _ in range(60):
        true, now = sound.run(4), session.run(4)
        assert np.array_equal(true.readings["pickup"], now.readings["pickup"])
        heard, silent = session.led.faults.heard(session.drive.present())
        told.append("spindle" in silent)
        since = now.steps - 2500
        assert heard["speed"][0] == pytest.approx(150.0 - 3e-3 * since)
        said = np.array([heard["pickup_1"][0], heard["pickup_2"][0]])
        # Drift is that of the sample, which is held.
        sampled = (now.steps // 10 * 10 - 2500) * 1e-3
        offset = np.clip(true.readings["pickup"] + 200.0 * max(sampled, 0.0), -50.0, 50.0)
        assert said == pytest.approx(np.clip(offset, -20.0, 20.0), abs=2.5e-3)
        assert np.array_equal(heard.position[0], true.position)
        steps = np.array([now.steps - 40, now.steps])
        both = np.array([now.readings["pickup"]] * 2)
        kept, sampled = session.led.faults.sampled("pickup", steps, both)
        assert np.array_equal(kept, steps) and np.array_equal(sampled[1], said)
    assert 10 < sum(told) < 50
    session.inject()
    heard, silent = session.led.faults.heard(session.drive.present())
    assert not silent
    assert [heard["pickup_1"][0], heard["pickup_2"][0]] == true.readings["pickup"].tolist()


def test_errors_are_those_of_the_drive_as_it_is(scene: Any) -> None:
    """What is done again with half the step is broken in the same way."""
    texts = ["ball_1 sticks", "suspension softens 0.5", "pickup drops", "spindle drifts 1"]
    drive = Drive(scene(sensors=SENSORS), commanded=True, faults=faults_of(texts))
    checks = LiveChecks(drive, 1.0)
    checks.command(150.0)
    checks.advance(1000)
    checks.check(2000)
    assert checks.checked > 0
    assert 0.0 < checks.estimate.angle < 1e-6


def test_the_vibration_of_a_scene_without_sensors(scene: Any) -> None:
    session = spun(scene())
    session.inject("vibration saturates 0.01", "vibration drops")
    session.run(1)
    heard, silent = session.led.faults.heard(session.drive.present())
    assert np.abs(heard.acceleration).max() == 0.01
    assert silent == {"vibration"}
    none = session.led.faults.sampled("vibration", np.arange(5), np.zeros((5, 2)))
    assert [part.shape for part in none] == [(0,), (0, 2)]


def test_what_goes_on_goes_on(scene: Any) -> None:
    """A second injection leaves alone what is in both; a reset lets faults begin anew."""
    session = spun(scene())
    session.inject("spindle drifts 1", "disc slips 1")
    session.run(1000)
    slipped = session.led.faults.slipped
    session.inject("spindle drifts 1", "disc slips 1", "ball_0 sticks")
    assert session.led.faults.slipped == slipped == pytest.approx(0.99)
    now = session.drive.observe()
    assert session.heard()["speed"][0] == pytest.approx(now.omega + 1.0)
    session.led.reset_time()
    now = session.run(500)
    assert session.heard()["speed"][0] == pytest.approx(now.omega + 1.5)
    session.led.reset()
    now = session.drive.observe()
    assert (session.led.faults.slipped, now.omega) == (0.0, 0.0)
    assert session.heard()["speed"][0] == 0.0
    session.run(100, 10.0)
    session.led.reset_state()
    now = session.drive.observe()
    assert session.heard()["speed"][0] == 0.0
    assert now.theta_rate[0] == 0.0


def test_a_ball_sticks_at_the_start_whatever_its_rate(scene: Any) -> None:
    made = scene(start={"ball_rates": [5.0, 5.0]})
    assert Drive(made, faults=faults_of(["ball_1 sticks"])).observe().theta_rate.tolist() == [5, 0]


@pytest.mark.parametrize(
    ("texts", "said"),
    [
        (["ball_2 sticks"], "'ball_2 sticks': 'sticks' goes with ball_0, ball_1 in this scene"),
        (["mount_0 softens 0.5"], "goes with suspension in this scene"),
        (["pickup drops"], "'drops' goes with vibration, spindle in this scene"),
        (["ball_0 slips 2"], "'slips' goes with disc in"),
        (["ball_0 stick"], "did you mean 'sticks'?"),
        (["ball_0"], "must be a thing and what ails it, e.g. 'ball_0 sticks'"),
        (["ball_0 sticks 3"], "3: no number goes with it"),
        (["spindle drops 0.5 1"], "must be a thing and what ails it"),
        (["disc slips"], "needs a number, rad/s, not 0"),
        (["disc slips nan"], "nan: must be not 0, from -100 to 100"),
        (["disc slips 0"], "must be not 0"),
        (["suspension softens 1"], "must be between 0 and 1"),
        (["suspension softens x"], "x: must be between 0 and 1"),
        (["spindle saturates -1"], "must be from 0 to 1e9"),
        (["spindle drifts inf"], "inf: must be"),
        (["ball_0 sticks", "ball_0 lost"], "'ball_0 sticks' and 'ball_0 lost' exclude each other"),
        (["disc slips 1", "disc slips 2"], "exclude each other"),
    ],
)
def test_no_such_fault(scene: Any, texts: list[str], said: str) -> None:
    with pytest.raises(InputError) as error:
        check_faults(faults_of(texts), scene())
    assert said in str(error.value)


def test_what_is_not_modelled() -> None:
    for name, text, said in (
        ("everything", "ball_0 sticks", "balls that touch push each other"),
        ("everything", "disc slips 1", "the race is off the shaft"),
        ("couple-unbalance", "disc slips 1", "not the same all around the shaft"),
        ("no-ball", "ball_0 lost", "'lost' goes with nothing in this scene"),
    ):
        with pytest.raises(InputError, match=said):
            check_faults(faults_of([text]), load_scene(name))
    with pytest.raises(ValueError, match="keeps no energy balance"):
        Drive(load_scene("nsc-case-1"), energy_balance=True, faults=faults_of(["ball_0 sticks"]))


def test_texts_say_what_they_mean() -> None:
    texts = ["ball_0 sticks", "mount_0 softens 0.5", "pickup drops", "disc slips -1e-3"]
    faults = faults_of(["", *texts, " "])
    assert [fault.text for fault in faults] == [*texts[:2], "pickup drops 1", "disc slips -0.001"]
    assert faults_of(fault.text for fault in faults) == faults


FAULTS = (
    "ball_0 sticks", "ball_0 lost", "ball_1 sticks", "ball_1 lost", "suspension softens 0.3",
    "disc slips 9", "disc slips -2", "vibration drops 0.5", "vibration drifts 1e3",
    "vibration saturates 1", "spindle drifts -5", "spindle saturates 30", "ball_7 sticks", "junk",
)  # fmt: skip


def play(session: Bench, chance: random.Random) -> None:
    """Anything that may happen on a bench."""
    what = chance.choice(["inject", "inject", "clear", "command", "reset", "time", "state"])
    try:
        if what == "inject":
            session.inject(*chance.sample(FAULTS, chance.randint(1, 4)))
        elif what == "clear":
            session.inject()
        elif what == "command":
            session.path.hear(chance.choice([0.0, 90.0, 110.0, -300.0, 1e4]), session.drive.steps)
        else:
            {
                "reset": session.led.reset,
                "time": session.led.reset_time,
                "state": session.led.reset_state,
            }[what]()
    except (InputError, CommandError):
        pass
    for part in session.led.advance(chance.choice([1, 7, 40])):
        assert np.isfinite(part.samples).all()
    heard = session.heard()
    assert np.isfinite(heard.samples).all()
    held = {f.thing for f in session.drive.faults if f.ails in ("sticks", "lost")}
    assert all(heard.ball_rates[0, int(name[-1])] == 0.0 for name in held)


@pytest.mark.parametrize(("name", "sequences"), [("", 250), ("thesis-hold", 12)])
def test_whatever_happens(scene: Any, name: str, sequences: int) -> None:
    made = load_scene(name) if name else scene()
    for seed in range(sequences):
        chance = random.Random(seed)
        session = Bench(made)
        for _ in range(4):
            play(session, chance)
