"""Sensors and spindles that fail: an abort that says why, or a safe start-up."""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest

from ab_sim.control import StartUp, State
from ab_sim.control.chosen import LONGEST_GAP, UNIT
from ab_sim.control.observer import Observer, Reason
from tests.control.course import FINAL, Course, Sample, settings


def put(sample: Sample, **new: float) -> list[Sample]:
    """With other numbers."""
    names = ("time", "angle", "speed", "x", "y")
    return [tuple(new.get(name, value) for name, value in zip(names, sample, strict=True))]


def clip(value: float, most: float) -> float:
    return min(max(value, -most), most)


ABORTS: dict[str, tuple[int, Any, str]] = {
    "drops out": (1, lambda s: [s] if s[0] < 1.0 else [], "no valid sample"),
    "is not a number": (1, lambda s: put(s, x=s[3] if s[0] < 1.0 else math.nan), "no valid sample"),
    "is infinite": (1, lambda s: put(s, x=s[3] if s[0] < 1.0 else math.inf), "no valid sample"),
    "is reset": (1, lambda s: put(s, time=s[0] % 1.0), "time went back"),
    "is dead": (1, lambda s: put(s, x=0.0), "sensor repeats one reading"),
    "is stuck": (1, lambda s: put(s, x=s[3] if s[0] < 0.6 else 1e-2), "sensor repeats one reading"),
    "saturates": (1, lambda s: put(s, x=clip(s[3], 3e-4)), "sensor repeats one reading"),
    "drifts": (1, lambda s: put(s, x=s[3] + 1e-3 * s[0]), "offset drifts"),
    "has a wrong sign": (2, lambda s: put(s, y=-s[4]), "wrong sign"),
    "is swapped": (2, lambda s: put(s, x=s[4], y=s[3]), "contradict each other"),
    "reads one axis twice": (2, lambda s: put(s, y=s[3] * 1.001), "contradict each other"),
    "has one dead axis": (2, lambda s: put(s, y=1e-9 * math.sin(1e4 * s[0])), "contradict"),
    "counts backwards": (1, lambda s: put(s, angle=-s[1]), "angle contradicts its speed"),
    "counts nothing": (1, lambda s: put(s, angle=0.0), "angle contradicts its speed"),
}


@pytest.mark.parametrize("fault", ABORTS)
def test_it_runs_down_and_says_why(fault: str) -> None:
    axes, change, why = ABORTS[fault]
    told = settings(axes=axes)
    start_up, course = StartUp(told), Course(told, change)
    while start_up.state is not State.ABORTED and course.drive.time < 8.0:
        course.on(0.1, start_up)
    assert start_up.state is State.ABORTED and course.commands[-1] == 0.0
    assert why in start_up.words


def every(count: int) -> Any:
    return lambda s: [s] if round(1e3 * s[0]) % count == 0 else []


DRAW = np.random.default_rng(0)
FIRST_DRAW = DRAW.bit_generator.state
SAFE: dict[str, tuple[int, Any]] = {
    "loses three of ten": (1, lambda s: [s] if DRAW.random() > 0.3 else []),
    "pauses": (1, lambda s: [] if 0.8 < s[0] < 1.2 else [s]),
    "says all twice": (1, lambda s: [s, s]),
    "is out of order": (1, lambda s: [s, *put(s, time=s[0] - 0.002)]),
    "has spikes": (1, lambda s: put(s, x=s[3] if DRAW.random() > 0.01 else 1.0)),
    "has impossible spikes": (1, lambda s: put(s, x=s[3] if DRAW.random() > 0.01 else 1e300)),
    "drifts a little": (1, lambda s: put(s, x=s[3] + 1e-4 * s[0])),
    "has an offset": (1, lambda s: put(s, x=s[3] + 9.81)),
    "is slow": (1, every(10)),
    "has a wrong sign on all axes": (2, lambda s: put(s, x=-s[3], y=-s[4])),
    "is turned by 90 degrees": (2, lambda s: put(s, x=s[4], y=-s[3])),
    "counts in turns": (1, lambda s: put(s, angle=s[1] % 6.283185307179586)),
}


@pytest.mark.parametrize("oddity", SAFE)
def test_it_balances_all_the_same(oddity: str) -> None:
    DRAW.bit_generator.state = FIRST_DRAW  # the same draws in any order of the tests
    axes, change = SAFE[oddity]
    told = settings(axes=axes)
    start_up, course = StartUp(told), Course(told, change)
    while not start_up.state.over and course.drive.time < 16.0:
        course.on(0.1, start_up)
    assert start_up.state is State.DONE and course.commands[-1] == FINAL
    # Without a hold it is 0.6; spikes and gaps blur what is small.
    assert course.free_whirl() < 0.4 * 1.33e-4


def test_noise_alone_makes_a_plain_start_up() -> None:
    told = settings()
    draw = np.random.default_rng(1)
    change = lambda s: put(s, x=1.3e-6 * draw.normal())  # noqa: E731
    start_up, course = StartUp(told), Course(told, change)
    course.on(9.5, start_up)
    assert start_up.state is State.GAVE_UP and course.commands[-1] == FINAL
    assert start_up.estimates.dwells == 0


def test_a_reading_beyond_the_limit() -> None:
    told = settings(limit=8e-4)
    start_up, course = StartUp(told), Course(told)
    course.on(2.0, start_up)
    assert start_up.state in (State.ABORTING, State.ABORTED) and "limit" in start_up.words


def test_a_spindle_that_is_caught() -> None:
    motor = "effects.motor={rotor_inertia: 2.9e-5, torque_limit: 1e-4, proportional_gain: 1e-3}"
    told = settings()
    start_up, course = StartUp(told), Course(told, changes=[motor, "rotor.eccentricity=3e-4"])
    while not start_up.state.over and course.drive.time < 60.0:
        course.on(0.5, start_up)
    assert "does not follow" in start_up.words and course.commands[-1] == 0.0


def test_a_drive_that_was_reset_is_not_set_going() -> None:
    told = settings()
    start_up, course = StartUp(told), Course(told)
    course.on(1.0, start_up)
    start_up.sample(0.0, 0.0, 0.0, 0.0)
    assert "time went back" in start_up.words
    assert start_up.command(1.0) == 0.0
    assert start_up.words.startswith("aborted")


def done() -> tuple[StartUp, float]:
    """Return a start-up that is done, and the time then [s]."""
    told = settings()
    start_up, course = StartUp(told), Course(told)
    while start_up.state is not State.DONE and course.drive.time < 16.0:
        course.on(0.1, start_up)
    assert start_up.state is State.DONE
    return start_up, course.drive.time


def test_a_drive_that_dies_after_the_end_is_noticed() -> None:
    start_up, now = done()
    told = start_up.settings
    for _ in range(round(told.silence / told.period) + 2):
        now += told.period
        start_up.command(now)
    assert start_up.words.startswith("aborting: no valid sample for too long")
    for _ in range(round(FINAL / told.acceleration / told.period) + 1):
        now += told.period
        start_up.command(now)
    assert start_up.state is State.ABORTED and start_up.command(now) == 0.0


def test_a_drive_that_is_reset_after_the_end_is_not_set_going() -> None:
    start_up, now = done()
    start_up.sample(0.0, 0.0, 0.0, 0.0)
    assert "time went back" in start_up.words
    assert start_up.command(now) == 0.0


def test_times_of_the_caller_may_be_anything() -> None:
    told = settings()
    start_up = StartUp(told)
    times: Iterable[float] = (0.0, math.nan, -5.0, 1e300, math.inf, 0.01, 0.01)
    for i, time in enumerate(times):
        start_up.sample(1e-3 * i, 0.0, 0.0, 1e-6 * (-1) ** i)
        assert start_up.command(time) <= told.acceleration * told.period * (i + 1)
    assert math.isfinite(start_up.state_numbers()[5])


@pytest.mark.parametrize("axes", [1, 2])
def test_after_a_long_gap_the_motion_is_found_again(axes: int) -> None:
    """Of all axes: what they predicted before says nothing of the motion after."""
    told = settings(axes=axes)
    heard: list[Sample] = []

    def hear(sample: Sample) -> Iterable[Sample]:
        heard.append(sample)
        yield sample

    course = Course(told, hear)
    course.on(2.0, StartUp(told))
    observer = Observer(told)
    for sample in heard:
        observer.take(*sample)
    assert observer.known == 1.0
    gap = LONGEST_GAP * UNIT / FINAL
    for factor, known in ((0.9, 1.0), (1.1, 0.0)):
        other = Observer(told)
        other.restore(observer.numbers())
        time, angle, speed, *readings = heard[-1]
        later = factor * gap
        good, reason = other.take(
            time + later, angle + speed * later, speed, readings[0] + 1e-6, readings[1] + 1e-6
        )
        assert (good, reason) == (True, Reason.NONE)
        assert other.known == known
