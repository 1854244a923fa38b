"""Speed profiles: exact values, breakpoints, and consistency of angle, speed and acceleration."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ab_sim.base.errors import SceneError
from ab_sim.model.spindle import RaisedCosine, Ramp, SpeedSchedule, top_speed_of
from ab_sim.model.spindle.schedule import RampAndCosine
from ab_sim.scene import load_scene

Segment = Ramp | RaisedCosine | RampAndCosine


def test_hold_of_the_thesis() -> None:
    profile = SpeedSchedule.of_scene(load_scene("thesis-hold"))
    assert profile.variable_speed_period == 2.5
    assert profile.breakpoints == (2.5, 3.0, 5.5)
    assert [profile.speed(t) for t in (0, 1, 2.5, 2.75, 3.0, 4.0, 5.5, 9.0)] == [
        0, 40, 100, 100, 100, 140, 200, 200,
    ]  # fmt: skip
    assert profile.angle(2.5) == 125.0
    assert profile.angle(3.0) == 175.0
    assert profile.angle(5.5) == 175.0 + 2.5 * 150.0


def test_period_by_time_and_by_speed_are_the_same() -> None:
    by_speed = load_scene("thesis-hold")
    period = "profile.variable_speed_period."
    by_time = load_scene("thesis-hold", [f"{period}start_speed=", f"{period}start_time=2.5"])
    for t in np.linspace(0, 7, 50):
        one, other = (SpeedSchedule.of_scene(s).speed(t) for s in (by_speed, by_time))
        assert one == pytest.approx(other, rel=1e-15)


def test_deceleration_in_the_period() -> None:
    profile = SpeedSchedule.start_up(0.0, 40.0, 200.0, period=(100.0, 0.5, -20.0))
    assert profile.speed(3.0) == 90.0
    assert profile.speed(profile.end) == 200.0


def test_acceleration_jumps_take_the_right_hand_limit() -> None:
    profile = SpeedSchedule.start_up(0.0, 40.0, 200.0, period=(100.0, 0.5, 0.0))
    assert profile.segment_at(2.5).law.acceleration(0.0) == 0.0
    assert profile.segment_at(math.nextafter(2.5, 0)).law.acceleration(2.5) == 40.0


def test_period_that_begins_at_once() -> None:
    profile = SpeedSchedule.start_up(0.0, 40.0, 200.0, period=(0.0, 0.5, 20.0))
    assert profile.speed(0.25) == 5.0
    assert profile.speed(0.5) == 10.0


def test_raised_cosine_of_the_relative_stability_report() -> None:
    """(25): 1000 - w_c (0.5 sin(pi (t - t_b)/t_r - pi/2) + 0.5) within the change."""
    profile = SpeedSchedule.speed_change(1000.0, 900.0, start_time=10.0, duration=0.11)
    for t in np.linspace(10.0, 10.11, 23):
        printed = 1000 - 100 * (0.5 * math.sin(math.pi * (t - 10) / 0.11 - math.pi / 2) + 0.5)
        assert profile.speed(t) == pytest.approx(printed, rel=1e-12)
    assert profile.speed(9.0) == 1000.0
    assert profile.speed(11.0) == 900.0


@pytest.mark.parametrize(
    ("first", "breakpoints", "speeds", "period"),
    [
        (200.0, [], {0.0: 200.0, 9.0: 200.0}, None),
        (240.0, [1.0], {0.5: 220.0, 1.0: 200.0, 9.0: 200.0}, None),
        (150.0, [1.25], {1.0: 190.0, 1.25: 200.0}, None),
        (100.0, [0.5, 3.0], {0.25: 100.0, 0.5: 100.0, 3.0: 200.0}, 0.0),
        (80.0, [0.5, 1.0, 3.5], {0.5: 100.0, 1.0: 100.0, 3.5: 200.0}, 0.5),
        (-40.0, [3.5, 4.0, 6.5], {1.0: 0.0, 3.5: 100.0, 6.5: 200.0}, 3.5),
    ],
)
def test_a_start_up_goes_on_from_any_speed(
    first: float, breakpoints: list[float], speeds: dict[float, float], period: float | None
) -> None:
    """At the target it holds, above it slows down; a period that lies behind is left out."""
    profile = SpeedSchedule.of_scene(load_scene("thesis-hold", [f"start.speed={first}"]))
    assert [t for t in profile.breakpoints if t > 0] == breakpoints
    assert {t: profile.speed(t) for t in speeds} == speeds
    assert profile.variable_speed_period == period


def test_a_period_by_time_is_left_out_at_the_target() -> None:
    period = "profile.variable_speed_period."
    by_time = [f"{period}start_speed=", f"{period}start_time=2.5"]
    profile = SpeedSchedule.of_scene(load_scene("thesis-hold", [*by_time, "start.speed=200"]))
    assert profile.variable_speed_period is None and profile.end == 0.0
    with pytest.raises(SceneError, match="start_time = 2.5 s: .* from 250 to 250"):
        load_scene("thesis-hold", [*by_time, "start.speed=150"])


def test_a_period_that_slows_down_may_end_below_the_speed_at_the_start() -> None:
    slower = "profile.variable_speed_period.acceleration=-20"
    profile = SpeedSchedule.of_scene(load_scene("thesis-hold", [slower, "start.speed=96"]))
    assert [profile.speed(t) for t in (0.0, 0.1, 0.6)] == [96.0, 100.0, 90.0]


START_UP = {"kind": "start_up", "acceleration": 40.0, "target_speed": 200.0}
PROFILES: dict[str, Any] = {
    "no profile": None,
    "start_up": START_UP,
    "speed_change": {"kind": "speed_change", "start_time": 1.0, "duration": 0.5, "to_speed": 50.0},
}


@pytest.mark.parametrize("profile", PROFILES.values(), ids=list(PROFILES))
def test_the_start_angle_is_added_to_every_angle(scene: Any, profile: Any) -> None:
    plain, turned = (
        SpeedSchedule.of_scene(scene(start={"speed": 10.0, "angle": angle}, profile=profile))
        for angle in (0.0, -0.75)
    )
    assert turned.angle(0.0) == -0.75
    for t in (0.3, 1.2, 2.0, 9.0):
        assert turned.angle(t) == pytest.approx(plain.angle(t) - 0.75, rel=1e-14)
        assert turned.speed(t) == plain.speed(t)


SEGMENTS = [Ramp(7.0, -3.0), RaisedCosine(7.0, -3.0, 2.0), RampAndCosine(7.0, 2.0, -3.0, 1.6)]


@pytest.mark.parametrize("segment", SEGMENTS)
def test_segments_are_their_own_integrals(segment: Segment) -> None:
    t = np.linspace(0.0, 2.0, 4001)
    assert segment.speed(0.0) == 7.0 and segment.angle(0.0) == 0.0
    h = t[1] - t[0]
    for whole, rate in (("angle", "speed"), ("speed", "acceleration")):
        values = getattr(segment, whole)(t)
        slope = np.broadcast_to(getattr(segment, rate)(t), t.shape)
        np.testing.assert_allclose(np.gradient(values, h)[1:-1], slope[1:-1], atol=1e-5)


@pytest.mark.parametrize("segment", SEGMENTS[:2])
def test_side_by_side_a_segment_is_a_sum_of_which_one_part_is_nothing(segment: Any) -> None:
    t, both = np.linspace(0.0, 2.0, 21), RampAndCosine.of(segment)
    for name in ("speed", "angle", "acceleration"):
        want = np.broadcast_to(getattr(segment, name)(t), t.shape)
        np.testing.assert_allclose(getattr(both, name)(t), want, rtol=1e-15, atol=1e-15)


def test_a_raised_cosine_is_steepest_half_way() -> None:
    profile = SpeedSchedule.speed_change(100.0, -300.0, start_time=1.0, duration=0.5)
    assert profile.steepest == pytest.approx(400.0 / 2 * math.pi / 0.5)
    assert profile.top_speed == 300.0 and profile.end == 1.5
    assert profile.angle(1.5) == pytest.approx(100.0 + 0.5 * -100.0)
    assert SpeedSchedule.constant(-70.0).top_speed == 70.0
    held = SpeedSchedule.constant(-70.0)
    assert held.steepest == 0.0 and held.angle(2.0) == -140.0


def test_a_profile_may_begin_later_and_further_round() -> None:
    plain = SpeedSchedule.start_up(10.0, 40.0, 200.0, period=(100.0, 0.5, -20.0))
    moved = plain.moved(3.0, 0.25)
    for t in (0.0, 1.0, 2.25, 2.5, 2.6, 4.0, 9.0):
        assert moved.speed(t + 3.0) == pytest.approx(plain.speed(t), rel=1e-14)
        assert moved.angle(t + 3.0) == pytest.approx(plain.angle(t) + 0.25, rel=1e-14)
    assert moved.breakpoints == tuple(t + 3.0 for t in plain.breakpoints)
    assert (plain.variable_speed_period, moved.variable_speed_period) == (2.25, 5.25)
    assert SpeedSchedule.constant(5.0).moved(1.0).variable_speed_period is None
    assert moved.angle(3.0) == 0.25 and plain.moved(3.0).angle(3.0) == 0.0


def test_before_its_beginning_a_profile_is_its_first_piece() -> None:
    profile = SpeedSchedule.start_up(10.0, 40.0, 200.0)
    assert profile.number_at(-1.0) == 0 and profile.speed(-0.25) == 0.0
    assert [profile.number_at(t) for t in (0.0, 4.75, math.nextafter(4.75, 0.0))] == [0, 1, 0]


def test_the_top_speed_of_conditions_is_that_of_lasting_as_long_as_they_may(scene: Any) -> None:
    assert top_speed_of(scene(start={"speed": -90.0}, profile=None)) == 90.0
    assert top_speed_of(scene(profile={**START_UP, "target_speed": 170.0})) == 170.0


@given(
    st.floats(0.0, 50.0),
    st.floats(1.0, 500.0),
    st.floats(60.0, 500.0),
    st.floats(0.0, 1.0),
    st.floats(0.01, 3.0),
)
def test_speed_and_angle_are_continuous(
    first: float, slope: float, target: float, where: float, duration: float
) -> None:
    at = first + where * (target - first) * 0.9
    profile = SpeedSchedule.start_up(first, slope, target, period=(at, duration, 0.0))
    for t in profile.breakpoints:
        before, after = profile.segment_at(math.nextafter(t, -1.0)), profile.segment_at(t)
        local = t - before.start
        assert before.law.speed(local) == pytest.approx(after.law.speed(0.0), rel=1e-9)
        angle = before.start_angle + before.law.angle(local)
        assert angle == pytest.approx(after.start_angle, rel=1e-9, abs=1e-9)
