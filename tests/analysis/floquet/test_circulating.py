"""Balls that circulate as exact periodic solutions: beside long runs and the closed form."""

import dataclasses

import numpy as np
import pytest

from ab_sim.analysis.circulating import (
    bunches,
    drive_of,
    reach_over_drag,
    reach_over_speed,
    stalled,
)
from ab_sim.analysis.floquet.circulating import (
    BeatMap,
    CirculatingSolution,
    circulating_solution,
    solution_at,
)
from ab_sim.analysis.floquet.circulating_border import circulation_border
from ab_sim.base.errors import SceneError
from ab_sim.scene import Scene, load_scene
from tests.analysis.circulating.runs import AT, mean_speeds, stalling

ONE = {"m": (8e-3,)}
"""A single ball, twice as heavy: its branch ends in a fold, not where balls part."""


def solution(scene: Scene, count: int, speed: float = AT) -> CirculatingSolution:
    numbers = drive_of(scene)
    assert numbers is not None
    bunch = stalled(numbers, speed, count)
    assert bunch is not None
    found = circulating_solution(scene, bunch)
    assert found is not None
    return found


@pytest.mark.parametrize(
    ("count", "speed", "rolls"),
    [
        (6, AT, False),
        (6, AT, True),
        (6, -AT, True),
        (5, AT, True),
        (4, AT, False),
        (6, 600.0, True),
    ],
)
def test_its_speed_is_that_of_a_long_run(count: int, speed: float, rolls: bool) -> None:
    scene = stalling(rolls=rolls)
    numbers = drive_of(scene)
    assert numbers is not None
    bunch = stalled(numbers, speed, count)
    assert bunch is not None
    found = circulating_solution(scene, bunch)
    assert found is not None and found.stable
    run = mean_speeds(scene, speed, bunch, duration=20.0)[:count]
    assert run == pytest.approx(found.speed, rel=1e-6)
    swing = max(bunch.bunch_swing, bunch.resting_swing)
    assert found.speed == pytest.approx(bunch.speed, rel=0.1 * swing**2)


def test_a_bunch_parts_as_the_closed_form_says() -> None:
    """Five pairs of multipliers, of modulus exp(-c_b T/(2 mu)): parting is damped by drag alone."""
    found = solution(stalling(), 6)
    moduli = np.abs(found.multipliers)
    expected = np.exp(-0.05 * found.period / (2.0 * 4e-3))
    assert (np.abs(moduli - expected) < 1e-9).sum() >= 10
    assert found.largest == pytest.approx(expected, rel=1e-9)


def test_a_run_from_it_is_periodic_and_halved_steps_change_nothing() -> None:
    scene, found = stalling(rolls=True), solution(stalling(rolls=True), 6)
    beat = BeatMap(scene, AT, 6)
    fine = beat.turn.over(found.states[0], found.period, 4 * (len(found.states) - 1), columns=0)
    assert np.abs(beat.gap(fine.states) / beat.turn.scale).max() < 1e-8
    least, most = found.whirl
    assert 0.8 * most < least < most
    assert found.report()["stable"] is True


def test_the_middle_branch_is_unstable() -> None:
    scene = stalling(**ONE)
    numbers = drive_of(scene)
    assert numbers is not None
    low = solution(scene, 1)
    middle = circulating_solution(scene, bunches(numbers, AT, 1)[1])
    assert low.stable and middle is not None
    assert middle.stable is False and middle.speed > low.speed


def test_over_the_bunchs_speed_the_spindles_follows() -> None:
    scene = stalling(**ONE)
    one = solution(scene, 1)
    other = solution_at(lambda w: (scene, w), one, 320.0)
    assert other is not None and other.speed == pytest.approx(320.0, rel=1e-14)
    same = solution(scene, 1, other.spindle_speed)
    assert same.speed == pytest.approx(320.0, rel=1e-9)


@pytest.mark.parametrize(("changes", "fold"), [({}, False), (ONE, True)])
def test_the_highest_speed(changes: dict[str, tuple[float, ...]], fold: bool) -> None:
    """Within 0.1 % the closed form's, and long runs on either side agree."""
    scene = stalling(**changes)
    numbers = drive_of(scene)
    assert numbers is not None
    (reach,) = reach_over_speed(numbers, numbers.balls)
    start = solution(scene, numbers.balls)
    border = circulation_border(lambda w: (scene, w), start)
    assert border is not None and border.fold is fold
    assert border.value == border.spindle_speed == pytest.approx(reach.high, rel=1e-3)
    inside = solution_at(lambda w: (scene, w), start, 0.99 * border.speed)
    assert inside is not None and 0.94 * border.value < inside.value < border.value
    for speed, stays in ((inside.value, True), (1.0025 * border.value, False)):
        run = mean_speeds(scene, speed, inside.states[0], duration=20.0, off=1e-4)
        assert (np.abs(run - border.speed) < 0.03 * border.speed).all() == stays


def test_the_largest_drag() -> None:
    scene = stalling(**ONE)
    numbers = drive_of(scene)
    assert numbers is not None
    start = dataclasses.replace(solution(scene, 1), value=0.05)
    border = circulation_border(lambda drag: (stalling(**ONE, cb=drag), AT), start)
    (reach,) = reach_over_drag(numbers, AT, 1)
    assert border is not None and border.fold
    assert border.value == pytest.approx(reach.high, rel=1e-3)


def test_what_has_no_beat_map() -> None:
    with pytest.raises(SceneError, match=r"not looked for: .*ball_contact"):
        BeatMap(load_scene("packed-balls"), 300.0, 1)
    with pytest.raises(SceneError, match="rolling_friction"):
        BeatMap(load_scene("thesis-hold"), 300.0, 1)
    found = solution(stalling(), 6)
    with pytest.raises(ValueError, match="must be stable"):
        circulation_border(
            lambda w: (stalling(), w), dataclasses.replace(found, monodromy=2 * np.eye(16))
        )
