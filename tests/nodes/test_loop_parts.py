"""Parts of the loop: spreads, stop watch, a lock in turn, what is asked of the operating system."""

import gc
import os
import threading

import numpy as np
import pytest

from ab_sim.nodes import realtime
from ab_sim.nodes.drive_health import ABSENT, NewWarnings
from ab_sim.nodes.pacing import DurationHistogram, StageTimer
from ab_sim.nodes.realtime import FairLock
from tests.forked import forked


def test_quantiles_are_those_of_the_durations() -> None:
    durations = np.random.default_rng(1).lognormal(np.log(1e-3), 2.0, 20_000)
    spread = DurationHistogram()
    assert spread.values("lateness") == {} and spread.quantile(0.5) == 0.0
    for duration in durations.tolist():
        spread.add(duration)
    for share in (0.5, 0.99, 0.999):
        exact = np.quantile(durations, share, method="inverted_cdf")
        assert exact * (1 - 1e-9) <= spread.quantile(share) <= 1.06 * exact
    assert spread.quantile(1.0) == spread.worst == durations.max()
    assert list(spread.values("lateness")) == [
        f"lateness, {name} [s]" for name in ("p50", "p99", "p99.9", "worst")
    ]


@pytest.mark.parametrize("duration", [0.0, -1.0, 1e-12, 1e6])
def test_what_no_class_is_for_is_counted_too(duration: float) -> None:
    spread = DurationHistogram()
    spread.add(duration)
    assert spread.count == 1 and spread.quantile(0.5) == max(duration, 0.0)


def test_stages() -> None:
    ticks = iter([0, 1000, 4000, 10_000, 13_000, 14_000, 20_000, 20_500, 20_700])
    stages = StageTimer("inputs", "integration", clock=lambda: next(ticks))
    for _ in range(2):
        stages.begin()
        stages.end("inputs")
        stages.end("integration")
    assert stages.values() == {
        "inputs, mean [s]": "0.0000020",
        "inputs, longest [s]": "0.0000030",
        "integration, mean [s]": "0.0000020",
        "integration, longest [s]": "0.0000030",
    }
    stages.begin()
    stages.end("inputs")
    assert stages.values()["inputs, longest [s]"] == "0.0000005", "since it was last asked"


def test_who_waits_has_the_lock_next() -> None:
    """A loop that takes it again at once keeps nobody from it."""
    lock, done, rounds = FairLock(), threading.Event(), 0

    def wait_for_it() -> None:
        with lock:
            done.set()

    with lock:
        waiting = threading.Thread(target=wait_for_it)
        waiting.start()
        while not lock._next.locked():
            pass
    while not done.is_set():
        with lock:
            rounds += 1
    waiting.join()
    assert rounds <= 1


def test_real_time_is_granted_or_refused_with_a_reason() -> None:
    """In a thread of its own, which ends with what it was granted."""
    said: list[str] = []
    policies: list[int] = []

    def ask() -> None:
        said.append(realtime.request_priority(10))
        policies.append(os.sched_getscheduler(0))

    thread = threading.Thread(target=ask)
    thread.start()
    thread.join()
    if said == [""]:
        assert policies == [os.SCHED_FIFO | os.SCHED_RESET_ON_FORK], "and not for its children"
    else:
        assert "the system refuses" in said[0] and "limits.conf" in said[0]
        assert policies == [os.SCHED_OTHER]
    assert os.sched_getscheduler(0) == os.SCHED_OTHER, "of that thread only"


def test_a_priority_that_there_is_not_is_refused() -> None:
    assert "real-time priority 1000: the system refuses (Invalid argument)" in (
        realtime.request_priority(1000)
    )


class Knot:
    """What only a search for garbage can get rid of."""

    alive = 0

    def __init__(self) -> None:
        self.me = self
        Knot.alive += 1

    def __del__(self) -> None:
        Knot.alive -= 1


def test_garbage_by_hand() -> None:
    try:
        real_time = realtime.RealTimeRequests(priority=0, memory=False, by_hand=True)
        assert real_time.apply() == []
        for _ in range(5000):
            Knot()
        assert Knot.alive == 5000 and not gc.isenabled()
        real_time.collect_garbage()
        assert Knot.alive == 0
    finally:
        gc.enable()
        gc.unfreeze()


def test_what_lives_is_left_out_of_searches_for_garbage_until_it_is_asked_for_again() -> None:
    try:
        knot = Knot()
        realtime.RealTimeRequests(priority=0, memory=False, by_hand=False).apply()
        assert gc.isenabled()
        assert len(gc.get_objects()) < gc.get_freeze_count() / 100, "all that a search looks at"
        del knot
        gc.collect()
        assert Knot.alive == 1, "it lived then"
        realtime.freeze_garbage_collector()
        assert Knot.alive == 0
    finally:
        gc.unfreeze()


def frozen_twice() -> None:
    Knot()
    gc.freeze()
    realtime.freeze_garbage_collector()
    assert Knot.alive == 1


def test_objects_that_were_frozen_before_the_fork_stay_frozen() -> None:
    process = forked(frozen_twice)
    process.join()
    assert process.exitcode == 0


def test_a_warning_is_new_until_it_has_been_reported() -> None:
    new = NewWarnings()
    assert new.of(["fell behind: 3 steps", "no command for 2 s"], 0.0) == [
        "fell behind: 3 steps", "no command for 2 s",
    ]  # fmt: skip
    assert new.of(["fell behind: 71 steps", "2 publishers on /a"], 1.0) == ["2 publishers on /a"]
    assert new.of(["2 publishers on /a, 1 possibly dead"], 2.0) != [], "its words changed"
    assert new.of(["no command for 2 s"], 9.0) == []
    assert new.of(["no command for 2 s"], 9.1 + ABSENT) == ["no command for 2 s"]
