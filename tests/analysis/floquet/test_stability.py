"""Periodic solutions and their multipliers: what they must be whatever the method."""

import math

import numpy as np
import pytest

import ab_sim
from ab_sim.analysis.floquet import STARTS, TurnMap, follow, solutions_of
from ab_sim.analysis.floquet.stability import Stability, multiplier_distance
from ab_sim.analysis.floquet.turn import balanced_angles
from ab_sim.analysis.held_speed import held
from ab_sim.base.errors import InputError, SceneError
from ab_sim.drive import Drive
from ab_sim.drive.trajectory import Trajectory
from ab_sim.scene import Scene, check_scene, load_scene
from ab_sim.scene.load import changed_scene
from tests.analysis.floquet.scenes import PLANE, deck, equal, plane
from tests.conftest import merge

EQUAL = {"unequal_suspension": equal(1000.0, 0.2)}


def test_at_rest_on_the_rotor_multipliers_are_those_of_the_eigenvalues() -> None:
    """Of an equilibrium, exp(lambda T) with lambda of the exact Jacobian: an isotropic drive.

    Once as it is, and once as two suspensions that are equal, whose spindle angle drops out.
    """
    scene = plane(effects=EQUAL)
    found = solutions_of(scene, 200.0, "balanced")[0]
    same = merge(PLANE, {"effects": {"unequal_suspension": None, "gravity": None}})
    same["effects"]["suspension"] = {"stiffness": 1000.0, "damping": 0.2}
    field = held(check_scene(same, "test"), 200.0)
    rates = np.linalg.eigvals(field.jacobian(0.0, found.orbit.start))
    assert multiplier_distance(found.multipliers, np.exp(rates * found.period)) < 1e-11


@pytest.mark.parametrize("angle", [0.3, 2.0])
def test_multipliers_do_not_depend_on_where_a_turn_begins(angle: float) -> None:
    one = solutions_of(plane(), 70.0, "start")[0]
    other = solutions_of(plane(start={"angle": angle}), 70.0, "start")[0]
    assert multiplier_distance(one.multipliers, other.multipliers) < 1e-11
    assert other.whirl == pytest.approx(one.whirl, rel=1e-6)
    assert np.abs(one.orbit.start - other.orbit.start).max() > 1e-5, "it does move"


def test_a_turn_the_other_way_is_the_mirror_image() -> None:
    axis = PLANE["effects"]["unequal_suspension"]["axis_angle"]
    one = solutions_of(plane(), 70.0, "start")[0]
    mirrored = plane(
        start={"ball_angles": [-0.4, 0.3]}, effects={"unequal_suspension": {"axis_angle": -axis}}
    )
    other = solutions_of(mirrored, -70.0, "start")[0]
    assert multiplier_distance(one.multipliers, other.multipliers) < 1e-11
    np.testing.assert_allclose(other.angles, -one.angles, atol=1e-9)


def test_the_axes_of_the_suspension_turn_with_everything() -> None:
    one = solutions_of(plane(), 70.0, "start")[0]
    turned = {"axis_angle": PLANE["effects"]["unequal_suspension"]["axis_angle"] + 0.7}
    other = plane(start={"angle": 0.7}, effects={"unequal_suspension": turned})
    found = solutions_of(other, 70.0, "start")[0]
    assert multiplier_distance(one.multipliers, found.multipliers) < 1e-11
    np.testing.assert_allclose(found.orbit.start, one.orbit.start, atol=1e-9)


def test_the_quaternion_s_length_is_left_out_and_would_have_been_a_one() -> None:
    """All 17 states' multipliers are the 16 genuine ones, and 1 for the length, which stays."""
    scene = deck("balls.mass=1.5e-4", "race.height=0.004", "rotor.height=0.002")
    found = solutions_of(scene, 400.0, "balanced")[0]
    assert not found.balanced, "a race at another height than the unbalance"
    assert len(found.multipliers) == 16 and len(found.state_names) == 17
    turn = TurnMap(scene, 400.0)
    flown = turn.integrate(found.orbit.start, turn.period, found.orbit.steps)
    whole = np.linalg.eigvals(flown.matrix)
    assert multiplier_distance(whole, np.append(found.multipliers, 1.0)) < 1e-9


@pytest.mark.parametrize(
    ("speed", "stable"),
    [(130, False), (179, False), (180, False),
    (181, False), (190, False), (191, True), (325, True), (335, True), (347, True), (500, True)],
)  # fmt: skip
def test_kim_and_chung_s_deck_balances_above_its_border(speed: float, stable: bool) -> None:
    found = solutions_of(load_scene("feeding-deck"), speed, "balanced")[0]
    assert found.balanced and found.stable is stable
    np.testing.assert_allclose(np.abs(np.degrees(found.angles)), 142.3, atol=0.005)


def test_the_border_of_kim_and_chung_s_deck_is_located() -> None:
    """Between 190 and 191 rad/s, from whichever side and however coarsely it is looked for."""
    scene = deck()
    borders = []
    for speeds in ([150.0, 250.0], [210.0, 180.0], [190.0, 190.5, 191.0]):
        (border,) = follow("speed", lambda w: (scene, w), speeds, ["balanced"]).borders
        assert not border.stable_below
        assert abs(border.multiplier) == pytest.approx(1.0, abs=1e-8)
        borders.append(border.value)
    assert borders == pytest.approx([190.308133] * 3, rel=1e-8, abs=1e-6)
    np.testing.assert_allclose(borders, borders[0], rtol=1e-8)


def test_rotational_modes_do_matter_at_low_damping() -> None:
    """Against the paper's claim: with c = .1 N s/m the balance at 335 rad/s is not stable."""
    scene = deck()
    low = [{**mount.model_dump(mode="json"), "damping": 0.1} for mount in scene.mounts]
    low_damped = check_scene({**scene.as_mapping(), "mounts": low}, "test")
    assert solutions_of(scene, 335.0, "balanced")[0].stable
    assert solutions_of(low_damped, 335.0, "balanced")[0].stable is False


@pytest.mark.parametrize("n", [3, 5])
def test_of_a_balanced_manifold_structural_ones_are_set_apart(n: int) -> None:
    scene = plane(balls={"count": n, "mass": 7e-4}, start={"ball_angles": None}, effects=EQUAL)
    for speed in (140.0, 200.0):
        found = solutions_of(scene, speed, "balanced")[0]
        assert found.balanced and found.structural == n - 2
        assert np.sum(np.abs(found.multipliers - 1.0) < 1e-10) == n - 2
        assert found.stable is not None and found.largest != pytest.approx(1.0, abs=1e-4)


def test_two_races_have_no_manifold_with_two_balls_each() -> None:
    found = solutions_of(load_scene("couple-unbalance"))[0]
    assert found.balanced and found.structural == 0 and found.stable


def test_degenerate_balance_is_undecided() -> None:
    """2 m R = M0 e: at 180 deg a ball's motion has no linear part."""
    mass = 1e-5 / (0.02 + 2e-4)
    scene = plane(
        rotor={"eccentric_mass": 2 * mass * 0.01 / 1e-4},
        balls={"mass": mass},
        start={"ball_angles": [math.pi, math.pi]},
        effects=EQUAL,
    )
    found = solutions_of(scene, 300.0, "start")[0]
    assert found.balanced and found.stable is None and found.verdict == "undecided"


def test_where_there_is_no_solution_none_is_found() -> None:
    """One ball too heavy: between its two branches nothing can rest on the rotor."""
    scene = plane(balls={"count": 1, "mass": 2e-3}, start={"ball_angles": [1.0]}, effects=EQUAL)
    assert solutions_of(scene, 100.0) == []
    assert solutions_of(scene, 60.0) and solutions_of(scene, 300.0)


@pytest.mark.parametrize("count", [0, 1, 64])
def test_any_number_of_balls(count: int) -> None:
    balls = {"count": count, "mass": 1e-5 if count > 1 else 5e-4}
    if count == 0:
        balls.pop("mass")
    scene = plane(
        balls={**balls, **({"radius": None} if count == 0 else {})},
        start={"ball_angles": None},
        effects={"viscous_drag": {"coefficient": 0.02}},
    )
    found = solutions_of(scene, 200.0, "balanced")[0]
    assert len(found.multipliers) == 4 + 2 * count
    assert found.orbit.residual < 1e-9 and found.difference < 1e-9
    assert np.isfinite(found.multipliers).all()


def test_unequal_balls_are_sent_to_where_they_balance() -> None:
    scene = plane(balls={"count": 3, "mass": [6e-4, 8e-4, 5e-4]}, start={"ball_angles": None})
    turn = TurnMap(scene, 200.0)
    pull = np.array([6e-6, 8e-6, 5e-6]) @ np.exp(1j * balanced_angles(turn))
    assert pull == pytest.approx(-turn.system.deck_model.unbalance, abs=1e-15)


def test_a_ball_that_hangs_in_space_is_periodic_too() -> None:
    """On edge, with little drag: it stays behind by a turn each turn, where its weight holds it.

    Within a hundredth of where drag and weight are in balance on a shaft that does not move:
    c_b R w = m g sin(how far it is carried along).
    """
    speed, drag = 200.0, 2e-4
    scene = plane(
        effects={"gravity": {"tilt": math.pi / 2}, "viscous_drag": {"coefficient": drag}},
        balls={"count": 1, "mass": 1e-4},
        start={"ball_angles": [-math.pi / 2], "ball_rates": [-speed]},
    )
    hanging, turning = solutions_of(scene, speed)
    assert hanging.ball_turns.tolist() == [-1] and turning.ball_turns.tolist() == [0]
    assert hanging.stable and turning.stable
    carried = math.asin(drag * 0.01 * speed / (1e-4 * 9.80665))
    assert hanging.angles[0] == pytest.approx(-math.pi / 2 + carried, abs=0.02)


def growth_of(scene: Scene, found: Stability, turns: int, size: float = 1e-6) -> float:
    """Return the mean growth per turn of a small disturbance, over the second half of a run."""
    turn = TurnMap(scene, found.speed)
    way = turn.basis(found.orbit.start)
    away = turn.scale * (way @ (way.T @ np.random.default_rng(0).normal(size=turn.layout.size)))

    def run(state: np.ndarray) -> Trajectory:
        most = max(scene.spindle.max_speed, abs(found.speed))
        drive = Drive(
            changed_scene(scene, {"start.speed": found.speed, "spindle.max_speed": most}, "held")
        )
        drive.restore(drive.snapshot()._replace(state=state))
        return drive.advance(round(turns * found.period / drive.step))

    one, other = run(found.orbit.start), run(found.orbit.start + size * away)
    apart = np.abs(one.position - other.position).max(axis=1) / turn.scale[0]
    if not found.structural:
        # Along a manifold of balanced positions, displaced balls neither return nor depart.
        apart = np.maximum(apart, np.abs(one.ball_angles - other.ball_angles).max(axis=1))
    length, middle = round(found.period / scene.solver.step), len(apart) // 2
    first, last = apart[middle : middle + length].max(), apart[-length:].max()
    return float((last / first) ** (length / (len(apart) - length - middle)))


def test_verdicts_agree_with_runs() -> None:
    """Of the drive, beside the solution; the largest modulus is what they grow by."""
    for speed, turns in ((150.0, 100), (230.0, 100)):
        scene = deck()
        found = solutions_of(scene, speed, "balanced")[0]
        growth = growth_of(scene, found, turns)
        assert (growth < 1.0) is found.stable
        assert growth == pytest.approx(found.largest, abs=0.02)


@pytest.mark.parametrize(
    ("changes", "speed", "words"),
    [
        ([], 100.0, "effects.rolling_friction: causes events"),
        (["effects.rolling_friction="], 0.0, "speed = 0 rad/s: .* 1e-6 to 100000"),
        (["effects.rolling_friction="], math.nan, "speed = nan rad/s: must be"),
        (["effects.rolling_friction="], math.inf, "speed = inf rad/s: must be"),
        (["effects.rolling_friction=", "effects.viscous_drag.coefficient=1e6"], 1.0,
         "race's drag is so fast"),
    ],
)  # fmt: skip
def test_what_has_no_turn_is_refused(changes: list[str], speed: float, words: str) -> None:
    scene = load_scene("thesis-baseline", changes)
    with pytest.raises((InputError, SceneError), match=words):
        TurnMap(scene, speed)


def test_other_refusals() -> None:
    with pytest.raises(SceneError, match=r"effects\.motor: .* cannot be held"):
        solutions_of(load_scene("weak-motor"))
    with pytest.raises(InputError, match="spindle stands still"):
        solutions_of(plane(start={"speed": 0.0}))
    with pytest.raises(InputError, match=f"{', '.join(STARTS)}; did you mean 'set"):
        solutions_of(plane(), 70.0, "setled")


@pytest.mark.parametrize("speed", [math.nan, math.inf, 1e9])
def test_speeds_that_cannot_be_held_are_refused_before_the_search(speed: float) -> None:
    with pytest.raises(InputError, match=r"^speed = .*must be a number within"):
        ab_sim.follow_floquet("nsc-case-1", "speed", [300.0, speed])
