"""Commands on their way to the spindle: limits, bus, watchdog, emergency stop; counted in steps."""

import math
from typing import Any

import pytest

from ab_sim.errors import InputError
from ab_sim.nodes.command_path import CommandPath, Rules, SpeedOrder, WatchdogAction
from ab_sim.spindle import SpeedServo

SCENE_LIMITS = SpeedServo(400.0, 100.0)
STEP = 1e-3


def path(seed: int = 0, **rules: object) -> CommandPath:
    return CommandPath(SCENE_LIMITS, STEP, Rules(**rules), seed)  # type: ignore[arg-type]


def told(p: CommandPath, now: int, speed: float = 77.0) -> SpeedOrder | None:
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
    "change", [{"bus": [[3]]}, {"told": [1.0]}, {"draws": "x"}, {"draws": 2**63}, None]
)
def test_what_was_not_kept_is_refused_and_changes_nothing(change: dict[str, object] | None) -> None:
    p = path()
    p.receive(200.0, 0)
    before = p.state()
    with pytest.raises(InputError, match="no state of a path of commands"):
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
        {"told": [1.0]},
        {"told": 3},
    ],
)
def test_what_no_path_has_kept_is_refused(change: dict[str, Any]) -> None:
    p = path()
    p.receive(9.0, 0)
    kept = p.state()
    with pytest.raises(InputError, match="no state of a path of commands"):
        p.restore(kept | change)
    assert p.state() == kept


def test_jitter_is_the_seeds() -> None:
    def run(seed: int) -> list[SpeedOrder | None]:
        p = path(seed, jitter=0.02)
        p.receive(9.0, 0)
        return [told(p, now) for now in range(30)]

    assert run(1) == run(1) != run(2)
