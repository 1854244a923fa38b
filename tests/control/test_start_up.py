"""The controller on the package's drive: it balances, says so, and keeps what it promises."""

import itertools
import math
import re
from typing import Any

import pytest

from ab_sim import Drive, InputError, load_scene
from ab_sim.control import SensorFacts, StartUp, State, checked
from ab_sim.drive.controllers import settings_of
from tests.control.course import FINAL, Change, Course, settings

WITHOUT_BALLS = 1.33e-4
"""Whirl of the drive at the final speed [m]."""


@pytest.mark.parametrize("quantity", ["displacement", "acceleration"])
def test_it_balances_where_a_plain_ramp_does_not(quantity: str) -> None:
    told = settings(quantity)
    start_up, course = StartUp(told), Course(told)
    while not start_up.state.over and course.drive.time < 16.0:
        course.on(0.1, start_up)
    assert start_up.state is State.DONE and course.commands[-1] == FINAL
    assert course.free_whirl() < 0.3 * WITHOUT_BALLS
    assert start_up.words.startswith("done: net unbalance")
    plain = Course(told)
    plain.drive.command(FINAL, 200.0)
    run = plain.drive.advance(10000)
    assert math.hypot(run["x"][-1], run["y"][-1]) > 0.5 * WITHOUT_BALLS


def test_what_it_believes_is_true() -> None:
    told = settings(axes=2)
    start_up, course = StartUp(told), Course(told)
    course.on(4.0, start_up)
    estimates, scene = start_up.estimates, course.drive.scene
    off = abs(estimates.critical_speed - 100.0)
    assert off < min(3.0 * estimates.critical_speed_deviation, 0.5)
    run = course.drive.advance(1)
    total = 0.1
    net = (total - sum(scene.balls.masses)) * scene.rotor.eccentricity + 0j
    for i, mass in enumerate(scene.balls.masses):
        angle = float(run[f"ball_{i}_angle"][0])
        net += mass * scene.race.radius * complex(math.cos(angle), math.sin(angle))
    assert abs(estimates.net_unbalance - net / total) < 5e-6


def test_a_filter_that_goes_astray_is_no_fault_of_the_sensor() -> None:
    """In the first dwell q turns within 0.05 s, and one axis takes it for a stiffer suspension."""
    scene = load_scene("adaptive-start-up")
    start_up, drive = StartUp(settings_of(scene)), Drive(scene, commanded=True)
    drive.advance(702)
    doubted = 0.0
    while not start_up.state.over and drive.time < 20.0:
        drive.command(start_up.command(drive.time), 250.0)
        run = drive.advance(5)
        columns = (run[name] for name in ("time", "angle", "speed", "pick_up_1", "pick_up_2"))
        for sample in list(zip(*columns, strict=True))[1:]:
            start_up.sample(*map(float, sample))
        doubted = max(doubted, start_up.observer.doubt)
    assert doubted > 0.0 and start_up.state is State.DONE


def test_commands_keep_the_acceleration_and_lie_below_the_final_speed() -> None:
    told = settings()
    start_up, course = StartUp(told), Course(told, changes=["effects.viscous_drag.coefficient=2"])
    course.on(8.0, start_up)
    start_up.abort(8.0, "the user asked")
    course.on(1.5, start_up)
    steps = [abs(b - a) for a, b in itertools.pairwise(course.commands)]
    assert max(steps) <= told.acceleration * told.period * (1 + 1e-12)
    assert 0.0 <= min(course.commands) and max(course.commands) <= FINAL
    assert start_up.state is State.ABORTED and start_up.words.startswith("aborted: the user asked")


def test_later_dwells_try_four_distances_in_turn() -> None:
    """The largest lag is 1, 1.25, 0.75 and 1.5, and 1 again in the fifth dwell after the first."""
    start_up = StartUp(settings())
    seen = start_up.observer
    seen.known, seen.critical, seen.damping, seen.scale = 1.0, 100.0, 15.0, 1.0
    for retries, lag in zip(range(1, 9), (1.0, 1.25, 0.75, 1.5) * 2, strict=True):
        numbers, own = start_up.state_numbers(), -len(seen.numbers())
        start_up.restore((*numbers[: own - 1], float(retries), *numbers[own:]))
        assert start_up.retries == retries
        assert start_up.dwell_speed() == pytest.approx(
            100.0 * math.sqrt(1.0 + 0.15 / lag), rel=1e-12
        )


def test_each_decision_comes_once() -> None:
    told = settings()
    start_up, course = StartUp(told), Course(told)
    heard: list[str] = []
    for _ in range(1500):
        course.on(told.period, start_up)
        if start_up.decision.number > len(heard):
            heard.append(start_up.decision.text)
    assert start_up.decision.number == len(heard)
    words = [text.partition(":")[0] for text in heard]
    assert words[:4] == ["run up", "dwell", "to final", "judging"]
    assert re.search(r"critical speed \d+\.\d \+- \d+\.\d rad/s", heard[1])


def test_it_goes_on_from_its_numbers() -> None:
    told = settings()
    start_up, course = StartUp(told), Course(told)
    course.on(1.2, start_up)
    other = StartUp(told)
    other.restore(start_up.state_numbers())
    assert other.words == start_up.words
    assert other.decision.number == start_up.decision.number
    course.on(2.0, start_up, other)
    assert other.state_numbers() == start_up.state_numbers()
    with pytest.raises(ValueError, match="numbers"):
        other.restore(start_up.state_numbers()[:-1])


def test_a_weak_motor_is_waited_for() -> None:
    motor = "effects.motor={rotor_inertia: 2.9e-5, torque_limit: 1.74e-3, proportional_gain: 1e-3}"
    told = settings()
    start_up, course = StartUp(told), Course(told, changes=[motor])
    course.on(2.5, start_up)
    assert start_up.state is State.DWELL and start_up.estimates.retries == 0
    assert course.drive.advance(1)["speed"][0] == pytest.approx(105.0, abs=20.0)


def test_a_gain_of_the_sensor_does_not_matter() -> None:
    """But for the noise, which is told."""
    told = settings()
    sensing = told.sensing._replace(noise=0.0)
    ones = []

    def amplified(gain: float) -> Change:
        return lambda s: [(*s[:3], gain * s[3], gain * s[4])]

    for gain in (1.0, 1024.0):
        start_up = StartUp(told._replace(sensing=sensing))
        course = Course(told, amplified(gain))
        course.on(3.0, start_up)
        ones.append((course.commands, start_up.estimates))
    # 1e-30 in a denominator is all that has a unit.
    assert ones[0][0] == pytest.approx(ones[1][0], rel=1e-9)
    assert ones[1][1].without_balls == pytest.approx(1024.0 * ones[0][1].without_balls, rel=1e-6)


def test_a_first_sample_at_speed_is_no_start_from_rest() -> None:
    """A firmware that was started again finds the disc turning."""
    told = settings()
    course = Course(told)
    course.drive.command(150.0, 200.0)
    course.drive.advance(1000)
    start_up = StartUp(told)
    course.on(0.05, start_up)
    # The first command comes before the first sample, the second takes the disc over.
    assert course.commands[0] == 0.0 and 148.0 <= course.commands[1] <= 150.0


BAD: dict[str, tuple[Any, ...]] = {
    "final_speed": (math.nan, 0.0, -5.0, 1e9),
    "acceleration": (0.0, math.inf, math.nan),
    "period": (0.0, 1.0, math.nan),
    "most_retries": (-1, 101, 2.5),
    "patience": (-1.0, math.nan),
    "silence": (0.0, math.nan),
    "limit": (0.0, -1.0, math.nan),
}


@pytest.mark.parametrize("field, value", [(f, v) for f, values in BAD.items() for v in values])
def test_a_setting_out_of_range_is_named(field: str, value: Any) -> None:
    with pytest.raises(InputError, match=rf"^{field} = .*: must be "):
        StartUp(settings()._replace(**{field: value}))


@pytest.mark.parametrize(
    "sensing, field",
    [
        (SensorFacts("speed", 1), "sensing.quantity"),  # type: ignore[arg-type]
        (SensorFacts("displacement", 3), "sensing.axes"),
        (SensorFacts("displacement", 1, math.nan), "sensing.axis_angle"),
        (SensorFacts("displacement", 1, 0.0, -1.0), "sensing.noise"),
    ],
)
def test_a_sensor_that_cannot_be_is_named(sensing: SensorFacts, field: str) -> None:
    with pytest.raises(InputError, match=rf"^{re.escape(field)} = .*: must be "):
        checked(settings()._replace(sensing=sensing))
