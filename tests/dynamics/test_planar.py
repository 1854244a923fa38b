"""The corotating arrowhead against the thesis' inertial equations, and the model's symmetries."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ab_sim.drive import Drive
from ab_sim.engine.integrate.vector_field import VectorField
from ab_sim.model.dynamics import system
from ab_sim.model.dynamics.assemble import system_of
from ab_sim.model.dynamics.system import DIRECTION, DISCRETE_COLUMNS, FIRST_TURNS, LOADED, layout_of
from ab_sim.model.equations.motion import BALL_COLUMNS
from ab_sim.model.spindle import Ramp, ScheduledSegment
from tests.dynamics.inertial import Thesis, accelerations

FRICTION = {"rolling_friction": {"arm": 2e-4}}
LITTLE_FRICTION = {"rolling_friction": {"arm": 1e-6}}
seeds = st.integers(0, 2**32 - 1)


def rotation(angle: float) -> np.ndarray:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def slope_of(
    scene: Any, state: np.ndarray, speed: float, slope: float, loaded: np.ndarray
) -> np.ndarray:
    """The state's derivative; balls slide as their rates say where they are loaded."""
    n, system = scene.balls.count, system_of(scene)
    discrete_state = np.zeros((n + 1, DISCRETE_COLUMNS), np.int64)
    discrete_state[:n, DIRECTION], discrete_state[:n, LOADED] = (
        np.sign(state[layout_of(system).rates]),
        loaded,
    )
    scheduled = ScheduledSegment(0.0, np.inf, 0.0, Ramp(speed, slope))
    return VectorField(system, scheduled, discrete_state).slope(0.0, state)


def test_columns_of_balls_have_the_names_of_the_record() -> None:
    assert [getattr(system, name.upper()) for name in BALL_COLUMNS] == [*range(FIRST_TURNS)]


@pytest.mark.parametrize("effects", [{}, FRICTION, {"ball_spin": None}])
@pytest.mark.parametrize("balls", [0, 1, 2, 5])
def test_same_accelerations_as_the_printed_equations(
    scene: Any, effects: dict[str, Any], balls: int
) -> None:
    spin, friction = effects.get("ball_spin", {}) is not None, "rolling_friction" in effects
    radius = 1e-3 if spin or friction else None
    made = scene(balls={"count": balls, "radius": radius}, effects=effects)
    layout = layout_of(system_of(made))
    p = Thesis(0.1, 1000.0, 0.2, 1e-4, 0.01, 1e-3, 1e-3, 1.0, 2e-4 if friction else 0.0, spin)
    random = np.random.default_rng(balls)
    clipped = 0
    for _ in range(200):
        psi, w, al = random.uniform(0, 6), random.uniform(-5, 200), random.uniform(-50, 50)
        u, v = random.normal(0, 5e-3, 2), random.normal(0, 0.5, 2)
        theta, rate = random.uniform(-9, 9, balls), random.normal(0, 20, balls)
        turn = rotation(psi)
        deck = np.concatenate([turn @ u, turn @ v])
        rubbing = np.ones(balls)
        for _ in range(balls + 1):
            want = accelerations(p, psi, w, al, deck, psi + theta, w + rate, rubbing)
            along = want[0] * np.cos(psi + theta) + want[1] * np.sin(psi + theta)
            loaded = p.R * (w + rate) ** 2 - along >= 0
            if not friction or np.all(loaded | (rubbing == 0)):
                break
            rubbing = rubbing * loaded
        clipped += int(np.sum(rubbing == 0))
        state = np.concatenate([u, v, theta, rate])
        got = slope_of(made, state, w, al, rubbing)
        J = np.array([[0.0, -1.0], [1.0, 0.0]])
        moved, pushed = got[layout.deck].reshape(2, 2)
        np.testing.assert_allclose(turn @ (pushed + w * J @ v), want[:2], rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(got[layout.rates] + al, want[2:], rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(moved, v - w * J @ u, rtol=1e-12)
    if friction and balls:
        assert clipped > 10, "the case that clips the normal force was met"


@settings(max_examples=30)
@given(seeds)
def test_mirror_image(seed: int) -> None:
    """Spin the other way round in a mirror: everything across the unbalance changes its sign."""
    from ab_sim.scene import check_scene
    from tests.conftest import THESIS, merge

    scene = check_scene(merge(THESIS, {"effects": FRICTION}), "test")
    random = np.random.default_rng(seed)
    state = random.normal(0, [5e-3, 5e-3, 0.5, 0.5, 3, 3, 20, 20])
    mirror = np.array([1, -1, 1, -1, -1, -1, -1, -1])
    w, al = random.uniform(-200, 200), random.uniform(-50, 50)
    loaded = np.ones(2)
    got = slope_of(scene, state, w, al, loaded)
    image = slope_of(scene, mirror * state, -w, -al, loaded)
    np.testing.assert_allclose(image, mirror * got, rtol=1e-9, atol=1e-9)


def test_equal_balls_may_change_places(scene: Any) -> None:
    one, other = (
        Drive(scene(start={"ball_angles": angles}, effects=LITTLE_FRICTION)).advance(3000)
        for angles in ([0.4, -1.0], [-1.0, 0.4])
    )
    np.testing.assert_allclose(one.ball_angles, other.ball_angles[:, ::-1], atol=1e-9)


def test_whole_turns_of_a_ball_change_nothing(scene: Any) -> None:
    one, other = (
        Drive(scene(start={"ball_angles": [0.4, -1.0 + turn]})).advance(3000)
        for turn in (0.0, 20 * np.pi)
    )
    np.testing.assert_allclose(one.whirl, other.whirl, rtol=1e-8)


def test_free_deck_keeps_its_momentum(scene: Any) -> None:
    """No suspension, no unbalance: nothing from outside acts across the shaft."""
    drive = Drive(
        scene(
            rotor={"eccentricity": 0.0},
            effects={"suspension": None},
            start={"speed": 100.0, "ball_angles": [0.0, 1.0]},
            profile=None,
        )
    )

    def momentum() -> np.ndarray:
        now = drive.observe()
        psi = now.psi + now.theta
        velocity = now.velocity[:, None] + 0.01 * (now.omega + now.theta_rate) * np.array(
            [-np.sin(psi), np.cos(psi)]
        )
        return 0.098 * now.velocity + 1e-3 * velocity.sum(axis=1)

    before = momentum()
    drive.advance(5000)
    assert np.linalg.norm(drive.observe().velocity) > 1e-4, "it moved"
    np.testing.assert_allclose(momentum(), before, atol=1e-12)


def test_light_balls_leave_the_plain_rotor(scene: Any) -> None:
    """m -> 0 is the rotor without balls, in proportion to m."""
    plain = Drive(scene(balls={"count": 0})).advance(3000).whirl
    gaps = []
    for mass in (1e-6, 1e-7):
        light = Drive(
            scene(balls={"mass": mass}, effects={"viscous_drag": {"coefficient": 1e3 * mass}})
        )
        gaps.append(np.abs(light.advance(3000).whirl - plain).max())
    assert gaps[1] == pytest.approx(gaps[0] / 10, rel=0.05)


def test_it_hangs_where_its_springs_hold_its_weight(scene: Any) -> None:
    """Whatever their stiffnesses are, and which way they pull."""
    random, weight = np.random.default_rng(7), 0.1 * 9.80665
    for _ in range(50):
        one, two, angle = random.uniform([300.0, 300.0, -1.5], [1e4, 1e4, 1.5]).tolist()
        cubic = float(random.uniform(0.0, 1e7))
        springs = {
            "stiffness_1": one,
            "stiffness_2": two,
            "damping_1": 0.1,
            "damping_2": 0.1,
            "axis_angle": angle,
        }
        edge = {"tilt": 1.5707963267948966, "acceleration": 9.80665}
        effects = {
            "suspension": None,
            "unequal_suspension": springs,
            "hardening_suspension": {"cubic_stiffness": cubic},
            "gravity": edge,
        }
        hung = system_of(scene(effects=effects)).deck_model
        stiffness = rotation(angle) @ np.diag([one, two]) @ rotation(angle).T
        at = np.array([hung.sag_x, hung.sag_y])
        held = stiffness @ at + cubic * (at @ at) * at
        np.testing.assert_allclose(held, [0.0, -weight], rtol=0.0, atol=1e-9)
