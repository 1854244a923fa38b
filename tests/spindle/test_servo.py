"""The servo: goes to a command within its acceleration, and refuses what it must."""

import math
import re

import pytest

from ab_sim.base.errors import CommandError
from ab_sim.model.spindle import SpeedServo

SERVO = SpeedServo(max_speed=200.0, max_acceleration=50.0)


@pytest.mark.parametrize(("speed", "command"), [(0, 100), (100, 20), (-50, 150), (30, -200)])
def test_goes_there_at_its_acceleration_and_stays(speed: float, command: float) -> None:
    profile = SERVO.approach(3.0, 7.0, speed, command, SERVO.max_acceleration)
    assert profile.speed(3.0) == speed
    assert profile.angle(3.0) == 7.0
    assert profile.end == pytest.approx(3.0 + abs(command - speed) / 50.0)
    assert profile.speed(profile.end) == command
    assert profile.speed(1e6) == command
    assert abs(profile.segment_at(3.0).law.acceleration(0.0)) == 50.0


def test_command_of_the_present_speed_is_a_hold() -> None:
    profile = SERVO.approach(3.0, 7.0, 100.0, 100.0, SERVO.max_acceleration)
    assert profile.breakpoints == ()
    assert profile.speed(4.0) == 100.0


@pytest.mark.parametrize("change", [0.1, -0.1, 1e-3, -1e-9])
def test_a_change_of_milliseconds_takes_its_time_too(change: float) -> None:
    profile = SERVO.approach(3.0, 7.0, 100.0, 100.0 + change, SERVO.max_acceleration)
    takes = abs(change) / SERVO.max_acceleration
    assert profile.end - 3.0 == pytest.approx(takes, rel=1e-5, abs=1e-15)
    assert profile.speed(3.0 + takes / 2) == pytest.approx(100.0 + change / 2, abs=1e-13)


@pytest.mark.parametrize("command", [math.nan, math.inf, -math.inf, 200.1, -1e300])
def test_refuses(command: float) -> None:
    with pytest.raises(CommandError, match=f"^command = {re.escape(str(command))} rad/s: "):
        SERVO.check(command)


def test_a_command_just_beyond_the_limit_does_not_read_like_it() -> None:
    with pytest.raises(CommandError, match=r"command = 200\.00000000000003 .* within \+-200 rad"):
        SERVO.check(math.nextafter(200.0, math.inf))


def test_an_int_beyond_all_floats_is_beyond_the_limits() -> None:
    for large, said in ((10**400, "1.00000e+400"), (-(10**5000), "-1.00000e+5000")):
        with pytest.raises(CommandError, match=rf"command = {re.escape(said)} rad/s: .*within"):
            SERVO.check(large)
        with pytest.raises(CommandError, match=rf"acceleration = {re.escape(said)} rad/s.*at most"):
            SERVO.check_acceleration(large)


def test_an_acceleration_that_is_no_number_is_refused() -> None:
    with pytest.raises(CommandError, match=r"acceleration = 'fast': .* \[rad/s\^2\]"):
        SERVO.check_acceleration("fast")  # type: ignore[arg-type]


def test_the_limit_itself_is_allowed() -> None:
    assert SERVO.check(200.0) == 200.0
    assert SERVO.check(-200.0) == -200.0


@pytest.mark.parametrize("acceleration", [0.0, -1.0, 50.000001, math.inf, math.nan])
def test_an_acceleration_that_the_spindle_cannot_do_is_refused(acceleration: float) -> None:
    with pytest.raises(CommandError, match=r"at most 50 rad/s\^2"):
        SERVO.check_acceleration(acceleration)


@pytest.mark.parametrize("acceleration", [1e-300, 0.5, 50.0])
def test_any_smaller_acceleration_will_do(acceleration: float) -> None:
    assert SERVO.check_acceleration(acceleration) == acceleration


@pytest.mark.parametrize("command", ["fast", None, [1.0]])
def test_what_is_no_number_is_refused(command: object) -> None:
    with pytest.raises(CommandError, match=r"a number \[rad/s\]"):
        SERVO.check(command)  # type: ignore[arg-type]
