"""Work on a Dask cluster: the same bits as here, and one clear line where it fails."""

import functools
import importlib
import os
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pyarrow
import pytest

import ab_sim
from ab_sim.base.errors import InputError, SceneError
from ab_sim.base.workers import WorkerLost
from ab_sim.design import work
from ab_sim.design.cluster import Cluster, ClusterUnusable, checked_address
from tests.cli.killed import KeptWork
from tests.design import calls
from tests.design.dask_cluster import DaskCluster, free_port
from tests.forked import forked
from tests.waiting import PATIENCE, until

pytestmark = pytest.mark.long

pytest.importorskip("distributed")
SCENE = ["duration=0.4"]
OVER = {
    "balls.mass": "0.5 g..3 g:10",
    "effects.viscous_drag.coefficient": "log:0.1..10:10",
    "balls.count": [-1, 2],
}
"""Half of the runs fail, which is a result, too."""


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[DaskCluster]:
    """Of two workers, one of which has an older processor, as far as our code can tell."""
    with DaskCluster(tmp_path_factory.mktemp("cluster"), 1, ALLOWED_FAILURES="1") as found:
        found.add_worker(AB_SIM_CPU_FEATURES="-avx512f")
        until(lambda: found.said().count("Registered to:") == 2, "both are there", PATIENCE)
        yield found


@pytest.fixture
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(work, "ENOUGH", 1e-9)
    monkeypatch.setattr(work, "CHUNK_SECONDS", 1e-9)


def swept(scheduler: str | None = None) -> pyarrow.Table:
    scene = ab_sim.load_scene("thesis-hold", [*SCENE, "start.ball_angles="])
    return ab_sim.sweep(scene, OVER, scheduler=scheduler).table


def test_results_are_those_of_this_process_to_the_bit(
    cluster: DaskCluster, small_chunks: None, folder: Path
) -> None:
    here = swept()
    for file in folder.glob("*/*"):
        file.unlink()
    assert swept(cluster.address).equals(here) and here["failure"].null_count == 100


def test_they_come_in_order_from_all_workers_and_things_are_made_when_they_are_sent(
    cluster: DaskCluster,
) -> None:
    things = calls.Lazy(60)
    with Cluster(cluster.address) as each:
        results = each.each(calls.where, things)
        found = [next(results)]
        assert max(things.made) < 40
        found += results
        again = list(each.each(calls.where, range(7)))
    assert [number for number, _ in found] == list(range(60))
    assert [number for number, _ in again] == list(range(7))
    homes = {home for _, home in found}
    assert len(homes) == 2 and os.getpid() not in homes


def test_nothing_to_do_needs_no_scheduler() -> None:
    with Cluster("127.0.0.1:1") as each:
        assert not list(each.each(calls.where, []))


def test_an_error_is_raised_as_itself(cluster: DaskCluster) -> None:
    with pytest.raises(SceneError, match="must be less"), Cluster(cluster.address) as each:
        list(each.each(calls.picky, range(50)))
    with pytest.raises(ModuleNotFoundError, match="roads"), Cluster(cluster.address) as each:
        list(each.each(calls.without_a_package, range(2)))


def test_a_worker_of_other_sources_is_refused(tmp_path: Path) -> None:
    """It differs in a module that is not ab_sim's, by a byte."""
    source = (Path(__file__).parent / "calls.py").read_text()
    (tmp_path / "own_calls.py").write_text(source)
    there = tmp_path / "there"
    there.mkdir()
    (there / "own_calls.py").write_text(f"{source}#")
    answer = tmp_path / "answer.txt"
    time.sleep(0.05)  # a file that is as new as the process may not be what it has imported
    with DaskCluster(tmp_path) as small:
        small.add_worker(there)
        forked(_ask, tmp_path, small.address, answer).join(PATIENCE)
        assert "another source of own_calls" in answer.read_text(), small.said()
        assert "would not give the same bits" in answer.read_text()
        small.kill_worker()
        small.add_worker(without="ab_sim")
        with pytest.raises(ClusterUnusable, match="worker has no ab_sim"):
            with Cluster(small.address) as each:
                list(each.each(calls.where, range(3)))


def _ask(path: Path, address: str, answer: Path) -> None:
    """Request work of a module in a folder, and write down the refusal; in a forked process."""
    sys.path.insert(0, str(path))
    where = importlib.import_module("own_calls").where
    try:
        with Cluster(address) as each:
            list(each.each(where, range(3)))
    except ClusterUnusable as refusal:
        answer.write_text(str(refusal), encoding="utf-8")


@pytest.mark.parametrize(
    "address", ["", "nonsense", "host:", "host:0", "host:x", "host:99999", "http://a:1", "a:1/x"]
)
def test_an_address_that_cannot_be_one_is_refused(address: str) -> None:
    with pytest.raises(InputError, match="must be HOST:PORT, tcp://HOST:PORT"):
        Cluster(address)


def test_addresses() -> None:
    assert checked_address("host:8786") == "tcp://host:8786"
    assert checked_address("tls://[::1]:8786") == "tls://[::1]:8786"


def test_where_nobody_listens_it_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ab_sim.design.cluster.ANSWERS", 1.0)
    address = f"tcp://127.0.0.1:{free_port()}"
    with pytest.raises(ClusterUnusable, match=f"^{address}: no Dask scheduler"):
        with Cluster(address) as each:
            list(each.each(calls.where, range(3)))
    with pytest.raises(ClusterUnusable, match="no Dask scheduler"):
        with Cluster(address.replace("tcp", "tls")) as each:  # without certificates
            list(each.each(calls.where, range(3)))


def test_without_dask_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"pip install 'ab_sim\[cluster\]'"):
        Cluster("127.0.0.1:8786")


def test_workers_and_scheduler_exclude_each_other() -> None:
    with pytest.raises(InputError, match="give one"):
        ab_sim.sweep("thesis-hold", {"balls.mass": "1 g..2 g:2"}, workers=2, scheduler="a:1")


def lines_but_progress(said: str) -> list[str]:
    return [line for line in said.splitlines() if line and not line.startswith("no-ball: ")]


def test_the_command_with_its_scheduler_killed_interrupted_and_given_again(tmp_path: Path) -> None:
    with DaskCluster(tmp_path, 1) as small:
        work = KeptWork(
            tmp_path, "sweep", "no-ball", "--set", "duration=10", "--over",
            "rotor.eccentricity=1e-5..1e-3:1500", "--parquet", "s.parquet",
            "--scheduler", small.address,
        )  # fmt: skip
        command = work.begin(5)  # three or four are made here
        small.kill_scheduler()
        first = command.done()
        assert first.returncode == 1, first.stderr
        assert lines_but_progress(first.stderr) == [
            f"ab-sim: the scheduler at {small.address} is gone; finished work is kept, the same "
            "command continues it"
        ]
        before = len(work.parts())
        small.begin()
        small.add_worker()
        command = work.begin(1)
        command.signal(signal.SIGINT)
        second = command.done()
        assert second.returncode == 130, second.stderr
        assert lines_but_progress(second.stderr) == [
            "ab-sim: interrupted; finished work is kept, the same command continues it"
        ]
        assert len(work.parts()) >= before + 1
        done = work.whole()
        assert done.returncode == 0 and "1500 runs" in done.stdout, done.stderr
    assert ab_sim.open_sweep(tmp_path / "s.parquet").table["run"].to_pylist() == [*range(1500)]
    assert sorted(work.runs()) == [*range(1500)]


def test_ordinary_sweeps_do_not_import_dask(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("dask", "distributed"):
        monkeypatch.setitem(sys.modules, name, None)  # importing it would raise an error
    found = ab_sim.sweep("no-ball", {"rotor.eccentricity": [1e-4]})
    assert found.table["failure"].null_count == 1


def test_workers_and_a_scheduler_that_are_lost(
    cluster: DaskCluster, capfd: pytest.CaptureFixture[str]
) -> None:
    """The last test of this cluster: nothing is left of it."""
    said: list[str | None] = []
    with Cluster(cluster.address) as each:
        results = each.each(functools.partial(calls.slow, 0.05), range(60))
        found = [next(results)]
        cluster.kill_worker()
        found += results
        assert found == list(range(60)), "the other one has made up for it"

        def add(what: str | None) -> None:
            if what and not said:
                said.append(what)
                cluster.add_worker()

        each.waiting = add
        with pytest.raises(WorkerLost, match="terminated 2 workers"):
            list(each.each(calls.killed, range(30, 31)))
        assert said == [f"waiting for workers at {cluster.address}"]

        cluster.add_worker()

        def stop(what: str | None) -> None:
            if what is None:  # workers are at work; on a busy machine not at once
                raise KeyboardInterrupt

        each.waiting = stop
        with pytest.raises(KeyboardInterrupt):
            list(each.each(functools.partial(calls.slow, 2.0), range(200)))
    capfd.readouterr()
    cluster.add_worker()
    with pytest.raises(WorkerLost, match="is gone; finished work"):
        with Cluster(cluster.address) as each:
            results = each.each(functools.partial(calls.slow, 0.1), range(200))
            next(results)
            cluster.kill_scheduler()
            list(results)
    assert capfd.readouterr() == ("", ""), "Dask is silent"
