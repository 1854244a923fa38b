"""Commands on their way to the spindle: limits, bus, watchdog, emergency stop; counted in steps."""

import json
import math
from typing import Any

import pytest

from ab_msgs_py.set_points import SetPoint, SetPoints
from ab_sim.base.errors import InputError
from ab_sim.model.spindle import Ramp, SpeedServo
from ab_sim.nodes.command_path import (
    CommandPath,
    Rules,
    SpeedOrder,
    TrajectoryOrder,
    WatchdogAction,
)

SCENE_LIMITS = SpeedServo(400.0, 100.0)
STEP = 1e-3


def path(seed: int = 0, **rules: object) -> CommandPath:
    return CommandPath(SCENE_LIMITS, STEP, Rules(**rules), seed)  # type: ignore[arg-type]


def told(p: CommandPath, now: int, speed: float = 77.0) -> SpeedOrder | TrajectoryOrder | None:
    return p.order(now, lambda: speed)


def test_a_command_is_an_order_once() -> None:
    p = path()
    assert told(p, 0) is None, "nobody has commanded yet"
    p.receive(50.0, 0)
    assert told(p, 0) == (50.0, 100.0)
    p.receive(50.0, 3)
    assert told(p, 3) is None, "nothing new"
    assert p.accepted == 2 and p.age(10) == pytest.approx(7e-3)
    assert p.next(10) == math.inf


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 400.5])
def test_what_may_not_be_followed_changes_nothing(bad: float) -> None:
    p = path()
    p.receive(bad, 0)
    assert told(p, 0) is None
    assert (p.accepted, p.rejected) == (0, 1) and p.age(5) is None


def test_limits_below_the_scenes() -> None:
    p = path(max_speed=100.0, max_acceleration=20.0)
    p.receive(100.5, 0)
    p.receive(100.0, 0)
    assert p.rejected == 1 and told(p, 0) == (100.0, 20.0)
    p.rules = Rules(max_speed=60.0)
    assert told(p, 1) == (60.0, 100.0), "a limit lowered leads down what is in force"
    p.rules = Rules(max_speed=1e9, max_acceleration=1e9)
    assert told(p, 2) == (100.0, 100.0), "the scene's own limit holds as well"


@pytest.mark.parametrize(
    ("silence", "order"),
    [
        (WatchdogAction.HOLD, (77.0, 50.0)),
        (WatchdogAction.COAST, (0.0, 3.0)),
        (WatchdogAction.STOP, (0.0, 100.0)),
    ],
)
def test_watchdog(silence: WatchdogAction, order: tuple[float, float]) -> None:
    p = path(age_limit=0.1, silence=silence, coast=3.0, max_acceleration=50.0)
    assert told(p, 10_000) is None, "it waits for a first command"
    p.receive(200.0, 10_000)
    told(p, 10_000)
    assert p.next(10_000) == 10_100
    assert told(p, 10_099) is None and not p.silent
    assert told(p, 10_100) == order and p.silent and p.silences == 1
    assert told(p, 20_000) is None and p.silences == 1
    p.receive(200.0, 20_000)
    assert told(p, 20_000) == (200.0, 50.0) and not p.silent, "whoever commands again is followed"


def test_an_emergency_stop_outlasts_commands() -> None:
    p = path(max_acceleration=50.0, delay=0.01, age_limit=0.1)
    p.receive(200.0, 0)
    told(p, 10)
    p.receive(210.0, 15)
    p.emergency_stop()
    assert told(p, 16) == (0.0, 100.0), "as fast as the scene's spindle can"
    p.receive(300.0, 20)
    assert (p.dropped, p.ignored, p.received) == (1, 1, 3)
    assert told(p, 500) is None, "neither on the bus nor new, nor the watchdog"
    p.release()
    assert told(p, 600) == (0.0, 50.0) and p.next(600) == math.inf
    p.receive(30.0, 700)
    assert told(p, 710) == (30.0, 50.0)


def test_a_bus_is_slow_and_keeps_the_order() -> None:
    p = path(delay=5e-3, jitter=20e-3)
    for k in range(200):
        p.receive(float(k), k, stamp=k)
    followed: dict[float, int] = {}
    for now in range(300):
        if (order := told(p, now)) is not None:
            assert isinstance(order, SpeedOrder)
            followed[order.speed] = now
    late = [now - speed for speed, now in followed.items()]
    assert min(late) >= 5 and max(late) <= 25 and len(set(late)) > 3
    assert list(followed) == sorted(followed) and p.acted == sorted(set(p.acted))
    assert p.acted[-1] == 199 and len(p.acted) == len(followed), "whom nobody overtook"


def test_a_delay_is_whole_steps_rounded_up() -> None:
    for delay, due in ((0.0, 3), (5e-3, 8), (5.2e-3, 9)):
        p = path(delay=delay)
        p.receive(50.0, 3)
        assert p.state()["bus"] == [[due, 50.0]] and p.state()["draws"] == 0
        assert p.next(3) == max(due, 4), "not before the next step"
        assert p.next(20) == 21, "what is due is due at the next step"
        assert told(p, due - 1) is None and told(p, due) == (50.0, 100.0)


def test_the_first_on_the_bus_is_the_next() -> None:
    p = path(delay=5e-3, jitter=1e-9)
    for now in (0, 3, 4):
        p.receive(50.0 + now, now)
    assert p.next(0) == p.state()["bus"][0][0] < p.state()["bus"][-1][0]
    assert p.state()["draws"] == 3, "one for each"


def test_of_a_command_without_a_stamp_nothing_is_known() -> None:
    """Nor of one that was on the bus when a clock or a state was replaced."""
    p = path(delay=5e-3)
    p.receive(1.0, 0)
    told(p, 5)
    p.receive(2.0, 6, stamp=77)
    p.forget_stamps()
    told(p, 11)
    p.receive(3.0, 12, stamp=78)
    p.restore(p.state())
    told(p, 17)
    assert p.acted == [0, 0, 0]


@pytest.mark.parametrize("limit", [1e-4, 1e-13])
def test_a_watchdog_shorter_than_a_step_acts_at_the_next_one(limit: float) -> None:
    p = path(age_limit=limit)
    p.receive(50.0, 7)
    assert told(p, 7) == (50.0, 100.0) and not p.silent
    assert p.next(7) == 8
    assert told(p, 8) == (77.0, 100.0) and p.silent


def test_all_that_was_heard_is_counted() -> None:
    p = path()
    for speed in (1.0, math.nan, 2.0, 1e9, math.inf):
        p.receive(speed, 0)
    p.emergency_stop()
    p.receive(3.0, 1)
    assert (p.accepted, p.rejected, p.ignored, p.received) == (2, 3, 1, 6)


def test_while_time_stands_still_commands_do_not_pile_up() -> None:
    p = path(delay=5e-3, jitter=5e-3)
    p.receive(1.0, 0)
    for k in range(10_000):
        p.receive(float(k % 300), 7)
    assert p.accepted == 10_001 and len(p.state()["bus"]) <= 7
    assert [order for now in range(30) if (order := told(p, now))][-1] == (9999 % 300, 100.0)


def test_a_watchdog_that_is_set_anew_judges_anew() -> None:
    p = path(age_limit=0.1, silence=WatchdogAction.HOLD)
    p.receive(200.0, 0)
    told(p, 0)
    assert told(p, 100) == (77.0, 100.0) and p.silent
    p.rules = p.rules._replace(max_acceleration=50.0)
    assert told(p, 150) == (77.0, 50.0) and p.silent and p.silences == 1
    p.rules = p.rules._replace(silence=WatchdogAction.STOP)
    assert told(p, 200) == (0.0, 100.0) and p.silent and p.silences == 2
    p.rules = p.rules._replace(age_limit=math.inf)
    assert told(p, 300) == (0.0, 50.0) and not p.silent, "as it was left, and led by commands"
    p.rules = p.rules._replace(age_limit=10.0)
    assert told(p, 400) is None and not p.silent and p.next(400) == 10_000


def test_an_emergency_stop_outlasts_what_is_kept_and_another_scene() -> None:
    p = path()
    p.receive(200.0, 0)
    told(p, 0)
    kept = p.state()
    p.emergency_stop()
    told(p, 1)
    p.restore(kept)
    assert p.stopped and told(p, 2) == (0.0, 100.0)
    p.lead(SpeedServo(300.0, 20.0), STEP)
    assert p.stopped and told(p, 0) == (0.0, 20.0)
    p.reset()
    assert not p.stopped and told(p, 0) is None


@pytest.mark.parametrize(
    "change", [{"bus": [[3]]}, {"last_order": [1.0]}, {"draws": "x"}, {"draws": 2**63}, None]
)
def test_what_was_not_kept_is_refused_and_changes_nothing(change: dict[str, object] | None) -> None:
    p = path()
    p.receive(200.0, 0)
    before = p.state()
    with pytest.raises(InputError, match="a command path"):
        p.restore({} if change is None else {**before, **change})
    assert p.state() == before


def test_jitter_goes_on_where_it_was_however_far_that_is() -> None:
    one, other = path(jitter=0.02), path(jitter=0.02)
    for now in range(5):
        one.receive(9.0 + now, 100 * now)
    other.restore(one.state())
    for each in (one, other):
        each.receive(20.0, 500)
    assert one.state() == other.state()
    other.restore(one.state() | {"draws": 10**18})
    assert other.state()["draws"] == 10**18


@pytest.mark.parametrize(
    "change",
    [
        {"draws": 1e18},
        {"draws": 10**400},
        {"bus": [[math.inf, 1.0]]},
        {"bus": [[3, math.nan]]},
        {"last": "then"},
        {"target": math.inf},
        {"target": [1.0]},
        {"last_order": [1.0]},
        {"last_order": 3},
    ],
)
def test_what_no_path_has_kept_is_refused(change: dict[str, Any]) -> None:
    p = path()
    p.receive(9.0, 0)
    kept = p.state()
    with pytest.raises(InputError, match="a command path"):
        p.restore(kept | change)
    assert p.state() == kept


def test_jitter_is_the_seeds() -> None:
    def run(seed: int) -> list[SpeedOrder | None]:
        p = path(seed, jitter=0.02)
        p.receive(9.0, 0)
        return [told(p, now) for now in range(30)]

    assert run(1) == run(1) != run(2)


SECOND = 10**9
RISE = SetPoints(0, (SetPoint(0, 0.0), SetPoint(SECOND, 80.0)))
"""From standstill to 80 rad/s in 1 s, as soon as it arrives."""


def at(start: int) -> SetPoints:
    """The same from a step on."""
    return RISE._replace(start=start * 10**6)


def refusals(p: CommandPath) -> list[str]:
    return [answer.refusal for answer in p.trajectory_news]


def test_a_trajectory_is_an_order_once() -> None:
    p = path(max_acceleration=90.0)
    p.receive_trajectory(at(300), 5)
    order = told(p, 5)
    assert isinstance(order, TrajectoryOrder) and order.acceleration == 90.0
    assert order.speeds.start == 300 * 10**6 and order.speeds.ramps == ((1.0, Ramp(0.0, 80.0)),)
    assert told(p, 5) is told(p, 400) is None and p.trajectory == order.speeds
    assert (p.accepted, p.rejected) == (1, 0) and p.trajectory_news == [(300 * 10**6, "")]


def test_a_trajectory_without_a_stamp_begins_when_it_leaves_the_bus() -> None:
    p = path(delay=7e-3)
    p.receive_trajectory(RISE, 5)
    assert told(p, 11) is None
    order = told(p, 12)
    assert isinstance(order, TrajectoryOrder) and order.speeds.start == 12 * 10**6


def test_what_is_past_changes_nothing() -> None:
    p = path()
    p.receive(50.0, 0)
    assert told(p, 0) == (50.0, 100.0)
    p.receive_trajectory(at(9), 10)
    p.receive_trajectory(RISE._replace(start=-1), 10)
    assert told(p, 10) is None and p.trajectory is None and p.rejected == 2
    assert all(text.startswith("begins in the past: header.stamp = ") for text in refusals(p))
    slow = path(delay=5e-3)
    slow.receive_trajectory(at(12), 10)
    slow.receive_trajectory(at(15), 10)
    assert [not text for text in refusals(slow)] == [False, True], "the bus takes its time"


def test_beyond_the_limits_changes_nothing() -> None:
    for rules in ({"max_speed": 79.0}, {"max_acceleration": 79.0}):
        p = path(**rules)
        p.receive_trajectory(RISE, 0)
        assert told(p, 0) is None and (p.accepted, p.rejected) == (0, 1) and refusals(p) != [""]
        assert p.rejected_with_report == 1


def test_the_message_that_came_last_leads() -> None:
    p = path()
    p.receive_trajectory(RISE, 0)
    told(p, 0)
    p.receive(30.0, 500)
    assert told(p, 500) == (30.0, 100.0) and p.trajectory is None
    p.receive_trajectory(at(700), 600)
    assert isinstance(told(p, 600), TrajectoryOrder)
    p.receive(30.0, 650)
    assert told(p, 650) == (30.0, 100.0), "also before its start"
    p.receive(35.0, 660)
    p.receive_trajectory(at(900), 660)
    first, second = told(p, 660), told(p, 660)
    assert first == (35.0, 100.0) and isinstance(second, TrajectoryOrder), "both, until its start"
    assert told(p, 660) is None


def test_a_speed_that_a_trajectory_holds_already_changes_nothing() -> None:
    p = path()
    p.receive_trajectory(RISE, 0)
    told(p, 0)
    p.receive(80.0, 999)
    assert told(p, 999) == (80.0, 100.0), "one step before its last point it takes over"
    p.receive_trajectory(at(2000), 1500)
    told(p, 1500)
    p.receive(80.0, 3000)
    assert told(p, 3000) is None and p.trajectory is not None
    p.receive(80.5, 3001)
    assert told(p, 3001) == (80.5, 100.0)


def test_a_trajectory_lives_until_its_last_point() -> None:
    p = path(age_limit=0.1, silence=WatchdogAction.STOP)
    p.receive_trajectory(at(200), 0)
    told(p, 0)
    assert p.age(700) == 0.0 and p.age(1250) == pytest.approx(0.05)
    assert p.next(0) == 1300 and told(p, 1299) is None
    assert told(p, 1300) == (0.0, 100.0) and p.silent and p.trajectory is None
    p.receive_trajectory(at(2000), 1900)
    assert isinstance(told(p, 1900), TrajectoryOrder) and not p.silent


def test_an_emergency_stop_ends_a_trajectory() -> None:
    p = path()
    p.receive_trajectory(RISE, 0)
    told(p, 0)
    p.emergency_stop()
    assert told(p, 500) == (0.0, 100.0) and p.trajectory is None
    p.receive_trajectory(at(900), 600)
    assert told(p, 600) is None and p.ignored == 1 and refusals(p)[-1] == "emergency stop"


def test_a_limit_below_what_is_ahead_holds_the_speed() -> None:
    p = path()
    p.receive_trajectory(RISE, 0)
    told(p, 0)
    p.rules = Rules(max_speed=80.0, max_acceleration=80.0)
    assert told(p, 100) is None, "nothing of it is beyond that"
    p.rules = Rules(max_speed=60.0)
    assert told(p, 500, speed=40.0) == (40.0, 100.0)
    assert "abandoned at 0.5 s: it reaches 80 rad/s, and the limit is now 60" in refusals(p)[-1]
    p.receive_trajectory(RISE._replace(points=(SetPoint(0, 0.0), SetPoint(SECOND, 50.0))), 600)
    told(p, 600)
    p.rules = Rules(max_acceleration=20.0)
    told(p, 700, speed=5.0)
    assert "50 rad/s^2, and the limit is now 20 rad/s^2" in refusals(p)[-1]


def test_many_trajectories_at_once_stay_one() -> None:
    p = path()
    for start in range(100, 200):
        p.receive(1.0, 5)
        p.receive_trajectory(at(start), 5)
    assert len(p.state()["bus"]) == 2


def test_a_trajectory_in_a_snapshot() -> None:
    p, other = path(delay=0.01, age_limit=0.1), path(delay=0.01, age_limit=0.1)
    p.receive_trajectory(at(100), 0)
    told(p, 10)
    p.receive_trajectory(at(300), 15)
    kept = json.loads(json.dumps(p.state()))
    other.restore(kept)
    assert other.state() == p.state() and other.trajectory == p.trajectory
    assert other.next(15) == p.next(15) and told(other, 15) is None
    assert told(other, 25) == told(p, 25) != None  # noqa: E711
    for damage in ("x", [None, [[-1.0, 0.0, 0.0]], 0.0, [0.0, 0.0]], [1.5, [], 0.0, [0.0, 0.0]],
                   [None, [], 0.0, [0.0, 0.0]], [0, [[1e300, 0.0, 0.0]], 0.0, [0.0, 0.0]],
                   [0, [], math.nan, [0.0, 0.0]], [0, [[1.0, 0.0]], 0.0, [0.0, 0.0]]):  # fmt: skip
        with pytest.raises(InputError, match="a command path"):
            other.restore({**kept, "trajectory": damage})


def test_time_that_begins_again_moves_a_trajectory() -> None:
    p = path(age_limit=0.1)
    p.receive_trajectory(RISE, 0)
    told(p, 0)
    p.count_from(400, 0)
    assert p.trajectory is not None and p.trajectory.start == -400 * 10**6
    assert p.next(0) == 700
