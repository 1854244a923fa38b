"""Work in several processes: order of results, errors, and killed processes."""

import contextlib
import multiprocessing
import os
import signal
import time
from collections.abc import Iterator

import pytest

from ab_sim.base import workers
from ab_sim.base.errors import SceneError
from ab_sim.base.workers import WorkerLost, Workers
from tests.design.calls import picky, where


@pytest.fixture(autouse=True)
def shared_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workers, "TRIAL", 0.0)
    monkeypatch.setattr(workers, "WORTH_IT", 0.0)


def killed(number: int) -> int:
    if number == 30:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def slow(number: int) -> int:
    time.sleep(0.1 if number < 2 else 3600.0)
    return number


def test_results_come_in_order_and_from_all_processes() -> None:
    with Workers(2) as each:
        first = list(each.each(where, range(50), chunk=2))
        second = list(each.each(where, range(7)))
    assert [number for number, _ in first] == list(range(50))
    assert [number for number, _ in second] == list(range(7))
    homes = {home for _, home in first[2:]}
    assert len(homes) == 2 and os.getpid() not in homes
    assert {home for _, home in second} <= homes, "processes are there until the end"
    for home in homes:
        with pytest.raises(ProcessLookupError):
            os.kill(home, 0)


def blocked(_: int) -> tuple[int, set[int]]:
    return os.getpid(), set(signal.pthread_sigmask(signal.SIG_BLOCK, []))


def test_ctrl_c_is_left_to_this_process() -> None:
    """Workers block Ctrl-C from their first instruction on, as a terminal sends it to all."""
    with Workers(2) as each:
        found = dict(each.each(blocked, range(40), chunk=1))
    assert not found.pop(os.getpid()) & {signal.SIGINT, signal.SIGHUP}
    assert len(found) == 2
    assert all({signal.SIGINT, signal.SIGHUP} <= signals for signals in found.values())


def test_one_process_is_this_one() -> None:
    with Workers(1) as each:
        assert list(each.each(where, range(5))) == [(n, os.getpid()) for n in range(5)]


def test_an_error_is_raised_as_itself() -> None:
    with pytest.raises(SceneError, match="must be less"), Workers(2) as each:
        list(each.each(picky, range(50), chunk=2))


def test_a_killed_process_is_said() -> None:
    with pytest.raises(WorkerLost, match="same command continues it"), Workers(2) as each:
        list(each.each(killed, range(50), chunk=2))


def test_the_end_does_not_wait_for_long_work() -> None:
    with contextlib.suppress(KeyboardInterrupt), Workers(2) as each:
        results: Iterator[int] = each.each(slow, range(50), chunk=1)
        assert next(results) == 0 and next(results) == 1
        raise KeyboardInterrupt
    assert not multiprocessing.active_children()


@pytest.mark.parametrize("after", [0.0, 0.02, 0.1])
def test_processes_that_are_killed_while_others_start(
    after: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Kill each process before the next one starts, as a signal to the whole group does."""
    started = workers.multiprocessing.get_context("spawn").Process.start

    def start_and_kill(process: workers.BaseProcess) -> None:
        started(process)
        time.sleep(after)
        assert process.pid is not None
        os.kill(process.pid, signal.SIGKILL)

    monkeypatch.setattr(
        workers.multiprocessing.get_context("spawn").Process, "start", start_and_kill
    )
    with pytest.raises(WorkerLost), Workers(2) as each:
        list(each.each(where, range(50)))
