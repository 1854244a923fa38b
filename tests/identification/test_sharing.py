"""Starts of a search shared by processes: the same answer, and the best so far at Ctrl-C."""

import pytest

import ab_sim
from ab_sim.base import workers
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
def started(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Processes are started at once; what is given counts them."""
    start_workers_at_once(monkeypatch)
    begun: list[int] = []
    start = workers.Workers._start

    def counted(self: workers.Workers) -> None:
        begun.append(self._count)
        start(self)

    monkeypatch.setattr(workers.Workers, "_start", counted)
    return begun


def test_any_number_of_processes_finds_the_same_to_the_bit(started: list[int]) -> None:
    alone, shared = found(1), found(2)
    assert started == [2]
    assert alone.report() == shared.report()
    assert alone.runs > 1000


def test_the_best_so_far_is_left_when_shared_work_is_interrupted(started: list[int]) -> None:
    def tell(what: str, done: int, of: int) -> None:
        if "first 100 %" in what and done == 1:
            raise Interrupted("interrupted")

    early = found(2, tell=tell)
    assert started == [2] and early.verdict == INTERRUPTED
    # As the first 70 % of the recording tell it.
    assert early[MASS].value != 5e-4 and early[MASS].value == pytest.approx(5.5e-4, rel=0.2)
    assert ab_sim.simulate(early.scene).trajectory["time"][-1] == 1.0
