"""Starts of a search shared by processes: the same answer, and the best so far at Ctrl-C."""

import multiprocessing
from typing import Any

import pytest

import ab_sim
from ab_sim.base.errors import Interrupted
from ab_sim.identification.result import INTERRUPTED, Identification
from ab_sim.identification.run import IdentificationSettings, run_identification
from tests.forked import start_workers_at_once
from tests.identification import drives

MASS = "balls.mass"


def found(count: int, **more: object) -> Identification:
    """A drive whose balls' mass and start angles are looked for by so many processes."""
    drive = drives.scene({"duration": 1.0})
    begin = drives.scene({MASS: 5e-4, "duration": 1.0})
    settings = IdentificationSettings((MASS,), propose=False)
    return run_identification(begin, [drives.measured(drive)], settings, workers=count, **more)  # type: ignore[arg-type]


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Start processes at once; return a list with an entry per start."""
    start_workers_at_once(monkeypatch)
    begun: list[str] = []
    context = multiprocessing.get_context

    def counted(method: str) -> Any:
        begun.append(method)
        return context(method)

    monkeypatch.setattr(multiprocessing, "get_context", counted)
    return begun


def test_any_number_of_processes_finds_the_same_to_the_bit(started: list[str]) -> None:
    alone, shared = found(1), found(2)
    assert len(started) == 1
    assert alone.report() == shared.report()
    assert alone.runs > 1000


def test_the_best_so_far_is_left_when_shared_work_is_interrupted(started: list[str]) -> None:
    def tell(what: str, done: int, of: int) -> None:
        if "first 100 %" in what and done == 1:
            raise Interrupted("interrupted")

    early = found(2, tell=tell)
    assert len(started) == 1 and early.verdict == INTERRUPTED
    # As the first 70 % of the recording tell it.
    assert early[MASS].value != 5e-4 and early[MASS].value == pytest.approx(5.5e-4, rel=0.2)
    assert ab_sim.simulate(early.scene).trajectory["time"][-1] == 1.0
