"""Set-points over time: exact to and from a schedule, refused when they cannot be followed."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ab_msgs_py.set_points import MOST_POINTS, SetPoint, SetPoints
from ab_sim.base.errors import CommandError
from ab_sim.model.spindle import Ramp, SpeedSchedule, SpeedServo
from ab_sim.model.spindle.commands import TimedSpeeds, joined, set_points_of, timed_speeds
from ab_sim.scene import load_scene, scene_names

LIMITS = SpeedServo(400.0, 100.0)
STANDSTILL = SpeedSchedule.constant(0.0)
FREE = SpeedServo(1e9, 1e12)
SECOND = 10**9


def points(*pairs: tuple[float, float], start: int = 0) -> SetPoints:
    """Points from pairs of a time [s] and a speed [rad/s]."""
    return SetPoints(start, tuple(SetPoint(round(time * 1e9), speed) for time, speed in pairs))


def followed(
    wanted: SetPoints, schedule: SpeedSchedule = STANDSTILL, now: float = 0.0
) -> SpeedSchedule:
    timed = timed_speeds(wanted, LIMITS)
    start = round(now * 1e9) if timed.start is None else timed.start
    return joined(schedule, now, timed._replace(start=start), LIMITS.max_acceleration)


def known_beforehand() -> list[str]:
    """Scenes that ship whose profile is made of ramps alone."""
    found = []
    for name in scene_names():
        scene = load_scene(name)
        if not scene.is_controlled and scene.profile is not None:
            segments = SpeedSchedule.of_scene(scene).segments
            if all(isinstance(scheduled.law, Ramp) for scheduled in segments):
                found.append(name)
    return found


@pytest.mark.parametrize("name", known_beforehand())
def test_a_shipped_profile_arrives_to_the_last_bit(name: str) -> None:
    scene = load_scene(name)
    asked = SpeedSchedule.of_scene(scene)
    limits = SpeedServo(scene.spindle.max_speed, scene.spindle.max_acceleration)
    timed = timed_speeds(set_points_of(asked, 0), limits)._replace(start=0)
    held = SpeedSchedule.at_start(scene)
    assert joined(held, 0.0, timed, limits.max_acceleration).segments == asked.segments


speeds = st.floats(-390.0, 390.0)
slopes = st.floats(1.0, 90.0)


@given(st.lists(st.tuples(speeds, slopes), min_size=1, max_size=8))
def test_ramps_to_any_speed_arrive_better_than_nanoseconds(
    legs: list[tuple[float, float]],
) -> None:
    speed, ramps = 0.0, []
    for to, slope in legs:
        slope = math.copysign(slope, to - speed)
        if (duration := (to - speed) / slope) > 1e-6:
            ramps.append((duration, Ramp(speed, slope)))
            speed = to
    asked = SpeedSchedule(ramps, speed)
    timed = timed_speeds(set_points_of(asked, 0), LIMITS)._replace(start=0)
    sent = joined(STANDSTILL, 0.0, timed, 100.0)
    assert sent.breakpoints == pytest.approx(asked.breakpoints, rel=0, abs=1e-12)
    assert [s.law for s in sent.segments] == [s.law for s in asked.segments]


@given(st.lists(st.tuples(st.integers(10**4, 10**10), speeds), min_size=1, max_size=20))
def test_speeds_are_linear_between_points(given_points: list[tuple[int, float]]) -> None:
    times = itertools.accumulate(after for after, _ in given_points)
    wanted = SetPoints(
        0, tuple(SetPoint(t, v) for t, (_, v) in zip(times, given_points, strict=True))
    )
    timed = timed_speeds(wanted, FREE)._replace(start=0)
    schedule = joined(STANDSTILL, 0.0, timed, FREE.max_acceleration)
    for point in wanted.points:
        # Just before each point, where no later one has a part in it.
        assert schedule.speed(point.time / 1e9 * (1 - 1e-12)) == pytest.approx(
            point.speed, rel=1e-6, abs=1e-3
        )
    assert schedule.segments[-1].law == Ramp(wanted.points[-1].speed, 0.0)
    for before, after in itertools.pairwise(schedule.segments):
        assert before.end == after.start
        end = before.law.speed(before.end - before.start)
        assert end == pytest.approx(after.law.speed(0.0), rel=1e-9, abs=1e-6)


def test_a_raised_cosine_becomes_points_on_it() -> None:
    asked = SpeedSchedule.speed_change(50.0, 150.0, 1.0, 2.5)
    wanted = set_points_of(asked, 3 * SECOND)
    assert wanted.start == 3 * SECOND and len(wanted.points) == 1002 < MOST_POINTS
    sent = joined(
        SpeedSchedule.constant(50.0), 3.0, timed_speeds(wanted, LIMITS), LIMITS.max_acceleration
    )
    times = np.linspace(0.0, 4.0, 1001)
    worst = max(abs(sent.speed(3.0 + t) - asked.speed(t)) for t in times.tolist())
    # Straight lines miss a curve by its second derivative times h^2/8.
    assert worst < 0.5 * 100.0 * (math.pi / 1000) ** 2 / 8 * 1.01
    assert sent.angle(7.0) - sent.angle(3.0) == pytest.approx(asked.angle(4.0), abs=1e-4)


def test_until_its_start_the_present_schedule_holds() -> None:
    ramp = LIMITS.approach(0.0, 0.0, 0.0, 200.0, 50.0)
    later = followed(points((0.0, 100.0), (1.0, 20.0), start=2 * SECOND), ramp, now=1.0)
    assert later.speed(1.5) == ramp.speed(1.5) == 75.0
    assert later.speed(2.5) == 60.0 and later.speed(5.0) == 20.0
    assert later.angle(2.0) == ramp.angle(2.0)


@pytest.mark.parametrize("at_once", [True, False])
def test_a_drive_at_another_speed_catches_up(at_once: bool) -> None:
    """From 0 at 100 rad/s^2 to a point of 60 rad/s that rises by 40 rad/s^2: met after 1 s."""
    first = (0.0, 60.0) if at_once else (0.1, 60.0)
    schedule = followed(points(first, (first[0] + 2.0, 140.0)))
    meets = 1.0 if at_once else 56.0 / 60.0  # 100 t = 60 + 40 (t - 0.1)
    assert schedule.segments[0].law == Ramp(0.0, 100.0)
    assert schedule.segments[0].end == pytest.approx(meets)
    for time in (1.2, 1.7, 2.0):
        assert schedule.speed(time) == pytest.approx(60.0 + 40.0 * (time - first[0]))
    slopes = [abs(scheduled.law.slope) for scheduled in schedule.segments]  # type: ignore[union-attr]
    assert max(slopes) == 100.0


def test_a_drive_that_never_meets_it_goes_to_its_last_speed() -> None:
    schedule = followed(points((0.0, 10.0), (0.1, 15.0), (0.2, 380.0 / 40)))
    assert schedule.speed(0.05) == 5.0
    behind = followed(points((0.0, 300.0), (0.5, 350.0)))
    assert behind.speed(3.0) == 300.0 and behind.speed(4.0) == 350.0
    assert behind.end == pytest.approx(3.5)


@pytest.mark.parametrize(
    ("wanted", "key"),
    [
        (points((0.0, math.nan)), r"points\[0\].velocities\[0\] = nan"),
        (points((0.0, 0.0), (1.0, math.inf)), r"points\[1\].velocities\[0\] = inf"),
        (points((0.0, 0.0), (9.0, 400.5)), r"points\[1\].velocities\[0\] = 400.5"),
        (points((0.0, 0.0), (1.0, 101.0)), r"points\[0\]: .* 101 rad/s\^2, and at most 100"),
        (points((1.0, 0.0), (1.0, 1.0)), r"points\[1\].time_from_start = 1 s"),
        (points((2.0, 0.0), (1.0, 1.0)), r"points\[1\].time_from_start = 1 s"),
        (points((-1.0, 0.0)), r"points\[0\].time_from_start = -1 s"),
        (SetPoints(0, (SetPoint(0, 0.0, math.nan),)), r"points\[0\].accelerations\[0\] = nan"),
        (
            SetPoints(0, (SetPoint(0, 0.0, 50.0), SetPoint(SECOND, 40.0, 0.0))),
            r"points\[0\]: 50 rad/s\^2 leads from 0 to 50 rad/s",
        ),
        (
            SetPoints(0, (SetPoint(0, 0.0, 1e308), SetPoint(SECOND, 40.0, 0.0))),
            r"points\[0\]: 1e\+308 rad/s\^2 leads",
        ),
    ],
)
def test_what_cannot_be_followed_is_refused_by_name(wanted: SetPoints, key: str) -> None:
    with pytest.raises(CommandError, match=key):
        timed_speeds(wanted, LIMITS)


def test_what_is_still_ahead() -> None:
    timed = timed_speeds(points((1.0, 0.0), (2.0, 80.0), (4.0, -20.0)), LIMITS)
    assert isinstance(timed, TimedSpeeds) and timed.lasts == 4.0
    assert timed.top_speed() == timed.top_speed(1.5) == 80.0
    assert timed.top_speed(3.0) == pytest.approx(30.0) and timed.top_speed(9.0) == 20.0
    assert (
        timed.steepest(1.5) == 80.0 and timed.steepest(2.5) == 50.0 and timed.steepest(9.0) == 0.0
    )
