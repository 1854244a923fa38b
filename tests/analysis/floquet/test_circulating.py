"""Balls that circulate as exact periodic solutions: beside long runs and the closed form."""

import dataclasses

import numpy as np
import pytest

from ab_sim.analysis.circulating import (
    bunches,
    drag_ranges,
    drive_of,
    speed_ranges,
    stalled,
)
from ab_sim.analysis.floquet.circulating import (
    BeatMap,
    CirculatingSolution,
    circulating_solution,
)
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
    steps = 4 * (len(found.states) - 1)
    fine = beat.turn.integrate(found.states[0], found.period, steps, columns=0)
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


@pytest.mark.parametrize("changes", [{}, ONE])
def test_the_highest_speed(changes: dict[str, tuple[float, ...]]) -> None:
    """The exact motion is stable up to the closed form's limit within 0.1 %, and not beyond."""
    scene = stalling(**changes)
    numbers = drive_of(scene)
    assert numbers is not None
    (reach,) = speed_ranges(numbers, numbers.balls)
    last = stalled(numbers, 0.999 * reach.high, numbers.balls)
    assert last is not None
    for share, lasts in ((0.999, True), (1.001, False)):
        guess = dataclasses.replace(last, spindle_speed=share * reach.high)
        found = circulating_solution(scene, guess)
        assert (found is not None and found.stable is True) is lasts


def test_the_largest_drag() -> None:
    """The exact motion has its fold within 0.1 % of the closed form's: none is near beyond it."""
    numbers = drive_of(stalling(**ONE))
    assert numbers is not None
    (reach,) = drag_ranges(numbers, AT, 1)
    guess = stalled(numbers._replace(drag=0.999 * reach.high), AT, 1)
    assert guess is not None
    for share, lasts in ((0.999, True), (1.001, False)):
        found = circulating_solution(stalling(**ONE, cb=share * reach.high), guess)
        near = found is not None and abs(found.speed - guess.speed) < 0.03 * guess.speed
        assert near is lasts


def test_what_has_no_beat_map() -> None:
    with pytest.raises(SceneError, match=r"circulating balls: .*ball_contact"):
        BeatMap(load_scene("packed-balls"), 300.0, 1)
    with pytest.raises(SceneError, match="rolling_friction"):
        BeatMap(load_scene("thesis-hold"), 300.0, 1)
