"""Pacing with a clock of the test's own: what is due, catching up, giving up."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ab_sim.base.errors import InputError
from ab_sim.nodes.pacing import Pacer, Pacing, Ticker

STEP = 1e-3


def pacer(per_wake: int = 4, budget: int = 40, patience: float = 0.5) -> Pacer:
    made = Pacer(STEP, per_wake, budget, patience)
    made.start(100.0)
    return made


def test_on_time_every_wake_up_has_its_steps() -> None:
    p = pacer()
    for k in range(1, 1000):
        assert p.wait(100.0 + (k - 1) * 4e-3) == pytest.approx(4e-3)
        assert p.due(100.0 + k * 4e-3) == 4
    assert p.total.overruns == p.total.dropped == 0
    assert p.total.worst_lateness < 1e-9


def test_a_little_late_is_no_overrun_and_loses_nothing() -> None:
    p = pacer()
    assert p.due(100.0 + 5.5e-3) == 5
    assert p.due(100.0 + 8e-3) == 3
    assert p.total.overruns == 0
    assert p.total.worst_lateness == pytest.approx(1.5e-3)


def test_missed_wake_ups_are_skipped_but_not_their_steps() -> None:
    p = pacer()
    assert p.due(100.0 + 18e-3) == 18
    assert p.total.overruns == 1
    assert p.wait(100.0 + 18e-3) == pytest.approx(2e-3), "deadlines stay on their grid"


def test_catching_up_keeps_to_the_budget() -> None:
    p = pacer()
    late = 100.0 + 0.1
    assert p.due(late) == 40
    assert p.due(late) == 40
    assert p.due(late) == 20
    assert p.due(late) == 0
    assert p.total.dropped == 0


def test_too_far_behind_is_dropped_and_counted() -> None:
    p = pacer()
    assert p.due(100.0 + 2.0) == 4
    assert p.total.dropped == 1996
    assert p.due(100.0 + 2.004) == 4, "level with the clock again"


def test_a_pause_is_no_lateness() -> None:
    p = pacer()
    assert p.stop(100.0 + 2e-3) == 2, "a last wake-up, before its time"
    p.start(500.0)
    assert p.due(500.0 + 4e-3) == 4
    assert p.total.dropped == p.total.overruns == p.total.worst_lateness == 0


def test_a_pause_erases_no_lost_time() -> None:
    """Stopped for two seconds, and paused before the next wake-up."""
    p = pacer()
    assert p.due(100.0 + 4e-3) == 4
    assert p.stop(100.0 + 2.0) == 4
    p.start(500.0)
    assert p.due(500.0 + 4e-3) == 4
    assert p.total.dropped == 2000 - 8
    assert p.total.overruns == 1
    assert p.total.worst_lateness == pytest.approx(2.0 - 8e-3)


def test_what_a_pause_keeps_from_being_caught_up_with_is_dropped() -> None:
    p = pacer()
    assert p.stop(100.0 + 0.1) == 40
    assert p.total.dropped == 60


def test_what_happens_between_two_wake_ups_loses_no_time() -> None:
    p, taken = pacer(), 0
    for k in range(1, 1001):
        taken += p.early(100.0 + (k - 0.37) * 4e-3) + p.due(100.0 + k * 4e-3)
    assert taken == 4000 and p.total == Pacing()
    assert p.early(100.0 + 4.1) == 40, "no more than at a wake-up"


@pytest.mark.parametrize("factor", [0.3, 1.0, 7.3])
def test_pauses_lose_no_part_of_a_step(factor: float) -> None:
    p, taken, now = pacer(), 0, 0.0
    for k in range(1000):
        p.start(now, factor)
        now += 1e-3 + 1e-6 * k
        taken += p.stop(now)
        now += 0.7
    assert taken == pytest.approx(factor * sum(1e-3 + 1e-6 * k for k in range(1000)) / STEP, abs=1)
    assert p.total.dropped == 0


def test_recent_is_since_it_was_asked_and_total_is_all() -> None:
    p = pacer()
    p.due(100.0 + 2.0)
    assert p.recent().dropped == 1996
    assert p.recent().dropped == 0
    assert p.recent().worst_lateness == 0
    assert p.total.dropped == 1996


@pytest.mark.parametrize("factor", [0.01, 0.3, 1.0, 7.3, 100.0])
def test_time_goes_as_many_times_as_fast(factor: float) -> None:
    p = pacer()
    p.start(100.0, factor)
    taken = sum(p.due(100.0 + k * 4e-3) for k in range(1, 5001))
    assert taken == pytest.approx(20.0 * factor / STEP, abs=1.01)
    assert p.total.dropped == p.total.overruns == 0
    assert p.wait(100.0 + 5000 * 4e-3) == pytest.approx(4e-3), "woken as often as at factor 1"


@pytest.mark.parametrize("factor", [0.1, 10.0])
def test_patience_is_by_the_clock_at_any_factor(factor: float) -> None:
    p = pacer()
    p.start(100.0, factor)
    p.due(100.0 + 0.49)
    assert p.total.dropped == 0
    p.start(100.0)
    taken = p.due(100.0 + 2.0)
    assert taken == max(round(4 * factor), 1)
    assert taken + p.total.dropped == round(2.0 * factor / STEP)


def test_the_start_says_nothing_of_the_usual_lateness() -> None:
    p = pacer()
    p.due(100.0 + 0.05)
    assert p.total.worst_lateness == pytest.approx(0.046) and p.lateness.count == 0
    for k in range(25, 56):
        p.due(100.0 + k * 4e-3 + 1e-3)
    assert p.lateness.count == 30
    assert p.lateness.quantile(0.5) == pytest.approx(1e-3, rel=0.06)


def test_a_wake_up_before_its_time_is_not_late_and_plans_the_next_one() -> None:
    p = pacer()
    assert p.due(100.0 + 2e-3) == 2
    assert p.wait(100.0 + 2e-3) == pytest.approx(6e-3)
    assert p.wait(200.0) == 0.0, "no sleep is negative"
    assert p.total == Pacing()


def test_the_usual_lateness_counts_from_the_26th_wake_up() -> None:
    p = pacer()
    for k in range(1, 29):
        p.due(100.0 + k * 4e-3)
    assert p.lateness.count == 3


def test_limits_hold_up_to_and_with_their_values() -> None:
    """Numbers that are exact in binary: a step of 2^-10 s."""
    step = 2.0**-10
    p = Pacer(step, 4, 4, 4 * step)
    p.start(100.0)
    assert p.due(100.0 + 8 * step) == 4, "behind by as much as patience allows, and no more"
    assert p.total == Pacing(overruns=1, dropped=0, worst_lateness=4 * step), "a whole period late"
    assert p.due(100.0 + 14 * step) == 4, "behind by more"
    assert p.total.dropped == 6


@pytest.mark.parametrize(("budget", "patience"), [(3, 0.5), (40, 1e-3)])
def test_senseless_settings(budget: int, patience: float) -> None:
    with pytest.raises(InputError, match="must be at least"):
        Pacer(STEP, 4, budget, patience)


@given(st.lists(st.floats(0.0, 0.3), min_size=1, max_size=200))
def test_every_step_is_taken_or_counted_as_dropped(naps: list[float]) -> None:
    p = pacer()
    now, taken = 100.0, 0
    for nap in naps:
        now += nap
        due = p.due(now)
        assert 0 <= due <= 40
        taken += due
    for _ in range(100_000):
        due = p.due(now)
        taken += due
        if due == 0:
            break
    assert taken + p.total.dropped == pytest.approx((now - 100.0) / STEP, abs=1.01)


def test_ticks_stay_on_their_grid() -> None:
    ticker = Ticker(0.005, 100.0)
    assert not ticker.due(100.0049) and ticker.wait(100.0) == pytest.approx(0.005)
    assert ticker.due(100.007) and not ticker.due(100.0099) and ticker.due(100.0101)
    assert ticker.lost == 0 and ticker.warning() == ""


def test_lost_ticks_are_counted_and_told_once() -> None:
    ticker = Ticker(0.005, 0.0)
    assert ticker.due(0.3021) and ticker.lost == 59
    assert ticker.warning() == "no tick for 0.302 s: this process was not able to run"
    assert ticker.wait(0.3021) == pytest.approx(0.0029) and ticker.due(0.305)
    assert ticker.lost == 59 and ticker.warning() == ""
